// app: the whole of `colony` as one function, so that a test can run it and main.cpp has nothing to decide.
// Promise: every failure is printed once on `env.err`; the result is the process's exit code (failure.hpp).
#pragma once

#include <string>
#include <vector>

#include "client/cli/environment.hpp"

namespace colony::client {

/// `arguments` without the program's name. Throws OutputClosed only.
int run(const std::vector<std::string>& arguments, Environment& env);

}  // namespace colony::client
