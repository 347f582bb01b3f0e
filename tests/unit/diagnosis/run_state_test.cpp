// diagnosis tests - compare the tracker of run states with the conditional mean and with KDL's payload.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <functional>
#include <numbers>

#include "host_sim/diagnose/diagnosis/run_state.hpp"
#include "host_sim/diagnose/diagnosis/work.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::SyntheticArm;

constexpr int kJoints = 2;
const VectorXd kSigma = VectorXd::Constant(kJoints, 0.3);

// A short run of the small arm and what a tracker reads of it.
struct ShortRun {
  explicit ShortRun(double seconds)
      : arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 3),
        torque(arm.model()),
        data(arm.Run(seconds, 30)),
        q(MakeQuantities(arm.model(), data, {{codegen::Quantity::kBodyColumn, 0, kJoints - 1}})) {
    Follow(arm.model(), torque, arm.truth(), {}, torque.parts(), q);
  }
  MatrixXd Zero() const { return MatrixXd::Zero(data.samples(), kJoints); }

  SyntheticArm arm;
  codegen::ArmTorque torque;
  calibration::Dataset data;
  Quantities q;
};

// E[level_k | residuals before sample k] of a level that starts with variance s^2 and gains v per second, seen as
// h level + noise: one dense solve a sample, nothing carried from sample to sample.
VectorXd ConditionalMeans(const RunState& state, const ShortRun& run, const MatrixXd& shape, const MatrixXd& residual) {
  struct Row {
    int sample, joint;
  };
  const VectorXd& t = run.data.s.t;
  const auto covariance = [&](int a, int b) {
    return state.level_sd * state.level_sd + state.variance_ps * (std::min(t[a], t[b]) - t[0]);
  };
  std::vector<Row> seen;
  VectorXd mean = VectorXd::Zero(run.data.samples());
  for (int k = 0; k < run.data.samples(); ++k) {
    const auto count = static_cast<Eigen::Index>(seen.size());
    MatrixXd K(count, count);
    VectorXd y(count), cross(count);
    for (Eigen::Index a = 0; a < count; ++a) {
      const auto [sa, ja] = seen[a];
      y[a] = residual(sa, ja), cross[a] = covariance(sa, k) * shape(sa, ja);
      for (Eigen::Index b = 0; b < count; ++b)
        K(a, b) = covariance(sa, seen[b].sample) * shape(sa, ja) * shape(seen[b].sample, seen[b].joint) +
                  (a == b ? kSigma[ja] * kSigma[ja] : 0);
    }
    if (count > 0) mean[k] = cross.dot(K.ldlt().solve(y));
    for (int j = 0; j < kJoints; ++j)
      if (run.data.used(k, j) && shape(k, j) != 0) seen.push_back({k, j});
  }
  return mean;
}

TEST(RunStateTracker, FollowsADriftAsDenseAlgebraDoes) {
  ShortRun run(1.2);
  const Candidate drift(tests::Records().at("torque_drift"), run.arm.model().robot(), {1});
  const VectorXd path = (VectorXd(6) << 0.2, 0.5, 0.9, 1.1, 1.6, 1.5).finished();
  RunState state = MakeRunState(drift, {0, 40}, path, 40);
  // a tenth of the level's squared changes from zero on over the run, its largest value
  EXPECT_NEAR(state.variance_ps, (0.2 * 0.2 + 0.3 * 0.3 + 0.4 * 0.4 + 0.2 * 0.2 + 0.5 * 0.5 + 0.1 * 0.1) / 400, 1e-12);
  EXPECT_EQ(state.level_sd, 1.6);
  state.variance_ps = 2;  // so that it wanders within this short run
  MatrixXd residual = run.Zero(), shape = run.Zero();
  shape.col(1).setOnes();  // a drift adds to its joint's torque, whatever the motion
  for (int k = 0; k < run.data.samples(); ++k)
    residual(k, 1) = std::sin(3.0 * k / run.data.samples()) + 0.3 * std::cos(1.7 * k);
  const VectorXd expected = ConditionalMeans(state, run, shape, residual);
  const MatrixXd tracked = Track(state, run.q, residual, kSigma);
  EXPECT_LT((tracked.col(1) - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(tracked.col(0).cwiseAbs().maxCoeff(), 0);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.5);

  RunState other = state;  // the judge can see: another walk is another path
  other.variance_ps *= 1.1;
  EXPECT_GT((Track(other, run.q, residual, kSigma).col(1) - expected).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(RunStateTracker, OfSeveralRowsAtOnce_IsDenseAlgebraToo_AndItsShapeIsKdls) {
  ShortRun run(0.8);
  const Candidate payload(tests::Records().at("payload_step"), run.arm.model().robot(), {});
  VectorXd body(10);  // m, m c, I about the last link's origin
  body << 0.8, 0.16, 0.02, 0.01, 0.004, -0.003, -0.001, 0.04, 0.0005, 0.05;
  const RunState state = MakeRunState(payload, {5, 25}, body, 40);
  EXPECT_EQ(state.time_s, 15);
  EXPECT_EQ(state.level_sd, 1);
  EXPECT_EQ(state.variance_ps, 1.0 / 40);
  // KDL's arm with the body on its last link, less the arm without
  VectorXd laden = run.arm.bodies();
  laden.segment(11, 10) += body;
  tests::KdlArm with(run.arm.model().robot(), laden), without(run.arm.model().robot(), run.arm.bodies());
  MatrixXd shape = run.Zero();
  for (int k = 0; k < run.data.samples(); ++k) {
    const VectorXd q = run.data.s.q.row(k), qd = run.data.s.qd.row(k), qdd = run.data.s.qdd.row(k);
    shape.row(k) = with.Torque(q, qd, qdd) - without.Torque(q, qd, qdd);
  }
  MatrixXd residual = 0.9 * shape;
  for (int k = 0; k < run.data.samples(); ++k) residual(k, 0) += 0.3 * std::sin(2.3 * k);
  const VectorXd level = ConditionalMeans(state, run, shape, residual);
  const MatrixXd tracked = Track(state, run.q, residual, kSigma);
  const MatrixXd expected = level.asDiagonal() * shape;
  EXPECT_LT((tracked - expected).cwiseAbs().maxCoeff(), 1e-8 * expected.cwiseAbs().maxCoeff());

  residual(10, 0) += 1;  // the judge can see: one sample of one joint moves all that follow
  EXPECT_GT((Track(state, run.q, residual, kSigma) - expected).cwiseAbs().maxCoeff(),
            1e-3 * expected.cwiseAbs().maxCoeff());
}

// A payload that is set down is gone a few samples later; before any sample is seen nothing is predicted.
TEST(RunStateTracker, ForgetsALevelThatHasGone) {
  ShortRun run(4);
  const Candidate drift(tests::Records().at("torque_drift"), run.arm.model().robot(), {0});
  RunState state = MakeRunState(drift, {0, 40}, VectorXd::LinSpaced(6, 2, 3), 40);
  state.variance_ps = 50;
  MatrixXd residual = run.Zero();
  const int half = run.data.samples() / 2;
  residual.col(0).head(half).setConstant(2);
  const MatrixXd tracked = Track(state, run.q, residual, kSigma);
  EXPECT_EQ(tracked(0, 0), 0);
  EXPECT_NEAR(tracked(half - 1, 0), 2, 0.01);
  EXPECT_NEAR(tracked(half, 0), 2, 0.01);  // one sample ahead: it cannot know yet
  EXPECT_NEAR(tracked(half + 40, 0), 0, 0.01);
}

// Coefficients of six splines; before them the torque is zero.
VectorXd Path(std::initializer_list<double> values) {
  VectorXd out(6);
  std::copy(values.begin(), values.end(), out.begin());
  return out;
}

TEST(StateOfARun, GoesOneWay_OrThereAndBack) {
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/two_link.toml");
  const Candidate drift(tests::Records().at("torque_drift"), robot, {0});
  for (const VectorXd& path : {Path({0.2, 0.4, 0.6, 0.8, 0.9, 1}), Path({-0.5, -0.9, -1, -0.7, -0.2, 0})})
    EXPECT_EQ(WhyNoState(drift, path), "") << path.transpose();
  EXPECT_EQ(WhyNoState(drift, Path({1, -1, 1, -1, 1, -1})),
            "over time it goes to and fro, which a state of a run does not");
  EXPECT_EQ(WhyNoState(drift, Path({1, 1, 1, 1, 1, 1})), "it does not change during the run");
  // what is there in windows of time may come as often as it likes
  const Candidate payload(tests::Records().at("payload_step"), robot, {});
  EXPECT_EQ(WhyNoState(payload, VectorXd::Ones(10)), "");
}

// The training run drifted by 1 N m. Another run may drift by as much, or not at all, from any level on.
TEST(StateOfARun, ThatFollowsTheMotionOfAnotherRun_IsNone) {
  ShortRun run(4);
  const Candidate drift(tests::Records().at("torque_drift"), run.arm.model().robot(), {0});
  const VectorXd trained = Path({0.2, 0.4, 0.6, 0.8, 0.9, 1});
  const auto wanders = [&](const std::function<double(double)>& torque) {
    MatrixXd residual = run.Zero();
    for (int k = 0; k < run.data.samples(); ++k)
      residual(k, 0) = torque(run.data.s.t[k] / 4) + 0.05 * std::cos(40.7 * k);
    return GoesToAndFroOn(drift, trained, run.q, residual);
  };
  EXPECT_TRUE(wanders([](double u) { return 0.8 * std::sin(3 * std::numbers::pi * u); }));
  EXPECT_TRUE(wanders([](double u) { return 5 + 0.8 * std::sin(3 * std::numbers::pi * u); }));
  EXPECT_FALSE(wanders([](double u) { return 0.2 * std::sin(3 * std::numbers::pi * u); }));  // small beside the drift
  EXPECT_FALSE(wanders([](double u) { return 3 - 0.9 * u; }));
  EXPECT_FALSE(wanders([](double u) { return 0.8 * std::sin(std::numbers::pi * u); }));
  EXPECT_FALSE(wanders([](double) { return 0.0; }));
}

}  // namespace
}  // namespace armcal::diagnosis
