// excitation tests - the search has the right gradient, keeps the limits, and beats chance.
#include "host_sim/identify/excitation/optimise.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host_sim/identify/excitation/peaks.hpp"
#include "tests/unit/excitation/arms.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::excitation {
namespace {

using Eigen::VectorXd;

OptimiseSettings Searches(int starts) {
  OptimiseSettings settings;
  settings.starts = starts;
  settings.seconds = 1e6;
  return settings;
}

codegen::Signals OnCheckGrid(const Series& series) { return series.At(test::OnePeriod(10000)); }

TEST(Objective, Gradient_IsTheDifferenceQuotientOfTheValue) {
  for (const char* name : {"er20_like", "two_link", "emps"}) {
    codegen::Robot robot = test::RobotFile(name);
    for (codegen::Joint& j : robot.joint) j.torque_limit_Nm /= 5;  // so that the torque's penalty takes part
    const codegen::Model model = test::Arm(robot);
    const Observation observation(model);
    Objective objective(observation, {}, {}, 0.6);
    VectorXd gradient, unused;
    const VectorXd u = VectorXd::LinSpaced(objective.size(), 0.1, 20).array().sin();
    const double value = objective(u, gradient);
    ASSERT_GT(value, 5) << "the penalties should take part";
    const double d = 1e-6;
    for (int k = 0; k < u.size(); k += 3) {
      const VectorXd shift = d * VectorXd::Unit(u.size(), k);
      const double quotient = (objective(u + shift, unused) - objective(u - shift, unused)) / (2 * d);
      EXPECT_NEAR(gradient[k], quotient, 1e-5 * gradient.norm()) << name << " unknown " << k;
    }
  }
}

TEST(Objective, WithoutPenalties_IsCloseAboveTheLogarithmOfTheConditionNumber) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  const Observation observation(model);
  Objective objective(observation, {}, {}, 1e3);
  VectorXd gradient;
  const VectorXd u = VectorXd::LinSpaced(objective.size(), 0.1, 20).array().sin();
  const double value = objective(u, gradient);
  const double exact = std::log(observation.ConditionNumber(objective.Series(u).At(test::OnePeriod(80))));
  EXPECT_GE(value, exact);
  EXPECT_LE(value, exact + 2 * std::log(52.0) / 10);  // p = 10: each sum has at most 52 terms of its largest
}

// One slide that passes one limit only. What the limits add to the value is 100 times the sum over samples of the
// squared excess over the share that may be used.
TEST(Objective, BeyondEachLimit_PaysForTheSquaredExcess) {
  for (const std::string limit : {"position", "speed", "acceleration"}) {
    codegen::Robot robot = test::RobotFile("emps");
    codegen::Joint& car = robot.joint[0];
    const double half = limit == "position" ? 0.3 : 1e3, speed = limit == "speed" ? 0.2 : 1e3;
    const double acceleration = limit == "acceleration" ? 0.5 : 1e3;
    car.position_limit_rad = {0.2 - half, 0.2 + half};
    car.speed_limit_radps = speed, car.acceleration_limit_radps2 = acceleration;
    const codegen::Model model = test::Arm(robot);
    const Observation observation(model);
    const double share = 0.8;
    Objective bounded(observation, {}, {}, share), free(observation, {}, {}, 1e6);
    const VectorXd u = 3 * VectorXd::LinSpaced(bounded.size(), 0.1, 20).array().sin();
    const codegen::Signals s = bounded.Series(u).At(test::OnePeriod(80));
    double expected = 0;
    const auto pay = [&](double used) { expected += 100 * std::pow(std::max(0.0, used / share - 1), 2); };
    for (Eigen::Index k = 0; k < 80; ++k) {
      pay(std::abs(s.q(k, 0) - 0.2) / half);
      pay(std::abs(s.qd(k, 0)) / speed);
      pay(std::abs(s.qdd(k, 0)) / acceleration);
    }
    EXPECT_GT(expected, 100) << limit;
    EXPECT_NEAR(bounded(u) - free(u), expected, 1e-9 * expected) << limit;
    VectorXd gradient;
    EXPECT_NEAR(bounded(u, gradient) - free(u, gradient), expected, 1e-9 * expected) << limit;
  }
}

TEST(ScaleToLimits, OfASeriesThatBreaksThem_MeetsTheTightestOne) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  const Observation observation(model);
  Series series = test::PublishedSeries().Scaled(3);
  ASSERT_GT(LargestShare(FindPeaks(observation, OnCheckGrid(series))), 1.5);
  ASSERT_TRUE(ScaleToLimits(observation, 0.9, series));
  EXPECT_NEAR(LargestShare(FindPeaks(observation, OnCheckGrid(series))), 0.9, 1e-6);
}

TEST(ScaleToLimits, WhereTorqueIsTheTightestLimit_MeetsIt) {
  codegen::Robot robot = test::RobotFile("er20_like");
  robot.joint[2].torque_limit_Nm = 250;
  const codegen::Model model = test::Arm(robot);
  const Observation observation(model);
  Series series = test::PublishedSeries();
  ASSERT_TRUE(ScaleToLimits(observation, 0.95, series));
  const auto peaks = FindPeaks(observation, OnCheckGrid(series));
  EXPECT_LE(LargestShare(peaks), 0.95);
  EXPECT_GT(peaks[2].torque_share, 0.9);
}

TEST(ScaleToLimits, OfASeriesThatKeepsThem_ChangesNothing) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  Series series = test::PublishedSeries().Scaled(0.5);
  const Eigen::MatrixXd before = series.coefficient;
  ASSERT_TRUE(ScaleToLimits(Observation(model), 0.95, series));
  EXPECT_EQ(series.coefficient, before);
}

TEST(Optimise, KeepsEveryLimitWithItsMarginOnTheCheckGrid) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  OptimiseSettings settings = Searches(3);
  settings.margin = 0.2;
  const Optimum best = Optimise(observation, settings);
  EXPECT_LE(LargestShare(FindPeaks(observation, OnCheckGrid(best.series))), 0.8 + 1e-6);
  EXPECT_EQ(best.starts, 3);
}

TEST(Optimise, OnASixAxisArm_BeatsTheBestOfFiftyRandomSeries) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  const Observation observation(model);
  const OptimiseSettings settings = Searches(2);
  double best_random = INFINITY;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Series series;
    if (RandomSeries(observation, settings, seed, series))
      best_random = std::min(best_random, PeriodCondition(observation, series));
  }
  const Optimum best = Optimise(observation, settings);
  EXPECT_LT(best.figure, 0.7 * best_random);
  EXPECT_LT(best.figure, 6);  // single searches end between 4.2 and 5.5
  EXPECT_DOUBLE_EQ(best.figure, PeriodCondition(observation, best.series));
}

TEST(Optimise, WithTheSameSeedAndStarts_FindsTheSameOnAnyNumberOfThreads) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  OptimiseSettings settings = Searches(4);
  settings.threads = 1;
  const Optimum one = Optimise(observation, settings);
  settings.threads = 3;
  EXPECT_EQ(one.series.coefficient, Optimise(observation, settings).series.coefficient);
  settings.seed = 2;
  EXPECT_NE(one.series.coefficient, Optimise(observation, settings).series.coefficient);
}

TEST(Optimise, StoppedBeforeItBegins_StillReturnsASeriesWithinTheLimits) {
  const codegen::Model model = test::Arm(test::RobotFile("er20_like"));
  const Observation observation(model);
  const std::atomic<bool> stop{true};
  OptimiseSettings settings;
  settings.stop = &stop;
  const Optimum best = Optimise(observation, settings);
  EXPECT_LE(LargestShare(FindPeaks(observation, OnCheckGrid(best.series))), 0.95 + 1e-6);
}

TEST(Optimise, ForMotorsThatCannotHoldTheArm_SaysSo) {
  codegen::Robot robot = test::RobotFile("two_link");
  robot.joint[0].torque_limit_Nm = 0.1;
  const codegen::Model model = test::Arm(robot);
  const Observation observation(model);
  EXPECT_NE(files::test::ErrorOf([&] { Optimise(observation, Searches(2)); }).find("limits"), std::string::npos);
}

TEST(Optimise, ForARobotWithoutPrior_IgnoresTorqueLimits) {
  codegen::Robot robot = test::RobotFile("emps");
  robot.joint[0].torque_limit_Nm = 1e-3;
  const codegen::Model model = test::Arm(robot);
  EXPECT_LT(Optimise(Observation(model), Searches(4)).figure, 3);
}

}  // namespace
}  // namespace armcal::excitation
