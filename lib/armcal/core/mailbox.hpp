// core - the latest value from one context to another; knows nothing of what it carries.
#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

namespace armcal::core {

// One writer, one reader, wait-free on both sides: the writer owns one slot, the reader another, the third lies between
// them and is exchanged whole. A value is never seen half written; an older one that nobody took is replaced.
template <class T>
class Mailbox {
  static_assert(std::is_trivially_copyable<T>::value, "values are copied between contexts");
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free, "the exchange must not need a lock");

 public:
  // Writer: copy `value` in and publish it.
  void Post(const T& value) {
    draft() = value;
    Publish();
  }

  // Writer: the slot to fill in place (its content is an older value); then Publish(). For large T.
  T& draft() { return slots_[back_]; }
  void Publish() { back_ = between_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  // Reader: copy the latest value out. False: nothing new since the last Take or Refresh, `value` unchanged.
  bool Take(T& value) {
    if (!Refresh()) return false;
    value = slots_[front_];
    return true;
  }

  // Reader: make latest() the newest value in place; it stays unchanged until the next Refresh. False: nothing new.
  bool Refresh() {
    if ((between_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = between_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  const T& latest() const { return slots_[front_]; }

 private:
  static constexpr std::uint32_t kIndex = 3;
  static constexpr std::uint32_t kFresh = 4;

  T slots_[3] = {};
  std::uint32_t back_ = 0;                 // the writer's
  std::atomic<std::uint32_t> between_{1};  // index of the middle slot, and whether it is news
  std::uint32_t front_ = 2;                // the reader's
};

}  // namespace armcal::core
