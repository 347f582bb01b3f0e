// search tests - both searches on functions whose minimum is known.
#include "host_sim/identify/search/minimise.hpp"
#include <gtest/gtest.h>
#include <cmath>
#include <limits>

namespace armcal::search {

namespace {

using Eigen::VectorXd;

TEST(Minimise, OnRosenbrocksValley_FindsTheMinimum) {
  const auto valley = [](const VectorXd& x, VectorXd& g) {
    double value = 0;
    g = VectorXd::Zero(x.size());
    for (int k = 0; k + 1 < x.size(); ++k) {
      const double a = x[k + 1] - x[k] * x[k], b = 1 - x[k];
      value += 100 * a * a + b * b;
      g[k] += -400 * a * x[k] - 2 * b, g[k + 1] += 200 * a;
    }
    return value;
  };
  VectorXd x = VectorXd::Constant(8, -0.5);
  MinimiseSettings settings;
  settings.iterations = 2000, settings.tolerance = 1e-14;
  EXPECT_LT(Minimise(valley, settings, x), 1e-10);
  EXPECT_LT((x - VectorXd::Ones(8)).norm(), 1e-4);
}

TEST(Minimise, WhereTheFunctionIsInfinite_TurnsBackAndNeverGetsWorse) {
  const auto log_barrier = [](const VectorXd& x, VectorXd& g) {
    if (!(x[0] > 0)) return std::numeric_limits<double>::infinity();
    g[0] = 1 - 1 / x[0];
    return x[0] - std::log(x[0]);
  };
  VectorXd x = VectorXd::Constant(1, 1e-3), g(1);
  const double before = log_barrier(x, g);
  const double after = Minimise(log_barrier, {}, x);
  EXPECT_LT(after, before);
  EXPECT_NEAR(x[0], 1, 1e-3);
}

TEST(Minimise, ToldToStop_LeavesTheStart) {
  const auto bowl = [](const VectorXd& x, VectorXd& g) { return g = 2 * x, x.squaredNorm(); };
  VectorXd x = VectorXd::Ones(2);
  MinimiseSettings settings;
  settings.stop = [] { return true; };
  EXPECT_EQ(Minimise(bowl, settings, x), 2);
  EXPECT_EQ(x, VectorXd::Ones(2));
}

}  // namespace

namespace {

using Eigen::VectorXd;

// Rastrigin's function with its minimum at 0.3: ten thousand local minima in four unknowns.
double Waves(const VectorXd& x) {
  double sum = 0;
  for (const double v : x) {
    const double u = 10 * (v - 0.3);
    sum += u * u + 10 - 10 * std::cos(2 * 3.14159265358979 * u);
  }
  return sum;
}

TEST(MinimiseGenetic, AmongManyLocalMinima_FindsTheLowest) {
  const GeneticResult found = MinimiseGenetic(Waves, 4, {});
  EXPECT_LT((found.x - VectorXd::Constant(4, 0.3)).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_NEAR(found.value, Waves(found.x), 1e-12);
  EXPECT_EQ(found.generations, 500);
}

TEST(MinimiseGenetic, FollowsFromItsSeed) {
  GeneticSettings settings;
  settings.generations = 30;
  const VectorXd one = MinimiseGenetic(Waves, 3, settings).x;
  EXPECT_EQ(MinimiseGenetic(Waves, 3, settings).x, one);
  settings.seed = 2;
  EXPECT_NE(MinimiseGenetic(Waves, 3, settings).x, one);
}

TEST(MinimiseGenetic, WhereTheFunctionIsInfiniteOrNoNumber_LooksElsewhere) {
  const auto half = [](const VectorXd& x) {
    if (x[0] < 0.4) return std::numeric_limits<double>::infinity();
    return x[0] > 0.6 ? std::nan("") : (x - VectorXd::Constant(2, 0.5)).squaredNorm();
  };
  EXPECT_LT(MinimiseGenetic(half, 2, {}).value, 1e-4);
}

TEST(MinimiseGenetic, ToldToStop_KeepsTheBestOfItsFirstIndividuals) {
  GeneticSettings settings;
  settings.stop = [] { return true; };
  const GeneticResult found = MinimiseGenetic(Waves, 2, settings);
  EXPECT_EQ(found.generations, 0);
  EXPECT_LE(found.value, 100);
  EXPECT_GE(found.x.minCoeff(), 0);
}

}  // namespace

}  // namespace armcal::search
