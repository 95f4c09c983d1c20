// endpoints_service: the operations that are about the service and not about jobs; a part of the one table (endpoints()).
#pragma once

#include <vector>

#include "server/api/api.hpp"

namespace colony::server::api {

std::vector<Endpoint> service_endpoints();

}  // namespace colony::server::api
