// result: an expected failure at a boundary, as a value. A bug is a CHECK instead (check.hpp).
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace colony {

/// What kind of failure; server/api has the one table from these to problem codes and HTTP statuses.
enum class ErrorCode {
  kMalformed,       // not parseable at all
  kInvalid,         // parseable, but a field is wrong
  kNotFound,        // the named thing does not exist
  kConflict,        // the thing is in a state that forbids this
  kKeyReused,       // the idempotency key was used with another body
  kNotReached,      // a model time that a live job has not reached
  kLimit,           // a named limit would be exceeded
  kBusy,            // a queue is full; try later
  kStorage,         // the disk or the database refused
  kUnavailable,     // draining or not ready
  kInternal,        // a bug
};

/// One wrong field. `pointer` is a JSON Pointer into the request body, or the name of a query parameter or header.
struct FieldError {
  std::string pointer;
  std::string message;
};

struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;
  std::vector<FieldError> fields = {};
};

/// A value or an Error. Test with `if (!result)`; value() of an error is undefined.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit by design

  explicit operator bool() const { return state_.index() == 0; }
  T& value() { return *std::get_if<0>(&state_); }
  const T& value() const { return *std::get_if<0>(&state_); }
  T& operator*() { return value(); }
  const T& operator*() const { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  const Error& error() const { return *std::get_if<1>(&state_); }

 private:
  std::variant<T, Error> state_;
};

struct Ok {};
using Status = Result<Ok>;

}  // namespace colony
