// colony-evidence: prints the tables of engine/DESIGN.md, "Evidence".
// Usage:  colony-evidence [--full] [volume|searches|colonies|contact|reference|figure2 ...]     no name: all
#include "tests/bench/evidence.hpp"

#include <string_view>

namespace {

using namespace colony::bench;

struct Table {
  std::string_view name;
  void (*print)(const EvidenceSize&);
};
constexpr Table kTables[] = {{"volume", print_volume_error},
                             {"searches", print_searches},
                             {"colonies", print_colony_terms},
                             {"contact", print_contact},
                             {"reference", print_reference},
                             {"figure2", print_figure2}};

}  // namespace

int main(int argc, char** argv) {
  EvidenceSize size;
  std::vector<const Table*> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--full") {
      size.full = true;
      continue;
    }
    const Table* found = nullptr;
    for (const Table& table : kTables) found = table.name == argument ? &table : found;
    if (found == nullptr) {
      std::fprintf(stderr, "usage: colony-evidence [--full] [volume|searches|colonies|contact|reference|figure2 ...]\n");
      return argument == "--help" ? 0 : 2;
    }
    wanted.push_back(found);
  }
  if (wanted.empty()) {
    for (const Table& table : kTables) wanted.push_back(&table);
  }
  for (const Table* table : wanted) {
    table->print(size);
    std::fflush(stdout);
  }
  return 0;
}
