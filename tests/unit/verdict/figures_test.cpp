// verdict tests - errors on a log that was not fitted, against figures worked out by hand.
#include <gtest/gtest.h>

#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"

namespace armcal::verdict {
namespace {

using Eigen::MatrixXd;

// Torque a sin(2 pi t) + mean, error b sin(2 pi 20 t), 10 s at 250 Hz; the joint moves in the second half.
struct Case {
  calibration::Dataset log;
  MatrixXd predicted;

  Case(double a, double b, double mean) {
    const int samples = 2500;
    log.s.t = Eigen::VectorXd::LinSpaced(samples, 0, (samples - 1) / 250.0);
    log.s.q.setZero(samples, 1), log.tau.setZero(samples, 1);
    log.moving.setZero(samples, 1), log.scored.setZero(samples);
    log.moving.bottomRows(samples / 2).setOnes();
    log.scored.segment(125, samples - 250).setOnes();
    predicted = log.tau;
    for (int k = 0; k < samples; ++k) {
      const double turn = 2 * std::numbers::pi * log.s.t[k];
      log.tau(k, 0) = mean + a * std::sin(turn);
      predicted(k, 0) = log.tau(k, 0) - b * std::sin(20 * turn);
    }
    log.source = "made up";
  }
};

TEST(HeldOut, ErrorsAreThoseWorkedOutByHand) {
  const Case c(10, 2, 5);
  const HeldOutError e = CompareHeldOut(c.log, c.predicted, 5);
  const double root = std::sqrt(0.5);
  EXPECT_NEAR(e.full.rms[0], 2 * root, 1e-3);
  EXPECT_NEAR(e.full.rms_moving[0], 2 * root, 5e-3);
  EXPECT_NEAR(e.full.nrmse[0], 0.2, 1e-3);  // over the spread about the mean: the mean of 5 N m does not count
  EXPECT_NEAR(e.full.r2()[0], 0.96, 1e-3);
  EXPECT_NEAR(e.full.relative[0], 2 * root / std::sqrt(25 + 50), 0.02);  // over the torque itself
  EXPECT_DOUBLE_EQ(e.moving_share[0], 0.5);
  EXPECT_LT(e.band.nrmse[0], 0.01);  // 20 Hz is far outside of 5 Hz; what is left is at the ends
}

TEST(HeldOut, SeveralLogs_AreOneRecordWithOneMean) {
  const Case low(0, 1, -10), high(0, 1, 10);
  const HeldOutError e = CompareHeldOut({{&low.log, low.predicted}, {&high.log, high.predicted}}, 0);
  EXPECT_NEAR(e.full.nrmse[0], std::sqrt(0.5) / 10, 1e-4);  // alone each has no spread at all
}

// Joint 1 is that of Case(10, 2, 5), and a brake holds joint 2: its torque has no spread, so no error is a share of it.
TEST(HeldOut, AJointWhoseTorqueNeverChanges_HasNoNrmse) {
  Case c(10, 2, 5);
  c.log.tau.conservativeResize(Eigen::NoChange, 2), c.log.moving.conservativeResize(Eigen::NoChange, 2);
  c.predicted.conservativeResize(Eigen::NoChange, 2);
  c.log.tau.col(1).setConstant(0.1), c.predicted.col(1).setConstant(0.4), c.log.moving.col(1).setZero();
  const HeldOutError e = CompareHeldOut(c.log, c.predicted, 0);
  EXPECT_TRUE(std::isnan(e.full.nrmse[1]));
  EXPECT_TRUE(std::isnan(e.full.rms_moving[1]) && std::isnan(e.full.relative[1]));
  const auto json = nlohmann::ordered_json::parse(ToJson(e).dump());
  EXPECT_TRUE(json.at("rms_moving")[1].is_null()) << json.at("rms_moving");
  EXPECT_NEAR(json.at("nrmse_mean").get<double>(), 0.2, 1e-3);
  EXPECT_NEAR(json.at("r2_mean").get<double>(), 0.96, 1e-3);
}

TEST(HeldOut, ABandFromHalfTheSampleRateOn_IsRefused) {
  const Case c(10, 2, 5);
  EXPECT_THROW(CompareHeldOut(c.log, c.predicted, 125), io::InputError);
}

}  // namespace
}  // namespace armcal::verdict
