// service_parts: what writer, reader, encoder and growth curve cost each, in CPU time per division.
#pragma once

#include <cstdint>

namespace colony::bench {

/// Prints one CSV line a part; the store is given a history of `divisions` divisions. Answers the status to exit with.
int run_parts(std::uint64_t divisions);

}  // namespace colony::bench
