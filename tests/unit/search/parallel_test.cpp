// search tests - every piece runs once, and an exception is passed on.
#include "host_sim/identify/search/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "codegen/src/io/watch.hpp"

namespace armcal::search {
namespace {

TEST(InParallel, DoesEveryPieceOnce) {
  for (const int threads : {0, 1, 3, 50}) {
    std::vector<std::atomic<int>> done(37);
    InParallel(37, threads, [&](int k) { ++done[static_cast<std::size_t>(k)]; });
    for (const auto& times : done) EXPECT_EQ(times, 1) << threads;
  }
  InParallel(0, 0, [](int) { FAIL(); });
}

TEST(InParallel, WhereAPieceThrows_EndsAndThrows) {
  std::atomic<int> begun{0};
  const auto work = [&](int k) {
    ++begun;
    if (k == 2) throw std::runtime_error("third piece");
  };
  EXPECT_THROW(InParallel(1000000, 2, work), std::runtime_error);
  EXPECT_LT(begun, 1000000);
}

TEST(InParallel, WhereAWatchThrows_EndsAllThreadsAndThrowsThat) {
  const io::Watch watch([](double) { throw std::runtime_error("enough"); });
  std::atomic<int> ended{0};
  const auto work = [&](int k) {
    if (k == 0) return;  // one thread is done at once, and waits for the others
    try {
      for (;;) io::CancellationPoint();
    } catch (...) {
      ++ended;
      throw;
    }
  };
  EXPECT_THROW(InParallel(3, 3, work), std::runtime_error);
  EXPECT_GE(ended, 1);
}

TEST(InParallel, OfAHelper_PassesTheEndOn) {
  const io::Watch watch([](double) { throw std::runtime_error("enough"); });
  std::atomic<bool> went_on{false};
  const auto forever = [](int) {
    for (;;) io::CancellationPoint();
  };
  const auto nested = [&](int) {
    InParallel(2, 2, forever);
    went_on = true;
  };
  EXPECT_THROW(InParallel(2, 2, nested), std::runtime_error);
  EXPECT_FALSE(went_on);
}

}  // namespace
}  // namespace armcal::search
