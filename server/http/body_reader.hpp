// body_reader: takes a request body out of the bytes that follow a header, by length or by chunks.
// Why:     Beast decodes the chunks, behind a header made here and not the client's: the gate alone decides what a
//          header means.
// Promises never to hold more than the limit, to stop at the last byte of the body (a pipelined request stays in the
//          input), and to refuse what Beast would let pass: chunk extensions and trailers without bound.
// Threads: one at a time.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "server/http/gate.hpp"

namespace colony::server::http {

class BodyReader {
 public:
  enum class State { kNeedMore, kComplete, kRefused };

  BodyReader(const RequestHead& head, std::size_t body_bytes_max);
  ~BodyReader();

  /// Removes from `input` what it has understood.
  State feed(std::string& input);
  const Refusal& refusal() const { return refusal_; }  // after kRefused
  std::string take_body();                             // after kComplete

 private:
  struct Chunks;
  State feed_chunks(std::string& input);
  State refuse(Refusal refusal);

  std::size_t remaining_bytes_ = 0;  // of a body with a length
  std::string body_;
  std::unique_ptr<Chunks> chunks_;  // of a chunked body
  std::size_t body_bytes_max_;
  Refusal refusal_;
};

}  // namespace colony::server::http
