// kept: answers that took seconds to make (steps of an analysis, figures), kept for who asks next.
// Promise: what is found is what was made, byte for byte: it is kept under its tag, which names all that it is a function of.
// Limits:  bytes_max of bodies together and entries_max of them; those used last stay. A larger one is not kept.
// Threads: synchronises itself; of two that make the same answer, either is kept.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "server/http/message.hpp"

namespace colony::server::api {

inline constexpr std::size_t kKeptBytesMax = 64 * 1024 * 1024;
inline constexpr std::size_t kKeptEntriesMax = 4096;  // small bodies cost more than their bytes: under 1 kB each beside them

class KeptAnswers {
 public:
  KeptAnswers(std::size_t bytes_max, std::size_t entries_max) : bytes_max_(bytes_max), entries_max_(entries_max) {}
  /// Status 200, with its Content-Type and tag; nullopt: to be made.
  std::optional<http::Response> find(const std::string& tag);
  /// A whole body, no stream. `made_of`: the ids of what it was made of and goes with.
  void keep(const std::string& tag, std::vector<std::string> made_of, const http::Response& response);
  /// All that was made of it. What is still being made of it meanwhile may be kept afterwards: nobody can ask for it, and it gives way in turn.
  void drop(std::string_view id);

 private:
  struct Kept {
    std::string tag, content_type;
    std::vector<std::string> made_of;
    std::shared_ptr<const std::string> body;
  };
  using Entry = std::list<Kept>::iterator;
  void erase(Entry entry);  // mutex_ is held

  const std::size_t bytes_max_, entries_max_;
  std::mutex mutex_;      // guards everything below
  std::list<Kept> kept_;  // used last: first; at most entries_max_, and bytes_max_ of bodies
  std::unordered_map<std::string_view, Entry> by_tag_;  // of each; the keys are the entries' own texts
  std::size_t bytes_ = 0;
};

}  // namespace colony::server::api
