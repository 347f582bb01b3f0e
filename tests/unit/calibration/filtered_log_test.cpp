// calibration tests - a log that was low-passed on its way to a lower rate: friction's sign changes between its
// samples.
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/identify/calibration/weighted_fit.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/calibration/windowed_sinc.hpp"

namespace armcal::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kFast_Hz = 125, kEdge_Hz = 10;
constexpr int kEvery = 5;

// Every fifth sample of the low-passed columns, without the filter's reach at both ends.
MatrixXd Decimated(const MatrixXd& x) {
  constexpr Index kEnd = 200;
  const MatrixXd smooth = tests::WindowedSinc(x, kEdge_Hz, kFast_Hz);
  return smooth(Eigen::seqN(kEnd, (x.rows() - 2 * kEnd) / kEvery, kEvery), Eigen::all);
}

// What the declared model leaves of a decimated log, as a ratio to the torque's noise in the same band, [6].
Eigen::VectorXd LeftOverNoise(tests::SyntheticArm& arm, const tests::Effect& effect) {
  const Dataset fast = arm.Run(63, 4, effect);
  logs::Log log;
  log.joints = 6, log.source = "decimated";
  log.q = Decimated(fast.s.q), log.tau = Decimated(fast.tau);
  log.t = Eigen::VectorXd::LinSpaced(log.q.rows(), 0, static_cast<double>(log.q.rows() - 1) * kEvery / kFast_Hz);
  const Dataset d = Prepare(arm.model(), log);
  const Fit fit = WeightedFit(arm.model(), {&d});
  Eigen::VectorXd ratio = RmsInBand(d, d.tau - Predict(arm.model(), d, fit.x, fit.eta));
  for (int j = 0; j < 6; ++j) {
    EXPECT_NEAR(d.saved_Hz[j], kEdge_Hz, 0.6) << j + 1;
    // White noise through a Gaussian with 3 dB at band_Hz: the power that passes is sqrt(pi / (4 ln 2)) x band_Hz wide.
    ratio[j] /= arm.noise_Nm(j) * std::sqrt(1.0645 * d.band_Hz[j] / (0.5 * kFast_Hz));
  }
  return ratio;
}

// The simulated arm's own samples are a fifth of the log's. So its friction changes up to a fifth of a sample late, and
// that leaves more than the noise.
constexpr double kMostLeft = 1.4;

TEST(FilteredLog, FrictionThatTurnsBetweenTwoSamples_LeavesTheNoiseAlone) {
  constexpr double kWidth_radps = 0.002;
  codegen::Robot robot = tests::Er20();
  robot.sign_law = "tanh", robot.sign_width_radps = kWidth_radps;
  for (codegen::Joint& joint : robot.joint) joint.v_min_radps = kWidth_radps;
  tests::SyntheticArm arm(robot, 3);
  const Eigen::VectorXd left = LeftOverNoise(arm, [&arm](const tests::State& s) {
    return arm.Friction("Fc", s.joint) * (std::tanh(s.qd / kWidth_radps) - (s.qd > 0 ? 1 : -1));
  });
  EXPECT_LT(left.maxCoeff(), kMostLeft) << left.transpose();
}

TEST(FilteredLog, AJointThatSticksAtEachTurn_LeavesTheNoiseAlone) {
  const codegen::Robot robot = tests::Er20();
  tests::SyntheticArm arm(robot, 3);
  // Friction goes evenly from one sign to the other while the joint is slower than v_min, where no row is used.
  const Eigen::VectorXd left = LeftOverNoise(arm, [&](const tests::State& s) {
    const double share = s.qd / robot.joint[s.joint].v_min_radps;
    return std::abs(share) < 1 ? arm.Friction("Fc", s.joint) * (share - (s.qd > 0 ? 1 : -1)) : 0;
  });
  EXPECT_LT(left.maxCoeff(), kMostLeft) << left.transpose();
}

}  // namespace
}  // namespace armcal::calibration
