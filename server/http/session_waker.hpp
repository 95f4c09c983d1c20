// session_waker: stands between what may wake whenever it likes and from any thread, and a session that may have ended.
// Promises that calls that come before the session has looked are one call, and that after detach() none reaches it.
// Threads: wake from any; detach on the session's strand.
#pragma once

#include <memory>
#include <mutex>

#include "server/http/session.hpp"

namespace colony::server::http {

class Session::Waker {
 public:
  explicit Waker(Session* session) : session_(session) {}

  void wake() {
    const std::lock_guard lock(mutex_);
    if (!session_ || is_pending_) return;
    is_pending_ = true;
    // Attached means that the session's coroutine runs, and that holds the session.
    session_->on_strand([session = session_->shared_from_this(), waker = session_->waker_] {
      waker->has_arrived();
      session->woken_ = true;
      session->connection_->notify();
    });
  }

  void detach() {
    const std::lock_guard lock(mutex_);
    session_ = nullptr;
  }

 private:
  void has_arrived() {
    const std::lock_guard lock(mutex_);
    is_pending_ = false;
  }

  std::mutex mutex_;  // guards everything below
  Session* session_;  // null: detached
  bool is_pending_ = false;
};

}  // namespace colony::server::http
