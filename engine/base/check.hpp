// check: assertions about our own code. CHECK is always on, DCHECK in builds without NDEBUG.
// Errors: a failed check throws CheckFailure; in a running job that fails the job, never the server.
#pragma once

#include <stdexcept>
#include <string>

namespace colony {

[[noreturn]] void fail_check(const char* condition, const char* file, int line);

class CheckFailure : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// What lives on this thread, as it ends a message: "; outer; inner", "" if nothing does. For a failure that was kept on another thread.
std::string failure_contexts();

/// Names what is being worked on while it lives, so that a failed check on this thread says how to replay it.
/// Contexts nest; the innermost comes last in the message.
class FailureContext {
 public:
  explicit FailureContext(std::string text);
  ~FailureContext();
  FailureContext(const FailureContext&) = delete;
  FailureContext& operator=(const FailureContext&) = delete;

 private:
  friend std::string failure_contexts();
  std::string text_;
  FailureContext* outer_;
};

}  // namespace colony

#define CHECK(condition) ((condition) ? void(0) : ::colony::fail_check(#condition, __FILE__, __LINE__))
#ifdef NDEBUG
#define DCHECK(condition) ((void)sizeof(condition))
#else
#define DCHECK(condition) CHECK(condition)
#endif
