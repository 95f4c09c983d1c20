// load_client: many keep-alive connections to one server, asked as fast as it answers or at a given rate.
// Method:  one thread, Asio callbacks, Beast's parser; the requests are texts made beforehand.
// Errors:  std::runtime_error for a connection that fails and for an answer that is neither 200 nor counted as refused.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace colony::bench {

struct Latencies {
  std::vector<double> all_ms;  // of every answer, in the order in which they came
  std::uint64_t refused = 0;   // answered 503, or not sent because too many waited; open loop alone
  double wall_s = 0.0;
  double cpu_s = 0.0;  // of the client

  double per_s() const { return static_cast<double>(all_ms.size()) / wall_s; }
  /// The least that is not exceeded by `share` of the answers.
  double quantile_ms(double share) const;
};

/// The text of a GET; `headers` are complete lines.
std::string get_text(const std::string& path, const std::string& headers = "Accept: application/json\r\n");

/// `connections` clients for `seconds`, each asking again as soon as it has its answer.
Latencies closed_loop(std::uint16_t port, const std::string& request, std::size_t connections, double seconds);

/// Requests arrive every 1/rate_per_s whatever becomes of those before; a latency counts from the moment at which its request was due.
/// `next` is asked for the text of each.
Latencies open_loop(std::uint16_t port, const std::function<const std::string&(std::size_t index)>& next,
                    double rate_per_s, double seconds);

/// A server of nothing but Beast, on one thread: answers every request with `bytes` bytes of JSON. Prints the line by which a
/// ColonydProcess knows that it listens, and ends by SIGTERM.
int serve_bare(std::size_t bytes);

}  // namespace colony::bench
