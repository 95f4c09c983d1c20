// problem: what the server says when it refuses (application/problem+json, RFC 9457), as text for standard error.
#pragma once

#include <string>

#include "client/cli/failure.hpp"
#include "client/cli/http_client.hpp"
#include "client/cli/text.hpp"

namespace colony::client {

/// `<title>: <detail>`, one line `  <pointer or parameter>: <message>` for each error, the request id, when to try
/// again. An answer that is no problem document (a proxy's page) is quoted, shortened.
/// `body_name`: what the empty pointer, all of the body that was sent, is called.
std::string problem_text(const HttpResponse& response, const std::string& body_name = "(whole document)");

/// Throws Failure kRefused unless the answer is 2xx.
void require_ok(const HttpResponse& response, const std::string& body_name = "(whole document)");

/// The body as JSON. Failure kRefused for anything that is not: then this is not a colony server.
Json body_json(const HttpResponse& response);

/// GET, require_ok, body_json.
Json get_json(HttpClient& client, const std::string& target);

}  // namespace colony::client
