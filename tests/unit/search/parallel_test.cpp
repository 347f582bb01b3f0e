// search tests - every piece runs once, and an exception is passed on.
#include "host_sim/identify/search/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

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

}  // namespace
}  // namespace armcal::search
