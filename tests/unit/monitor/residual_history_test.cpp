// monitor - slices of time against plain sums, and the arm's clock.
#include "armcal/monitor/residual_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "armcal/monitor/residual_statistics.hpp"

namespace armcal::monitor {
namespace {

using History = ResidualHistory<2>;

// 45 hours of motion at 125 Hz: more rows than a float32 count that grows one by one could hold.
TEST(ResidualHistory, ManyRows_AreAllThereAndInOrder_EachSliceASmallPartOfItsAge) {
  History history;
  double rows = 0, square = 0;
  std::uint32_t now_s = 0;
  for (int slice = 0; slice < 20'000; ++slice) {
    const float residual_Nm = slice % 3 ? 1.0f : 2.0f;
    now_s += 8;
    for (std::uint32_t k = 0; k < History::kSliceSamples; ++k) {
      history.Add(1, residual_Nm);
      rows += 1, square += residual_Nm * residual_Nm;
      history.EndSample(now_s);
    }
  }
  ASSERT_GT(rows, 1 << 24);
  double sum_rows = 0, sum_square = 0;
  for (int i = 0; i < history.size(); ++i) {
    const History::Slice& s = history.slice(i);
    sum_rows += s.count[1], sum_square += s.square[1];
    EXPECT_EQ(s.count[0], 0.0f);
    const std::uint32_t end_s = i + 1 < history.size() ? history.slice(i + 1).start_s : now_s;
    EXPECT_LE(s.start_s, end_s);
    // 32 slices whose ages fall by the ratio r reach back 20000 x 8 s if r^32 = 20000: r = 1.36, each a share of 0.27
    // of its age. Neighbours are joined whole, so one may be twice that.
    if (end_s - s.start_s > 8) {
      EXPECT_LE(end_s - s.start_s, 0.54 * (now_s - s.start_s)) << i;
    }
  }
  EXPECT_EQ(history.slice(0).start_s, 0u);
  EXPECT_EQ(history.size(), History::kSlices);
  EXPECT_NEAR(sum_rows, rows, 1e-5 * rows);  // forty joins of a last place each
  EXPECT_NEAR(sum_square, square, 1e-5 * square);
}

TEST(ResidualStatistics, Time_CountsFromTheRestartAndPassesTheWrapOfTicks) {
  auto statistics = std::make_unique<ResidualStatistics<2>>();
  std::uint32_t tick = 0xFFFFFFFFu - 1'000'000;
  statistics->Restart(tick);
  statistics->EndSample(tick - 4, 1000);  // its window began before the restart
  EXPECT_EQ(statistics->elapsed_s(), 0u);
  for (int i = 0; i < 500'000; ++i) statistics->EndSample(tick += 8, 1000);
  EXPECT_EQ(statistics->elapsed_s(), 4000u);
}

TEST(ResidualStatistics, Rest_FillsNoSlice_MotionAfterItStartsWhereTheClockStands) {
  auto statistics = std::make_unique<ResidualStatistics<2>>();
  std::uint32_t tick = 0;
  const auto samples = [&](std::uint32_t count, bool moving) {
    for (std::uint32_t i = 0; i < count; ++i) {
      statistics->Add(0, {1, 1, 1, 1, 20}, moving);
      statistics->EndSample(tick += 8, 1000);
    }
  };
  samples(3600 * 125, false);
  EXPECT_EQ(statistics->history().size(), 1);
  samples(ResidualHistory<2>::kSliceSamples, true);
  ASSERT_EQ(statistics->history().size(), 2);
  EXPECT_EQ(statistics->history().slice(1).start_s, 3608u);
  EXPECT_EQ(statistics->history().slice(0).count[0], ResidualHistory<2>::kSliceSamples);
  EXPECT_EQ(statistics->history().slice(0).count[1], 0.0f);

  float values[ResidualStatistics<2>::kValues];
  statistics->Write(0, values);
  const float* history = values + 2 * ResidualBins::kValues;
  EXPECT_EQ(history[3], 3608.0f);
  EXPECT_TRUE(std::isnan(history[6]));  // no third slice
  statistics->Restart(tick);
  statistics->Write(0, values);
  EXPECT_EQ(history[0], 0.0f);
  EXPECT_EQ(history[1], 0.0f);
  for (int k = 0; k < 2 * ResidualBins::kValues; ++k) ASSERT_EQ(values[k], 0.0f);
}

}  // namespace
}  // namespace armcal::monitor
