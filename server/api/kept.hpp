// kept: answers that took seconds to make (steps of an analysis, figures), kept for who asks next.
// Promise: what is found is what was made, byte for byte: it is kept under its tag, which names all that it is a function of.
// Limits:  bytes_max of bodies together; those used last stay. A larger one is not kept.
// Threads: synchronises itself; of two that make the same answer, either is kept.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "server/http/message.hpp"

namespace colony::server::api {

inline constexpr std::size_t kKeptBytesMax = 64 * 1024 * 1024;

class KeptAnswers {
 public:
  explicit KeptAnswers(std::size_t bytes_max) : bytes_max_(bytes_max) {}
  /// Status 200, with its Content-Type and tag; nullopt: to be made.
  std::optional<http::Response> find(const std::string& tag);
  /// A whole body, no stream.
  void keep(const std::string& tag, const http::Response& response);

 private:
  struct Kept {
    std::string tag, content_type;
    std::shared_ptr<const std::string> body;
  };
  const std::size_t bytes_max_;
  std::mutex mutex_;      // guards everything below
  std::list<Kept> kept_;  // used last: first; at most bytes_max_ of bodies
  std::size_t bytes_ = 0;
};

}  // namespace colony::server::api
