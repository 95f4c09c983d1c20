#include "client/cli/http_client.hpp"

#include <algorithm>
#include <cctype>
#include <exception>

#include <curl/curl.h>

#include "client/cli/failure.hpp"

namespace colony::client {
namespace {

using Headers = std::unique_ptr<curl_slist, void (*)(curl_slist*)>;

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

void append(Headers& list, const std::string& line) {
  curl_slist* grown = curl_slist_append(list.get(), line.c_str());
  if (grown == nullptr) throw std::bad_alloc();
  static_cast<void>(list.release());  // grown owns the old nodes
  list.reset(grown);
}

bool is_transient(CURLcode code) {
  switch (code) {
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_GOT_NOTHING:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
    case CURLE_PARTIAL_FILE:
      return true;
    default:
      return false;
  }
}

}  // namespace

Target& Target::add(std::string_view name, std::string_view value) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  text_ += text_.find('?') == std::string::npos ? '?' : '&';
  text_ += name;
  text_ += '=';
  for (const unsigned char c : value) {
    if (std::isalnum(c) || c == '-' || c == '.' || c == '_' || c == '~') {
      text_ += static_cast<char>(c);
    } else {
      text_ += '%';
      text_ += kHex[c >> 4];
      text_ += kHex[c & 15];
    }
  }
  return *this;
}

Target& Target::add_if(std::string_view name, const std::optional<std::string>& value) {
  return value ? add(name, std::string_view(*value)) : *this;
}

struct HttpClient::Handles {
  CURLM* multi = curl_multi_init();
  CURL* easy = curl_easy_init();
  ~Handles() {
    curl_easy_cleanup(easy);
    curl_multi_cleanup(multi);
  }
};

/// What curl's callbacks write into. An exception must not pass through curl's C frames: it is kept and thrown again
/// outside.
class HttpClient::Transfer {
 public:
  Transfer(CURL* easy, const Sink* sink) : easy_(easy), sink_(sink) {}

  static std::size_t on_body(char* data, std::size_t, std::size_t size, void* self) {
    return static_cast<Transfer*>(self)->take_body({data, size}) ? size : 0;
  }
  static std::size_t on_header(char* data, std::size_t, std::size_t size, void* self) {
    static_cast<Transfer*>(self)->take_header({data, size});
    return size;
  }

  HttpResponse response;
  std::exception_ptr thrown;
  std::uint64_t received_bytes = 0;

 private:
  bool take_body(std::string_view piece) {
    received_bytes += piece.size();
    try {
      long status = 0;
      curl_easy_getinfo(easy_, CURLINFO_RESPONSE_CODE, &status);
      if (sink_ != nullptr && status >= 200 && status < 300) {
        (*sink_)(piece);
      } else if (response.body.size() + piece.size() > kBodyBytesMax) {
        throw Failure(ExitCode::kRefused, "the server's answer is larger than this client's limit of 256 MiB");
      } else {
        response.body += piece;
      }
      return true;
    } catch (...) {
      thrown = std::current_exception();
      return false;
    }
  }

  void take_header(std::string_view line) {
    if (line.substr(0, 5) == "HTTP/") response.headers.clear();  // of an earlier 100 Continue
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) return;
    std::string_view value = line.substr(colon + 1);
    while (!value.empty() && std::isspace(static_cast<unsigned char>(value.front()))) value.remove_prefix(1);
    while (!value.empty() && std::isspace(static_cast<unsigned char>(value.back()))) value.remove_suffix(1);
    response.headers[lower(line.substr(0, colon))] = std::string(value);
  }

  CURL* easy_;
  const Sink* sink_;
};

HttpClient::HttpClient(Settings settings, Interrupt& interrupt)
    : settings_(std::move(settings)), interrupt_(interrupt), handles_(std::make_unique<Handles>()) {
  if (handles_->multi == nullptr || handles_->easy == nullptr) throw std::bad_alloc();
}

HttpClient::~HttpClient() = default;

HttpResponse HttpClient::send(const HttpRequest& request) { return receive(request, nullptr); }

HttpResponse HttpClient::receive(const HttpRequest& request, const Sink& sink, std::chrono::seconds silence_max) {
  CURL* easy = handles_->easy;
  CURLM* multi = handles_->multi;
  curl_easy_reset(easy);  // keeps the connection
  Transfer transfer(easy, sink ? &sink : nullptr);
  char error_text[CURL_ERROR_SIZE] = "";

  Headers headers(nullptr, curl_slist_free_all);
  append(headers, "Accept: " + request.accept);
  append(headers, "Expect:");  // a spec is small: do not wait for permission to send it
  if (request.body) append(headers, "Content-Type: " + request.body_type);
  if (!settings_.token.empty()) append(headers, "Authorization: Bearer " + settings_.token);
  for (const auto& [name, value] : request.headers) append(headers, name + ": " + value);

  curl_easy_setopt(easy, CURLOPT_URL, (settings_.server + request.target).c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
  curl_easy_setopt(easy, CURLOPT_USERAGENT, "colony");
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);
  if (!settings_.ca_file.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, settings_.ca_file.c_str());
  if (is_loopback(settings_.server)) curl_easy_setopt(easy, CURLOPT_PROXY, "");
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT, 10L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, static_cast<long>(silence_max.count()));
  curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, error_text);
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, &Transfer::on_body);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, &transfer);
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, &Transfer::on_header);
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, &transfer);
  if (request.method != "GET") {
    // A POST without content still says so (Content-Length: 0); curl's own POST would add a form's content type.
    if (request.method == "POST" && !request.body) append(headers, "Content-Type:");
    if (request.body || request.method == "POST") {
      const std::string empty;
      const std::string& body = request.body ? *request.body : empty;
      curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
      curl_easy_setopt(easy, CURLOPT_COPYPOSTFIELDS, body.data());
      curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers.get());
    }
    curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());
  }

  curl_multi_add_handle(multi, easy);
  struct Removal {
    CURLM* multi;
    CURL* easy;
    ~Removal() { curl_multi_remove_handle(multi, easy); }
  } const removal{multi, easy};

  for (int running = 1; running != 0;) {
    CURLMcode code = curl_multi_perform(multi, &running);
    if (code == CURLM_OK && running != 0) {
      curl_waitfd interrupt{interrupt_.fd(), CURL_WAIT_POLLIN, 0};
      code = curl_multi_poll(multi, &interrupt, 1, 1000, nullptr);
    }
    if (code != CURLM_OK) throw NotReachable(std::string("libcurl: ") + curl_multi_strerror(code), false);
    if (running != 0 && interrupt_.raised()) throw Failure(ExitCode::kInterrupted, "interrupted");
  }
  if (transfer.thrown) std::rethrow_exception(transfer.thrown);

  CURLcode result = CURLE_OK;
  int queued = 0;
  while (const CURLMsg* message = curl_multi_info_read(multi, &queued)) {
    if (message->msg == CURLMSG_DONE) result = message->data.result;
  }
  if (result != CURLE_OK) {
    const std::string why = error_text[0] != '\0' ? error_text : curl_easy_strerror(result);
    throw NotReachable(transfer.received_bytes > 0 ? "the connection to " + settings_.server + " was lost after " +
                                                         std::to_string(transfer.received_bytes) + " bytes: " + why
                                                   : "cannot reach " + settings_.server + ": " + why +
                                                         " (--server or COLONY_SERVER names another)",
                       is_transient(result));
  }
  long status = 0;
  curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &status);
  transfer.response.status = static_cast<int>(status);
  return std::move(transfer.response);
}

}  // namespace colony::client
