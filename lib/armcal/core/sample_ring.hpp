// core - a queue from one producer to one consumer in another context, without a lock.
#pragma once

#include <atomic>
#include <cstdint>
#include <type_traits>

#include "armcal/core/status.hpp"

namespace armcal::core {

// For one producer and one consumer; neither ever waits. N: capacity, a power of two. When the queue is full, the new
// item is refused whole and counted. So the items that were accepted stay complete and in order.
template <class T, std::uint32_t N>
class SampleRing {
  static_assert(N > 0 && (N & (N - 1)) == 0, "capacity must be a power of two: the indices run freely and wrap");
  static_assert(std::is_trivially_copyable<T>::value, "items are copied between contexts");
  static_assert(std::atomic<std::uint32_t>::is_always_lock_free, "an index must not need a lock");

 public:
  // kFull: refused, counted, nothing changed. Context: the producer's only.
  Status Push(const T& item) {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == N) {
      refused_.store(refused_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return Status::kFull;
    }
    items_[head & (N - 1)] = item;
    head_.store(head + 1, std::memory_order_release);
    return Status::kOk;
  }

  // kEmpty: `item` unchanged. Context: the consumer's only.
  Status Pop(T& item) {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return Status::kEmpty;
    item = items_[tail & (N - 1)];
    tail_.store(tail + 1, std::memory_order_release);
    return Status::kOk;
  }

  // Items that wait. At the next moment the consumer may find more, and the producer may find fewer. Context: any. A
  // third context that is interrupted inside this call may get more than N.
  std::uint32_t size() const {
    const std::uint32_t tail = tail_.load(std::memory_order_acquire);
    return head_.load(std::memory_order_acquire) - tail;
  }

  // Items refused since construction; wraps. Context: any.
  std::uint32_t refused() const { return refused_.load(std::memory_order_relaxed); }

  static constexpr std::uint32_t capacity() { return N; }

 private:
  T items_[N] = {};
  std::atomic<std::uint32_t> head_{0};  // written by the producer
  std::atomic<std::uint32_t> tail_{0};  // written by the consumer
  std::atomic<std::uint32_t> refused_{0};
};

}  // namespace armcal::core
