#include "server/http/body_reader.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string_view>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/none.hpp>

#include "engine/base/check.hpp"

namespace colony::server::http {
namespace beast = boost::beast;
namespace {

constexpr std::size_t kExtensionBytesMax = 256;        // of one chunk
constexpr std::size_t kExtensionBytesTotalMax = 4096;  // of all chunks of a body
// What Beast cannot use yet stays in the input: a chunk's first line, or the trailer fields.
constexpr std::size_t kUnreadBytesMax = 8 * 1024;

// In what Beast leaves, every line still has its CRLF. It would wait for ever for the CR of a line that has none.
bool holds_bare_lf(std::string_view unread) {
  for (std::size_t at = unread.find('\n'); at != std::string_view::npos; at = unread.find('\n', at + 1)) {
    if (at == 0 || unread[at - 1] != '\r') return true;
  }
  return false;
}

// Beast asserts that a last chunk it has seen before comes again with five bytes at least: true of one behind a chunk (CRLF 0 CRLF), not of one that
// is all of an empty body. So it sees that one only when it is whole.
bool is_short_last_chunk(std::string_view unread) { return unread.size() < 5 && unread.starts_with("0\r\n"); }

}  // namespace

struct BodyReader::Chunks {
  beast::http::request_parser<beast::http::string_body> parser;
  std::function<void(std::uint64_t, beast::string_view, beast::error_code&)> on_header;
  std::size_t extension_bytes = 0;
  std::uint64_t announced_bytes = 0;  // of all chunks whose line was read whole
  bool has_data = false;  // a chunk that is not the last has begun
};

BodyReader::BodyReader(const RequestHead& head, std::size_t body_bytes_max) : body_bytes_max_(body_bytes_max) {
  if (!head.chunked) {
    remaining_bytes_ = static_cast<std::size_t>(head.content_length.value_or(0));
    CHECK(remaining_bytes_ <= body_bytes_max);  // the gate has refused the others
    return;
  }
  chunks_ = std::make_unique<Chunks>();
  // The bound is ours: Beast takes a chunk's size off its own each time it reads the line, and a line whose extension opens a quote it
  // reads again with every piece.
  chunks_->parser.body_limit(boost::none);
  chunks_->parser.eager(true);
  chunks_->on_header = [chunks = chunks_.get(), body_bytes_max](std::uint64_t size, beast::string_view extensions,
                                                                beast::error_code& error) {
    chunks->has_data = true;
    if (size > body_bytes_max - chunks->announced_bytes) {
      error = beast::http::error::body_limit;
      return;
    }
    chunks->announced_bytes += size;
    chunks->extension_bytes += extensions.size();
    if (extensions.size() > kExtensionBytesMax || chunks->extension_bytes > kExtensionBytesTotalMax) {
      error = beast::http::error::bad_chunk_extension;
    }
  };
  chunks_->parser.on_chunk_header(chunks_->on_header);
  std::string own_header = "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n";
  const auto state = feed_chunks(own_header);
  CHECK(state == State::kNeedMore && own_header.empty());
}

BodyReader::~BodyReader() = default;

BodyReader::State BodyReader::refuse(Refusal refusal) {
  refusal_ = std::move(refusal);
  return State::kRefused;
}

BodyReader::State BodyReader::feed(std::string& input) {
  if (chunks_) return feed_chunks(input);
  const std::size_t taken = std::min(remaining_bytes_, input.size());
  body_.append(input, 0, taken);
  input.erase(0, taken);
  remaining_bytes_ -= taken;
  return remaining_bytes_ == 0 ? State::kComplete : State::kNeedMore;
}

BodyReader::State BodyReader::feed_chunks(std::string& input) {
  auto& parser = chunks_->parser;
  std::size_t used = 0;
  beast::error_code error;
  while (!parser.is_done() && used < input.size()) {
    if (!chunks_->has_data && is_short_last_chunk(std::string_view(input).substr(used))) break;
    const std::size_t step = parser.put(boost::asio::const_buffer(input.data() + used, input.size() - used), error);
    used += step;
    if (error || step == 0) break;
  }
  input.erase(0, used);
  if (parser.is_done() && !error) return State::kComplete;
  if (error == beast::http::error::body_limit) {
    return refuse({413, "body-too-large", "The body is too large",
                   "the body may have at most " + std::to_string(body_bytes_max_) + " bytes"});
  }
  if (error && error != beast::http::error::need_more) {
    return refuse(
        {400, "bad-request", "The request is malformed", "the chunked body is malformed: " + error.message()});
  }
  if (holds_bare_lf(input)) {
    return refuse({400, "bad-request", "The request is malformed", "the chunked body is malformed: an LF without CR"});
  }
  if (input.size() > kUnreadBytesMax) {
    return refuse({400, "bad-request", "The request is malformed", "a chunk extension or the trailer is too long"});
  }
  return State::kNeedMore;
}

std::string BodyReader::take_body() { return chunks_ ? std::move(chunks_->parser.get().body()) : std::move(body_); }

}  // namespace colony::server::http
