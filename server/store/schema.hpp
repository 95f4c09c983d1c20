// schema: the tables of DATA/colony.db, and how an older file becomes a newer one (server/DESIGN.md lists the columns).
// Promise: a migration is one transaction: the file is of the version before or of the version after.
// Errors:  DbError; IncompatibleDatabase for a file of a newer program or of another one.
#pragma once

#include <stdexcept>

#include "server/store/connection.hpp"

namespace colony::server {

class IncompatibleDatabase : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Write-ahead log, durable commits; then every migration the file lacks.
void prepare_database(Connection& writer);

}  // namespace colony::server
