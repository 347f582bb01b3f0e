// tool - lets the first Ctrl-C end the work but not the program, as long as a guard lives.
#pragma once

#include <atomic>
#include <csignal>

namespace armcal::tool {

class InterruptGuard {
 public:
  InterruptGuard() : before_(std::signal(SIGINT, &Interrupt)) {}
  ~InterruptGuard() { std::signal(SIGINT, before_); }
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  // Set by the first Ctrl-C; it stays set.
  static const std::atomic<bool>& interrupted() { return interrupted_; }

 private:
  static_assert(std::atomic<bool>::is_always_lock_free);  // a signal handler may set it
  inline static std::atomic<bool> interrupted_{false};
  static void Interrupt(int) {
    interrupted_ = true;
    std::signal(SIGINT, SIG_DFL);  // the second Ctrl-C ends the program
  }
  void (*before_)(int);
};

}  // namespace armcal::tool
