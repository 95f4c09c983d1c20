// load_jobs: a database of a great many jobs, made through the store, and the pages asked of it.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace colony::bench {

/// A data folder with `count` jobs: most cancelled, the oldest hundred paused and the hundred after them of kind verify. All have the label
/// project:bench, one in a thousand has batch:k, one of a hundred names is theirs. Gives the pages to ask for, with a word for each.
std::vector<std::pair<std::string, std::string>> make_jobs(const std::string& data, std::size_t count);

}  // namespace colony::bench
