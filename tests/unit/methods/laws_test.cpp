// methods tests - friction laws (4), (5), (6), (8), (9), written by hand, found again in data of a KDL arm: no fit may
// cost more than the truth, and the torque that its error makes must be about as large as the parameters' count allows.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/unit/methods/better_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::VectorXd;
using tests::State;
using tests::SyntheticArm;
using Torque = std::function<double(double qd, double load)>;

// A law's truth for one joint: what it adds to Coulomb and viscous friction, of which Fv is kept and Fc is told.
struct Truth {
  Torque added;
};

double Sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

Truth Draw(const std::string& law, double Fc, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  const auto log_uniform = [&](double a, double b) { return a * std::pow(b / a, u(random)); };
  if (law == "stribeck") {
    const double extra = (0.2 + 0.5 * u(random)) * Fc, v = log_uniform(0.05, 0.2);
    return {[=](double qd, double) { return extra * std::exp(-std::pow(qd / v, 2)) * Sign(qd); }};
  }
  if (law == "friction_exponential") {
    const double f2 = -(0.3 + 0.4 * u(random)) * Fc, f3 = log_uniform(0.05, 0.15), f4 = (0.2 + 0.4 * u(random)) * Fc,
                 f5 = log_uniform(2, 8);
    return {[=](double qd, double) {
      return -Sign(qd) * (f2 * std::exp(-std::abs(qd) / f3) + f4 * std::exp(-1 / (f5 * std::abs(qd))));
    }};
  }
  if (law == "friction_sech_tanh") {
    const double f2 = (0.3 + 0.4 * u(random)) * Fc, f3 = log_uniform(5, 20), f4 = log_uniform(60, 150);
    return {[=](double qd, double) {
      return Fc * (std::tanh(f4 * qd) - Sign(qd)) + f2 / std::cosh(f3 * qd) * std::tanh(f4 * qd);
    }};
  }
  const double f1 = (0.3 + 0.7 * u(random)) * Fc;
  return {[=](double qd, double) { return f1 * std::cbrt(qd); }};
}

// What a law's fit left, against what the truth leaves: chi^2 / 2 of the training rows.
struct Cost {
  double fit, truth;
  double error = 0, bound = 0;  // RMS torque of the fit's error, and sqrt(parameters / rows), both over sigma
};

Cost Recover(const std::string& law, std::uint64_t seed) {
  codegen::Robot robot = tests::PlainRobot("two_link", tests::Columns::kBase);
  const codegen::EffectRecord& record = tests::Records().at(law);
  for (int j = 0; j < robot.joints(); ++j) {
    codegen::EffectUse use;
    use.effect = law, use.joints = {j}, use.state = "estimated";
    robot.effect.push_back(use);
  }
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), seed);
  const codegen::Model model(robot, tests::Records());
  std::mt19937_64 random(seed);
  std::vector<Truth> truth;
  for (int j = 0; j < 2; ++j) truth.push_back(Draw(law, arm.Friction("Fc", j), random));
  const auto added = [&](const State& s) { return truth[static_cast<std::size_t>(s.joint)].added(s.qd, s.tau_rigid); };
  const Dataset noisy = arm.Run(40, 100 + seed, added, 0.25);
  Problem problem = MakeProblem(model, {&noisy});
  problem.covariance.resize(0, 0);
  for (int j = 0; j < 2; ++j) problem.sigma_Nm[j] = arm.noise_Nm(j);
  if (law == "stribeck") tests::HoldDelta(problem);
  const Solution s =
      Solve(FindMethod(record.nonlinear.empty() ? "weighted_pseudo_inverse" : "variable_projection"), problem);
  EXPECT_TRUE(s.converged) << law << seed;

  Cost cost{};
  const codegen::Model& plain = arm.model();
  std::vector<Eigen::MatrixXd> row, of_law;
  plain.Regressor(noisy.s, {}, {}, row);
  const auto columns = static_cast<std::size_t>(model.columns());
  model.Regressor(noisy.s, {s.z.data(), columns}, {s.z.data() + columns, static_cast<std::size_t>(model.nonlinear())},
                  of_law);
  int rows = 0;
  for (int j = 0; j < 2; ++j) {
    const VectorXd base = row[j] * arm.truth().head(plain.columns()), found = of_law[j] * s.z.head(model.columns());
    for (int k = 0; k < noisy.samples(); ++k) {
      if (!noisy.used(k, j)) continue;
      const double truly = base[k] + added({j, noisy.s.q(k, j), noisy.s.qd(k, j), 0});
      const double sigma = arm.noise_Nm(j);
      cost.fit += 0.5 * std::pow((noisy.tau(k, j) - found[k]) / sigma, 2);
      cost.truth += 0.5 * std::pow((noisy.tau(k, j) - truly) / sigma, 2);
      cost.error += std::pow((found[k] - truly) / sigma, 2);
      ++rows;
    }
  }
  cost.error = std::sqrt(cost.error / rows);
  int parameters = model.columns();
  for (int k = model.columns(); k < problem.start.size(); ++k) parameters += problem.lower[k] < problem.upper[k];
  cost.bound = std::sqrt(static_cast<double>(parameters) / rows);
  return cost;
}

class Laws : public testing::TestWithParam<const char*> {};

TEST_P(Laws, OfHandWrittenFriction_AreFoundAtNoMoreCostThanTheTruth) {
  double square = 0, bound = 0;
  constexpr int kDraws = 10;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const Cost cost = Recover(GetParam(), seed);
    EXPECT_LE(cost.fit, cost.truth) << GetParam() << " draw " << seed;
    square += cost.error * cost.error, bound += cost.bound * cost.bound;
    if (testing::Test::HasFailure())
      printf("%llu: %.3f %.3f, error %.4f of %.4f\n", static_cast<unsigned long long>(seed), cost.fit, cost.truth,
             cost.error, cost.bound);
  }
  // Chi^2 of some 100 degrees of freedom is within 40 % of its mean; its root within 20 %.
  EXPECT_LT(std::sqrt(square), 1.2 * std::sqrt(bound)) << GetParam();
}

INSTANTIATE_TEST_SUITE_P(OfTheSurvey, Laws,
                         testing::Values("stribeck", "friction_exponential", "friction_sech_tanh", "viscous_cuberoot"));

}  // namespace
}  // namespace armcal::calibration
