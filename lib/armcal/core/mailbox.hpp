// core - hands the latest value from one writer to one reader in another context, without a lock.
#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

namespace armcal::core {

// For one writer and one reader; neither ever waits. The writer owns one slot and the reader another. The third slot
// lies between them, and each side exchanges its own slot for it. So nobody sees a value half written. If the reader
// has not taken a value yet, the next one replaces it.
template <class T>
class Mailbox {
  static_assert(std::is_trivially_copyable<T>::value, "values are copied between contexts");
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free, "the exchange must not need a lock");

 public:
  // Copies `value` in and publishes it. Context: the writer's only.
  void Post(const T& value) {
    draft() = value;
    Publish();
  }

  // For a large T: fill the slot in place, then call Publish(). Until then the slot holds an older value. Context: the
  // writer's only.
  T& draft() { return slots_[back_]; }
  void Publish() { back_ = between_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex; }

  // Copies the latest value to `value`. Returns false if nothing is new since the last Take or Refresh; `value` is then
  // unchanged. Context: the reader's only.
  bool Take(T& value) {
    if (!Refresh()) return false;
    value = slots_[front_];
    return true;
  }

  // Makes latest() the newest value. It stays unchanged until the next Refresh or Take. Returns false if nothing is
  // new. Context: the reader's only.
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
  std::uint32_t back_ = 0;                 // of the writer
  std::atomic<std::uint32_t> between_{1};  // index of the third slot, and kFresh if the reader has not seen it
  std::uint32_t front_ = 2;                // of the reader
};

}  // namespace armcal::core
