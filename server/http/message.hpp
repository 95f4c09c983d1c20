// message: a request and a response as plain values, so that handlers need no socket and tests need no server.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace colony::server::http {

/// Header names are compared without case; order is kept.
class Headers {
 public:
  void set(std::string_view name, std::string_view value);             // replaces
  void add(std::string_view name, std::string_view value);
  std::optional<std::string_view> get(std::string_view name) const;    // the first
  std::size_t count(std::string_view name) const;
  const std::vector<std::pair<std::string, std::string>>& all() const { return items_; }

 private:
  std::vector<std::pair<std::string, std::string>> items_;
};

/// What somebody may do; each includes those before it.
enum class Scope { kRead, kSubmit, kAdmin };

/// Who asks. While tokens are off, every local user is "local" and an admin.
struct Principal {
  std::string name = "local";                                  // goes into submitted_by and the log of a job
  Scope scope = Scope::kAdmin;
  std::string token_id;                                        // empty: no token was needed
};

struct Request {
  std::string method;                                          // "GET", ...
  std::string path;                                            // percent-decoded, starts with '/', no query, base path removed
  std::vector<std::pair<std::string, std::string>> query;      // percent-decoded, in order
  Headers headers;
  std::string body;                                            // complete, within the limit
  std::string request_id;
  Principal principal;                                         // set before the body is read
  std::vector<std::string> path_params;                        // filled by the router, e.g. the job id
  std::shared_ptr<const std::atomic<bool>> gives_up;           // becomes true when nobody will take the answer: the peer has left, or
                                                               // the server drains; null: nobody says
};

/// A body that is made piece by piece. The session calls pull on a worker thread, never twice at once.
class BodySource {
 public:
  enum class Pull { kMore, kWait, kEnd };
  virtual ~BodySource() = default;
  /// Appends the next piece (at most about 64 KiB) to `out`. kMore: call again once sent; kWait: nothing now, call again when
  /// woken (or after keep_alive); kEnd: the body is complete (what was appended is still sent).
  virtual Pull pull(std::string& out) = 0;
  struct Ready {
    Pull pull = Pull::kWait;
    std::shared_ptr<const std::string> shared;                 // sent before `out`, uncopied; null: nothing
  };
  /// As pull, but of what is in memory already: called on an I/O thread before every pull but the first, so it neither waits nor asks
  /// a store. nullopt: nothing was appended, and pull is needed.
  virtual std::optional<Ready> pull_now(std::string& out) { (void)out; return std::nullopt; }
  /// Asked after a pull that gave kWait, on the same thread: how soon to pull again even if nobody wakes; nullopt: no need.
  virtual std::optional<std::chrono::milliseconds> wake_after() { return std::nullopt; }
  /// The session registers how it wants to be woken; `wake` may be called from any thread, also spuriously.
  virtual void on_ready(std::function<void()> wake) { (void)wake; }
  /// What to send after 15 s without a piece (an SSE comment); empty: nothing.
  virtual std::string_view keep_alive() const { return {}; }
  /// What to send when the server drains, before the end ("event: bye" of a stream); empty: nothing.
  virtual std::string_view farewell() const { return {}; }
};

struct Response;

/// An answer that waits for something without holding a thread. The session calls `on_ready` once, then `ask` at once, whenever woken,
/// and a last time when `wait_max` is over or the server drains; all of it, and the destructor, on worker threads.
class LaterAnswer {
 public:
  virtual ~LaterAnswer() = default;
  /// `wake` may be called from any thread, also spuriously, but not after this object is destroyed.
  virtual void on_ready(std::function<void()> wake) = 0;
  /// nullptr: not yet. With `is_last` there must be an answer, itself without `later`.
  virtual std::unique_ptr<Response> ask(bool is_last) = 0;
  virtual std::chrono::milliseconds wait_max() const = 0;
};

struct Response {
  int status = 200;
  Headers headers;                                             // Content-Type and the like; the session adds the rest
  std::string body;
  std::unique_ptr<BodySource> stream;                          // if set: sent chunked instead of body
  std::unique_ptr<LaterAnswer> later;                          // if set: nothing else counts, the answer comes from it
  std::string failure;                                         // with status 500: what failed, for the server's own log; not sent
  bool gave_up = false;                                        // it ended because of Request::gives_up, and nothing was done
};

}  // namespace colony::server::http
