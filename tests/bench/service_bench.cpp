#include <cstdlib>
#include "tests/bench/service_parts.hpp"
int main(int argc, char** argv) { return colony::bench::run_parts(argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1000); }
