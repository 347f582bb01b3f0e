// search tests - the genetic algorithm on functions whose minimum is known.
#include "host_sim/identify/search/genetic.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace armcal::search {
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
