// docs: the interface as a page to read, made from the OpenAPI document alone, so that it cannot say anything else.
// Promise: no script, no outside resource, no inline style; every text is escaped. Works from any base path.
// Threads: pure.
#pragma once

#include <string>
#include <string_view>

#include "server/api/json.hpp"

namespace colony::server::api {

std::string docs_page(const Json& openapi, std::string_view base_path);

/// /docs.css
std::string_view docs_style();

}  // namespace colony::server::api
