// search - threads draw their next piece of work from a counter.
#include "host_sim/identify/search/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "codegen/src/io/watch.hpp"

namespace armcal::search {

void InParallel(int count, int threads, const std::function<void(int)>& work) {
  constexpr std::chrono::milliseconds kPause{50};  // between two looks of a watch, while this thread waits
  if (threads == 0) threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  std::condition_variable ended;
  int running = std::min(threads, count) - 1;
  std::atomic<bool> cancelled{false};
  const auto guarded = [&](const auto& part) {
    try {
      part();
    } catch (const io::Cancelled&) {
      next = count;
      cancelled = true;  // the watched thread throws why
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  const auto run = [&] {
    for (int k; (k = next++) < count;) work(k);
  };
  std::vector<std::thread> helpers;
  for (int k = 0, others = running; k < others; ++k)
    helpers.emplace_back([&, watch = io::Watch::Current()] {
      const io::Watch::Helper helper(watch);
      guarded(run);
      const std::lock_guard lock(mutex);
      --running;
      ended.notify_one();
    });
  guarded(run);
  guarded([&] {
    for (std::unique_lock lock(mutex); !ended.wait_for(lock, kPause, [&] { return running <= 0; });) {
      lock.unlock();
      io::CancellationPoint();
      lock.lock();
    }
  });
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
  if (cancelled) throw io::Cancelled();
}

}  // namespace armcal::search
