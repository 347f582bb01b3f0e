// estimator - the residual statistics that it fills, against the model in double.
#include "armcal/monitor/residual_statistics.hpp"

#include <gtest/gtest.h>

#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using core::Status;

double Total(const float* set, int sum) {
  double total = 0;
  for (int bin = 0; bin < 8; ++bin) total += static_cast<double>(set[bin * monitor::kResidualSums + sum]);
  return total;  // over the bins of the first signal: every row once
}

TEST(Residuals, AreThoseOfTheCommittedModel_OfEveryRowInMotion) {
  auto host = std::make_unique<Host<TwoLink, filter::KalmanFilter<TwoLink>>>();
  auto statistics = std::make_unique<monitor::ResidualStatistics<2>>();
  host->estimator.SetResiduals(statistics.get());
  Motion run;
  run.truth(0) += 200;  // so far from the table that the filter's own gate keeps rows out
  ASSERT_EQ(host->Adopt(), Status::kOk);
  double rows[2] = {}, residual[2] = {}, load[2] = {}, speed[2] = {};
  const int links = TwoLink::kDense;
  for (int k = 0; k < 4000; ++k) {
    const Sample s = run.Next(k % 10 == 0);
    ASSERT_EQ(host->Feed(s), Status::kOk);
    const Matrix y = Regressor<TwoLink>(s);
    for (int j = 0; j < 2; ++j) {
      if ((s.flags[j] & model::kMoving) == 0) continue;
      rows[j] += 1;
      residual[j] += s.tau[j] - y.row(j).dot(host->b0());
      load[j] += y.row(j).tail(links).dot(host->b0().tail(links));
      speed[j] += s.qd[j];
    }
  }
  for (int j = 0; j < 2; ++j) {
    const float* set = statistics->bins(j).reference();
    EXPECT_EQ(Total(set, monitor::kCount), rows[j]);
    // A row's torque in float32 is right to some 1e-5 N*m of 50; the sums round by less.
    EXPECT_NEAR(Total(set, monitor::kResidual), residual[j], 1e-4 * rows[j]);
    EXPECT_NEAR(Total(set, monitor::kLoad), load[j], 1e-4 * rows[j]);
    EXPECT_NEAR(Total(set, monitor::kSpeed), speed[j], 1e-4 * rows[j]);
  }
  EXPECT_EQ(statistics->elapsed_s(), 31u);  // 4000 samples of 8 ms, the last at tick 31992

  ASSERT_EQ(host->Adopt(2), Status::kOk);  // another table: nothing of before counts
  EXPECT_EQ(Total(statistics->bins(0).reference(), monitor::kCount), 0);
}

}  // namespace
}  // namespace armcal::estimator
