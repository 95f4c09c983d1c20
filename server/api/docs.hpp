// docs: the interface as a page to read, made from the OpenAPI document alone, so that it cannot say anything else.
// Promise: no script, no outside resource, no inline style; every text is escaped. Works from any base path.
// Threads: pure.
#pragma once

#include <string>
#include <string_view>

#include "server/api/json.hpp"

namespace colony::server::api {

/// Stands in the page for the address that it is asked at.
inline constexpr std::string_view kDocsAddress = "{server-address}";

/// `tokens_required`: the examples then send one where the operation needs it.
std::string docs_page(const Json& openapi, std::string_view base_path, bool tokens_required);
/// The page for whoever asks at this address ("https://lab.example/colony").
std::string docs_at(std::string_view page, std::string_view address);

/// The sections before the operations.
std::string docs_guide(bool tokens_required);
std::string docs_escaped(std::string_view text);

/// /docs.css
std::string_view docs_style();

}  // namespace colony::server::api
