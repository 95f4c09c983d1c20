// estimate_bench: what a dry run promises against what the job then takes, in a real colonyd.
#pragma once

#include <string>

namespace colony::bench {

/// A table, one line a case and number of threads; status 1 if a ratio of time, memory or stored bytes lies outside 0.5..2.
/// `full`: the large cases too (some minutes).
int run_estimate(const std::string& colonyd, bool full);

}  // namespace colony::bench
