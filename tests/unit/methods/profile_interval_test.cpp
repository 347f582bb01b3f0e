// methods tests - intervals by profile: their ends are where a fit by plain least squares, written here, costs 1.92
// more than the least.
#include "host_sim/identify/methods/profile_interval.hpp"

#include <gtest/gtest.h>
#include <Eigen/QR>
#include <cmath>

#include "tests/unit/methods/better_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::State;
using tests::SyntheticArm;

constexpr double kRise = 1.92;

double SignOf(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

// The rows of joint 1 of the two-link arm: rigid columns by the model (KDL proves them elsewhere), friction by hand.
struct ByHand {
  MatrixXd rigid;
  VectorXd qd, tau, other_tau;  // over sigma
  MatrixXd other;               // rows of joint 2, which share the rigid columns

  // Least chi^2 / 2 with these friction columns of joint 1; with `fixed` >= 0 that column is held at `value`.
  double Cost(const MatrixXd& friction, int fixed = -1, double value = 0) const {
    MatrixXd A = MatrixXd::Zero(rigid.rows() + other.rows(), other.cols() + friction.cols() - (fixed >= 0));
    VectorXd b(A.rows());
    b << tau, other_tau;
    A.topLeftCorner(rigid.rows(), rigid.cols()) = rigid;
    A.bottomLeftCorner(other.rows(), other.cols()) = other;
    for (Eigen::Index c = 0, at = other.cols(); c < friction.cols(); ++c) {
      if (c == fixed) b.head(rigid.rows()) -= value * friction.col(c);
      else A.col(at++).head(rigid.rows()) = friction.col(c);
    }
    const VectorXd x = A.completeOrthogonalDecomposition().solve(b);
    return 0.5 * (b - A * x).squaredNorm();
  }
};

struct Fitted {
  Solution solution;
  ByHand rows;
  double sigma = 0;
  int Place(const codegen::Model& model, const std::string& name) const {
    for (int k = 0; k < model.nonlinear(); ++k)
      if (model.unknowns()[k].name == name) return model.columns() + k;
    for (int c = 0; c < model.columns(); ++c)
      if (model.column_name(c) == name) return c;
    return -1;
  }
};

codegen::Robot WithLaw(const std::string& law) {
  codegen::Robot robot = tests::PlainRobot("two_link", tests::Columns::kBase);
  codegen::EffectUse use;
  use.effect = law, use.joints = {0}, use.state = "estimated";
  robot.effect.push_back(use);
  return robot;
}

Fitted FitLaw(const codegen::Model& model, const std::function<double(double qd)>& law, std::uint64_t seed,
              bool hold_delta = false) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), seed);
  const Dataset log = arm.Run(10, 100 + seed, [&](const State& s) { return s.joint == 0 ? law(s.qd) : 0; }, 0.25);
  Problem problem = MakeProblem(model, {&log});
  problem.covariance.resize(0, 0);
  for (int j = 0; j < 2; ++j) problem.sigma_Nm[j] = arm.noise_Nm(j);
  problem.intervals = true;
  if (hold_delta) tests::HoldDelta(problem);
  Fitted out;
  out.solution = Solve(FindMethod("variable_projection"), problem);
  const Rows rows = StackRows(problem, out.solution.z);
  std::vector<Eigen::Index> first, second;
  for (std::size_t r = 0; r < rows.joint.size(); ++r)
    (rows.joint[r] == 0 ? first : second).push_back(static_cast<Eigen::Index>(r));
  std::vector<int> rigid, of_second;
  for (int c = 0; c < model.columns(); ++c) {
    if (model.is_rigid(c)) rigid.push_back(c);
    else if (!model.rows()[1][c].IsZero()) of_second.push_back(c);
  }
  std::vector<int> shared = rigid;
  shared.insert(shared.end(), of_second.begin(), of_second.end());
  out.rows.rigid = MatrixXd::Zero(static_cast<Eigen::Index>(first.size()), static_cast<Eigen::Index>(shared.size()));
  out.rows.rigid.leftCols(static_cast<Eigen::Index>(rigid.size())) = rows.K(first, rigid) / arm.noise_Nm(0);
  out.rows.other = rows.K(second, shared) / arm.noise_Nm(1);
  out.rows.tau = rows.tau(first) / arm.noise_Nm(0), out.rows.other_tau = rows.tau(second) / arm.noise_Nm(1);
  out.rows.qd.resize(static_cast<Eigen::Index>(first.size()));
  for (std::size_t r = 0; r < first.size(); ++r)
    out.rows.qd[static_cast<Eigen::Index>(r)] = log.s.qd(rows.sample[static_cast<std::size_t>(first[r])], 0);
  out.sigma = arm.noise_Nm(0);
  return out;
}

MatrixXd StribeckColumns(const Fitted& fitted, double vs) {
  MatrixXd columns(fitted.rows.qd.size(), 3);
  for (Eigen::Index r = 0; r < columns.rows(); ++r) {
    const double v = fitted.rows.qd[r];
    columns.row(r) << SignOf(v), v, SignOf(v) * std::exp(-std::pow(v / vs, 2));
  }
  return columns / fitted.sigma;
}

TEST(ProfileInterval, OfAStribeckSpeed_EndsWhereLeastSquaresCosts192More) {
  const codegen::Model model(WithLaw("stribeck"), tests::Records());
  const Fitted fitted =
      FitLaw(model, [](double v) { return 3 * std::exp(-std::pow(v / 0.1, 2)) * SignOf(v); }, 3, true);
  const int vs = fitted.Place(model, "stribeck.vs1");
  ASSERT_GE(vs, 0);
  const double least = fitted.rows.Cost(StribeckColumns(fitted, fitted.solution.z[vs]));
  for (const int end : {0, 1}) {
    const double at = fitted.solution.interval(vs, end);
    ASSERT_TRUE(std::isfinite(at));
    EXPECT_NEAR(fitted.rows.Cost(StribeckColumns(fitted, at)) - least, kRise, 0.05) << end;
  }
}

TEST(ProfileInterval, OfAnAmplitude_EndsWhereTheBestSpeedCosts192More) {
  const codegen::Model model(WithLaw("stribeck"), tests::Records());
  const Fitted fitted =
      FitLaw(model, [](double v) { return 2 * std::exp(-std::pow(v / 0.1, 2)) * SignOf(v); }, 4, true);
  const int amplitude = fitted.Place(model, "stribeck.dFs1"), vs = fitted.Place(model, "stribeck.vs1");
  ASSERT_GE(amplitude, 0);
  const double least = fitted.rows.Cost(StribeckColumns(fitted, fitted.solution.z[vs]));
  for (const int end : {0, 1}) {
    const double value = fitted.solution.interval(amplitude, end);
    ASSERT_TRUE(std::isfinite(value));
    double best = INFINITY;
    for (double speed = 0.02; speed < 0.6; speed *= 1.01)
      best = std::min(best, fitted.rows.Cost(StribeckColumns(fitted, speed), 2, value));
    EXPECT_NEAR(best - least, kRise, 0.1) << end;
  }
}

TEST(ProfileInterval, OfWhatHasNoProfile_Is196DeviationsToEachSide) {
  const codegen::Model model(WithLaw("stribeck"), tests::Records());
  const Fitted fitted =
      FitLaw(model, [](double v) { return 3 * std::exp(-std::pow(v / 0.1, 2)) * SignOf(v); }, 3, true);
  for (int c = 0; c < model.columns(); ++c) {
    if (!model.is_rigid(c)) continue;
    const double sd = std::sqrt(fitted.solution.covariance(c, c));
    EXPECT_NEAR(fitted.solution.interval(c, 1) - fitted.solution.z[c], 1.96 * sd, 0.01 * sd) << c;
    EXPECT_NEAR(fitted.solution.z[c] - fitted.solution.interval(c, 0), 1.96 * sd, 0.01 * sd) << c;
  }
}

TEST(ProfileInterval, OfASpeedWhoseAmplitudeIsZero_IsOpen) {
  const codegen::Model model(WithLaw("stribeck"), tests::Records());
  const Fitted fitted = FitLaw(model, [](double) { return 0.0; }, 5, true);
  const int vs = fitted.Place(model, "stribeck.vs1");
  EXPECT_TRUE(std::isinf(fitted.solution.interval(vs, 0)) || std::isinf(fitted.solution.interval(vs, 1)));
}

// (5) has minima apart from each other, in narrow valleys. The interval holds each f3 of a grid over f3 and f5 that
// costs no more than its ends.
TEST(ProfileInterval, OfTwoExponentials_HoldsEachMinimumThatCostsNoMore) {
  const codegen::Model model(WithLaw("friction_exponential"), tests::Records());
  const auto law = [](double v) {
    return SignOf(v) * (2 * std::exp(-std::abs(v) / 0.08) - 2 * std::exp(-0.4 / std::abs(v)));
  };
  const Fitted fitted = FitLaw(model, law, 7);
  const auto columns = [&](double f3, double f5) {
    MatrixXd out(fitted.rows.qd.size(), 4);
    for (Eigen::Index r = 0; r < out.rows(); ++r) {
      const double v = fitted.rows.qd[r], s = SignOf(v);
      out.row(r) << s, v, s * std::exp(-std::abs(v) / f3), s * std::exp(-1 / std::max(f5 * std::abs(v), 0.0125));
    }
    return MatrixXd(out / fitted.sigma);
  };
  const int f3 = fitted.Place(model, "friction_exponential.f31"), f5 = fitted.Place(model, "friction_exponential.f51");
  ASSERT_GE(f3, 0);
  const codegen::EffectUnknown& speed = model.unknowns()[f3 - model.columns()];
  const codegen::EffectUnknown& onset = model.unknowns()[f5 - model.columns()];
  const double least = fitted.rows.Cost(columns(fitted.solution.z[f3], fitted.solution.z[f5]));
  constexpr int kSide = 40;
  double low = INFINITY, high = -INFINITY;
  for (int i = 0; i < kSide; ++i)
    for (int k = 0; k < kSide; ++k) {
      const double at = speed.lower * std::pow(speed.upper / speed.lower, (i + 0.5) / kSide);
      const double begins = onset.lower * std::pow(onset.upper / onset.lower, (k + 0.5) / kSide);
      if (fitted.rows.Cost(columns(at, begins)) > least + kRise) continue;
      low = std::min(low, at), high = std::max(high, at);
    }
  ASSERT_LT(low, high);
  EXPECT_LE(fitted.solution.interval(f3, 0), low);
  EXPECT_GE(fitted.solution.interval(f3, 1), high);
  for (const int end : {0, 1}) {
    const double at = fitted.solution.interval(f3, end);
    if (std::isinf(at)) continue;
    double best = INFINITY;
    for (double begins = onset.lower; begins < onset.upper; begins *= 1.003)
      best = std::min(best, fitted.rows.Cost(columns(at, begins)));
    EXPECT_NEAR(best - least, kRise, 0.15) << end;
  }
}

}  // namespace
}  // namespace armcal::calibration
