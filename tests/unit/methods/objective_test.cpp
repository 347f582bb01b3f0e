// methods tests - (16), (22), (25) worked out by hand, row by row, and their gradients by differences.
#include "host_sim/identify/methods/search_problem.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::tests {
namespace {

using calibration::Criterion;
using calibration::Objective;
using calibration::Problem;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Criterion kAll[] = {Criterion::kSquares, Criterion::kForgetting, Criterion::kMeanSpread};

// One axis, three samples, tau = 2 qdd + 1 sgn(qd) + 3 qd + 0.5 and errors 1, 0, 2.
struct Axis {
  explicit Axis(bool stribeck)
      : robot(codegen::ReadRobot("codegen/robots/emps.toml")),
        model(stribeck ? WithStribeck(robot) : robot, Records()) {
    data.s.t = Eigen::Vector3d(0, 1, 2);
    data.s.q = MatrixXd::Zero(3, 1);
    data.s.qd = Eigen::Vector3d(1, -1, 2);
    data.s.qdd = Eigen::Vector3d(1, 2, 0);
    data.tau = Eigen::Vector3d(7.5, 0.5, 9.5);
    data.used = Eigen::MatrixXi::Ones(3, 1);
    problem = calibration::MakeProblem(model, {&data});
    problem.forgetting = 0.5;
    z = problem.start;
    for (int c = 0; c < model.columns(); ++c) {
      const std::string name = model.column_name(c);
      z[c] = name == "Fc1" ? 1 : name == "Fv1" ? 3 : model.is_rigid(c) ? 2 : name == "dFs1" ? 0 : 0.5;
    }
  }
  codegen::Robot robot;
  codegen::Model model;
  calibration::Dataset data;
  Problem problem;
  VectorXd z;
};

TEST(Objective, ThreeSamplesOfOneAxis_EqualTheFiguresWorkedOutByHand) {
  for (const bool stribeck : {false, true}) {
    const Axis axis(stribeck);
    Objective squares(axis.problem, Criterion::kSquares), forgetting(axis.problem, Criterion::kForgetting),
        spread(axis.problem, Criterion::kMeanSpread);
    EXPECT_NEAR(squares(axis.z), 1 + 0 + 4, 1e-12);
    EXPECT_NEAR(forgetting(axis.z), 0.25 * 1 + 0.5 * 0 + 1 * 4, 1e-12);
    EXPECT_NEAR(spread(axis.z), 1 + std::sqrt(2.0 / 3), 1e-12);  // mean 1, off by 0, -1, 1
  }
}

TEST(Objective, UnusedSamples_AgeTheOthersButDoNotCount) {
  Axis axis(false);
  axis.data.used(2, 0) = 0;
  Objective squares(axis.problem, Criterion::kSquares), forgetting(axis.problem, Criterion::kForgetting);
  EXPECT_NEAR(squares(axis.z), 1, 1e-12);
  EXPECT_NEAR(forgetting(axis.z), 0.25, 1e-12);
}

// (25) of a whole arm, straight from its formula.
double ByFormula(const Problem& problem, const VectorXd& z, Criterion criterion) {
  const codegen::Model& model = *problem.model;
  const calibration::Dataset& d = *problem.train[0];
  VectorXd x = VectorXd::Zero(model.columns() + model.joints());
  x.head(model.columns()) = z.head(model.columns());
  const MatrixXd tau =
      calibration::Predict(model, d, x, {z.data() + model.columns(), static_cast<std::size_t>(model.nonlinear())});
  double sum = 0;
  for (int j = 0; j < model.joints(); ++j) {
    double mean = 0, square = 0, aged = 0, count = 0;
    for (int k = 0; k < d.samples(); ++k)
      if (d.used(k, j)) mean += d.tau(k, j) - tau(k, j), ++count;
    mean /= count;
    double variance = 0;
    for (int k = 0; k < d.samples(); ++k) {
      if (!d.used(k, j)) continue;
      const double e = d.tau(k, j) - tau(k, j);
      variance += (e - mean) * (e - mean) / count;
      square += e * e;
      aged += std::pow(problem.forgetting, d.samples() - 1 - k) * e * e;
    }
    sum += criterion == Criterion::kSquares      ? square
           : criterion == Criterion::kForgetting ? aged
                                                 : std::abs(mean) + calibration::kSpreadWeight * std::sqrt(variance);
  }
  return sum;
}

VectorXd Near(const Problem& problem, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.8, 1.2);
  VectorXd z = problem.start;
  for (double& v : z) v = v == 0 ? any(random) : v * any(random);
  for (Eigen::Index c = problem.model->columns(); c < z.size(); ++c)
    z[c] = std::clamp(z[c], problem.lower[c], problem.upper[c]);
  return z;
}

class WholeArm : public testing::TestWithParam<bool> {
 protected:
  codegen::Robot Robot() const {
    const codegen::Robot plain = PlainRobot("er20_like", Columns::kStandard);
    return GetParam() ? WithStribeck(plain) : plain;
  }
  SyntheticArm arm_{Robot(), 31};
  calibration::Dataset data_ = arm_.Run(3, 32, Stribeck(arm_));
  Problem problem_ = calibration::MakeProblem(arm_.model(), {&data_});
};

TEST_P(WholeArm, Objective_EqualsTheFormulaRowByRow) {
  for (const Criterion criterion : kAll) {
    Objective objective(problem_, criterion);
    for (unsigned seed = 0; seed < 4; ++seed) {
      const VectorXd z = Near(problem_, seed);
      const double expected = ByFormula(problem_, z, criterion);
      EXPECT_NEAR(objective(z), expected, 1e-9 * expected);
    }
  }
}

TEST_P(WholeArm, Gradient_EqualsDifferences) {
  for (const Criterion criterion : kAll) {
    Objective objective(problem_, criterion);
    const VectorXd z = Near(problem_, 7);
    VectorXd gradient, ignored;
    const double value = objective(z, gradient);
    for (Eigen::Index c = 0; c < z.size(); ++c) {
      const double h = 1e-5 * std::max(1e-2, std::abs(z[c]));
      const VectorXd step = h * VectorXd::Unit(z.size(), c);
      const double slope = (objective(z + step, ignored) - objective(z - step, ignored)) / (2 * h);
      // rounding of the value over the step, and the third derivative
      EXPECT_NEAR(gradient[c], slope, 1e-5 * std::abs(slope) + 1e-13 * value / h) << c;
    }
  }
}

TEST_P(WholeArm, MeanAndSpread_AreSmoothedByLessThanTheNoiseHides) {
  Objective objective(problem_, Criterion::kMeanSpread);
  VectorXd gradient;
  const VectorXd z = Near(problem_, 8);
  const double plain = objective(z), smooth = objective(z, gradient);
  EXPECT_GE(smooth, plain);
  EXPECT_LT(smooth - plain, 0.02 * problem_.sigma_Nm.sum());
}

INSTANTIATE_TEST_SUITE_P(LinearAndStribeck, WholeArm, testing::Bool());

TEST(Objective, OneRowMore_IsSeen) {  // planted fault: the oracle above would notice a lost row
  SyntheticArm arm(PlainRobot("two_link", Columns::kStandard), 33);
  calibration::Dataset d = arm.Run(2, 34);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  for (const Criterion criterion : kAll) {
    Objective objective(problem, criterion);
    const double before = objective(problem.start), formula = ByFormula(problem, problem.start, criterion);
    EXPECT_NEAR(before, formula, 1e-9 * formula);
    calibration::Dataset less = d;
    for (int k = d.samples() - 1, gone = 0; k >= 0 && !gone; --k)
      if (d.used(k, 0)) less.used(k, 0) = 0, gone = 1;
    Objective other(calibration::MakeProblem(arm.model(), {&less}), criterion);
    EXPECT_GT(std::abs(other(problem.start) - formula), 1e-6 * formula);
  }
}

TEST(Objective, NonlinearModelWithMemory_IsRefused) {
  codegen::Robot robot = PlainRobot("two_link", Columns::kBase);
  SyntheticArm arm(robot, 35);
  const calibration::Dataset d = arm.Run(2, 36);
  codegen::EffectUse use;
  use.effect = "presliding_dahl", use.joints = {0};
  robot.effect.push_back(use);
  const codegen::Model model(robot, Records());
  EXPECT_THROW(Objective(calibration::MakeProblem(model, {&d}), Criterion::kMeanSpread), io::InputError);
}

}  // namespace
}  // namespace armcal::tests
