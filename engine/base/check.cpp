#include "engine/base/check.hpp"

#include <cstring>
#include <utility>

namespace colony {
namespace {
thread_local FailureContext* innermost = nullptr;
}  // namespace

FailureContext::FailureContext(std::string text) : text_(std::move(text)), outer_(innermost) { innermost = this; }
FailureContext::~FailureContext() { innermost = outer_; }

std::string failure_contexts() {
  std::string contexts;
  for (const FailureContext* context = innermost; context != nullptr; context = context->outer_) {
    contexts = "; " + context->text_ + contexts;
  }
  return contexts;
}

void fail_check(const char* condition, const char* file, int line) {
  const char* tail = std::strstr(file, "engine/");
  if (tail == nullptr) tail = std::strstr(file, "server/");
  throw CheckFailure("check failed: " + std::string(condition) + " at " + (tail != nullptr ? tail : file) + ":" +
                     std::to_string(line) + failure_contexts());
}

}  // namespace colony
