// router: from method and path to a handler. 404 and 405 (with Allow) are problem documents made here.
// Threads: add only before the server starts; dispatch from any thread.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/message.hpp"

namespace colony::server::http {

/// What a request needs where tokens are required. Open: nothing.
enum class Access { kOpen, kRead, kSubmit, kAdmin };

using Handler = std::function<Response(const Request&)>;

/// application/problem+json (RFC 9457); http/ needs it for its own refusals and has no JSON library, so it escapes by itself.
/// `code` e.g. "not-found" becomes type urn:colony:problem:<code>.
Response problem(int status, std::string_view code, std::string_view title, std::string_view detail, std::string_view request_id);

class Router {
 private:
  struct Route;

 public:
  /// Where a request goes: looked up once, then asked about. Good as long as the router is.
  class Destination {
    friend class Router;
    std::vector<std::string> path;
    const std::vector<std::string>* pattern = nullptr;  // null: there is nothing
    const Route* route = nullptr;                       // null: it does not take the method
    bool is_server = false;                             // OPTIONS *: the server itself
  };

  /// `pattern`: segments, "{}" captures one, e.g. "/v1/jobs/{}/events". HEAD is answered by the GET handler without its body.
  /// Heavy handlers (seconds of computing) run on at most half of the worker threads.
  enum class Weight { kLight, kHeavy };
  void add(std::string method, std::string pattern, Handler handler, Weight weight = Weight::kLight,
           Access access = Access::kRead);
  /// A header of the answers to OPTIONS for this pattern, e.g. Accept-Patch.
  void advertise(std::string_view pattern, std::string name, std::string value);
  /// Of a route that is there: what can be answered from memory, on an I/O thread, without waiting for anything; nullopt: dispatch.
  using ReadyHandler = std::function<std::optional<Response>(const Request&)>;
  void set_ready(std::string_view method, const std::string& pattern, ReadyHandler handler);
  /// Who hears what a handler or a stream threw, and why a handler answered 500 (any thread); the client gets the request id only.
  void on_failure(std::function<void(const Request&, std::string_view what)> log) { failure_log_ = std::move(log); }

  /// The pattern is chosen before the method, a literal segment before a capture.
  Destination find(std::string_view method, std::string_view path) const;
  /// HEAD needs what GET does, OPTIONS nothing (a browser sends it without the token); what is nowhere needs a token all the
  /// same: 404 is told to those who are let in.
  static Access access_of(std::string_view method, const Destination& to);
  static bool is_heavy(const Destination& to);
  /// The answer of such a handler. Sets path_params.
  std::optional<Response> dispatch_ready(Request& request, const Destination& to) const;
  std::optional<Response> dispatch_ready(Request& request) const { return dispatch_ready(request, find(request.method, request.path)); }
  /// Runs the handler. An exception becomes 500 "internal" with the request id, without details. OPTIONS is answered with 204 and Allow, of
  /// the target "*" with what there is anywhere.
  Response dispatch(Request& request, const Destination& to) const;
  Response dispatch(Request& request) const { return dispatch(request, find(request.method, request.path)); }
  void report_failure(const Request& request, std::string_view what) const;
  /// If it is one: a status 500 that was answered, not thrown.
  void report_if_failed(const Request& request, const Response& response) const;

 private:
  struct Route { std::string method; std::vector<std::string> segments; Handler handler; Weight weight; Access access; };
  const std::vector<std::string>* pattern_of(const std::vector<std::string>& path) const;   // nullptr: none fits
  const Route* route_of(const std::vector<std::string>& pattern, std::string_view method) const;   // GET answers HEAD
  Response answer_options(const Destination& to) const;
  std::string allow_of(const Destination& to) const;
  struct Advert { std::vector<std::string> segments; std::string name, value; };
  std::vector<Route> routes_;
  std::vector<std::pair<std::size_t, ReadyHandler>> ready_;   // index of the route
  std::vector<Advert> adverts_;
  std::function<void(const Request&, std::string_view)> failure_log_;
};

}  // namespace colony::server::http
