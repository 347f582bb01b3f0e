// io tests - a watch is told a share that never falls, and ends what it watches.
#include "codegen/src/io/watch.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>
#include <vector>

namespace armcal::io {
namespace {

TEST(Watch, IsToldTheShareOfAllStages) {
  std::vector<double> told;
  const Watch watch([&](double share) { told.push_back(share); });
  const auto until_told = [&](double share) {
    for (const std::size_t before = told.size(); told.size() == before;) SetDone(share);
    return told.back();
  };
  EXPECT_DOUBLE_EQ(until_told(0.1), 0.1);
  {
    const Stage half(0.2, 0.6);
    EXPECT_DOUBLE_EQ(until_told(0.0), 0.2);
    {
      const Stage quarter(0.5, 1);
      EXPECT_DOUBLE_EQ(until_told(0.5), 0.5);
    }
    EXPECT_DOUBLE_EQ(until_told(0.1), 0.6);  // the stage within has ended at 0.6; the share does not fall
  }
  EXPECT_DOUBLE_EQ(until_told(0.3), 0.6);
  EXPECT_DOUBLE_EQ(until_told(7), 1);
}

TEST(Watch, ThatThrows_EndsTheWorkAndItsHelpers) {
  const Watch watch([](double) { throw std::runtime_error("enough"); });
  bool cancelled = false;
  std::thread helper([&, over = Watch::Current()] {
    const Watch::Helper watched(over);
    try {
      for (;;) SetDone(1);
    } catch (const Cancelled&) {
      cancelled = true;
    }
  });
  EXPECT_THROW(
      {
        for (;;) CancellationPoint();
      },
      std::runtime_error);
  helper.join();
  EXPECT_TRUE(cancelled);
}

TEST(Watch, DoesNotWatchWhatItStartsItself) {
  int looks = 0;
  const Watch watch([&](double) {
    ++looks;
    EXPECT_EQ(Watch::Current(), nullptr);
    const Watch inner([](double) { FAIL(); });
    CancellationPoint();
  });
  while (looks == 0) CancellationPoint();
  EXPECT_EQ(looks, 1);
  EXPECT_EQ(Watch::Current(), &watch);
}

TEST(Watch, None_NothingHappens) {
  EXPECT_EQ(Watch::Current(), nullptr);
  const Stage stage(0, 1);
  SetDone(0.5);
  CancellationPoint();
}

}  // namespace
}  // namespace armcal::io
