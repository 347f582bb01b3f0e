// io - lets a caller watch a long computation and end it.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

namespace armcal::io {

// What ends a thread that helps a watched one. It is no std::exception, so that nobody takes it for bad input.
struct Cancelled {};

// While one lives, `look` is told how far the computations of its thread are: a share from 0 to 1 that never falls. The
// thread that made the watch calls `look`, about ten times a second, at a CancellationPoint. What `look` throws ends
// the computation. The results do not depend on a watch. Watches may be nested; the inner one is told.
class Watch {
 public:
  explicit Watch(std::function<void(double share)> look) : look_(std::move(look)), outer_(current_) { current_ = this; }
  ~Watch() { current_ = outer_; }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  // The watch over this thread; null: none.
  static Watch* Current() { return current_; }

  // A thread that helps a watched one makes this first. It ends with Cancelled where `look` has thrown.
  class Helper {
   public:
    explicit Helper(Watch* watch) : outer_(current_) { current_ = watch; }
    ~Helper() { current_ = outer_; }
    Helper(const Helper&) = delete;
    Helper& operator=(const Helper&) = delete;

   private:
    Watch* outer_;
  };

 private:
  friend class Stage;
  friend void SetDone(double share);
  friend void CancellationPoint();
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kPause{100};

  bool is_own() const { return std::this_thread::get_id() == owner_; }
  void SetDone(double share) { share_ = std::max(share_, begin_ + length_ * std::clamp(share, 0.0, 1.0)); }
  void Look() {
    if (ended_) throw Cancelled();
    if (!is_own() || Clock::now() < next_) return;
    const Helper unwatched(nullptr);  // `look` may compute, too
    try {
      look_(share_);
    } catch (...) {
      ended_ = true;
      throw;
    }
    next_ = Clock::now() + kPause;
  }

  inline static thread_local Watch* current_ = nullptr;
  std::function<void(double)> look_;
  Watch* outer_;
  const std::thread::id owner_ = std::this_thread::get_id();
  std::atomic<bool> ended_{false};
  Clock::time_point next_ = Clock::now() + kPause;
  double share_ = 0, begin_ = 0, length_ = 1;  // the latter two: of the stage
};

// While one lives, SetDone of this thread is about this part of the work: from `begin` to `end` of the stage around it.
class Stage {
 public:
  Stage(double begin, double end)
      : watch_(Watch::Current() && Watch::Current()->is_own() ? Watch::Current() : nullptr) {
    if (!watch_) return;
    begin_ = watch_->begin_, length_ = watch_->length_;
    watch_->begin_ += begin * length_, watch_->length_ *= end - begin;
    watch_->SetDone(0);
  }
  ~Stage() {
    if (watch_) watch_->SetDone(1), watch_->begin_ = begin_, watch_->length_ = length_;
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

 private:
  Watch* watch_;
  double begin_ = 0, length_ = 1;  // of the stage around
};

// Long loops call this at least once in a tenth of a second; without a watch it costs a comparison. It may throw what
// the watch's `look` throws.
inline void CancellationPoint() {
  if (Watch* const watch = Watch::Current()) watch->Look();
}

// So much of the stage is done, 0 to 1. Also a CancellationPoint. Threads that help have no say in it.
inline void SetDone(double share) {
  if (Watch* const watch = Watch::Current(); watch && watch->is_own()) watch->SetDone(share);
  CancellationPoint();
}

}  // namespace armcal::io
