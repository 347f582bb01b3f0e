// methods tests - gradient descent, genetic algorithm and particle filter improve on the start, stay within the ranges
// and among possible bodies, repeat by seed, and can be stopped.
#include <gtest/gtest.h>

#include <random>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/search_problem.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::tests {
namespace {

using calibration::Criterion;
using calibration::Problem;
using calibration::SearchSpace;
using calibration::Solution;
using Eigen::VectorXd;

double MeanSpread(const Problem& problem, const VectorXd& z) {
  return calibration::Objective(problem, Criterion::kMeanSpread)(z);
}

TEST(SearchSpace, RandomPoints_AreDrawnBackToPossibleBodiesAndNoFurther) {
  for (const Columns columns : {Columns::kStandard, Columns::kBase}) {
    SyntheticArm arm(PlainRobot("er20_like", columns), 41);
    const calibration::Dataset d = arm.Run(1, 42);
    const Problem problem = calibration::MakeProblem(arm.model(), {&d});
    const SearchSpace space(problem, "test");
    std::mt19937 random(43);
    std::uniform_real_distribution<double> any(0, 1);
    int drawn = 0;
    for (int k = 0; k < 200; ++k) {
      VectorXd u(space.size());
      for (double& x : u) x = any(random);
      const VectorXd wanted = space.Point(u), z = space.Possible(wanted);
      EXPECT_TRUE(calibration::IsPhysical(space.Bodies(z)));
      EXPECT_TRUE((z.array() >= problem.lower.array() && z.array() <= problem.upper.array()).all());
      if (z == wanted) continue;
      ++drawn;
      EXPECT_FALSE(calibration::IsPhysical(space.Bodies(wanted)));
      const VectorXd further = z + 1e-5 * (wanted - problem.start);  // planted fault: drawn too far back
      EXPECT_FALSE(calibration::IsPhysical(space.Bodies(further)));
    }
    EXPECT_GT(drawn, 20);
    EXPECT_LT((space.Place(space.Point(VectorXd::Constant(space.size(), 0.3))).array() - 0.3).abs().maxCoeff(), 1e-9);
  }
}

TEST(SearchSpace, Bodies_GiveTheCoordinatesBack) {
  SyntheticArm arm(PlainRobot("er20_like", Columns::kBase), 44);
  const calibration::Dataset d = arm.Run(1, 45);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  const codegen::Model& model = arm.model();
  const VectorXd z = arm.truth().head(model.columns());
  const VectorXd bodies = SearchSpace(problem, "test").Bodies(z);
  const VectorXd rigid = z.segment(model.front(), model.rigid());
  EXPECT_LT((model.base_map() * bodies - rigid).norm(), 1e-9 * rigid.norm());
}

TEST(SearchSpace, Barrier_IsZeroAtTheStartAndItsGradientEqualsDifferences) {
  SyntheticArm arm(PlainRobot("er20_like", Columns::kStandard), 46);
  const calibration::Dataset d = arm.Run(1, 47);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  const SearchSpace space(problem, "test");
  VectorXd gradient, ignored;
  EXPECT_NEAR(space.Barrier(problem.start, ignored), 0, 1e-9);
  // half way to the edge of what can exist: at the edge itself the barrier is infinite
  const VectorXd z = 0.5 * (problem.start + space.Possible(space.Point(VectorXd::Constant(space.size(), 0.55))));
  space.Barrier(z, gradient);
  for (Eigen::Index c = 0; c < z.size(); ++c) {
    const double h = 1e-7 * std::max(1e-2, std::abs(z[c]));
    const VectorXd step = h * VectorXd::Unit(z.size(), c);
    const double slope = (space.Barrier(z + step, ignored) - space.Barrier(z - step, ignored)) / (2 * h);
    EXPECT_NEAR(gradient[c], slope, 1e-4 * std::abs(slope) + 1e-12 / h) << c;
  }
}

TEST(SearchSpace, WithoutRanges_IsRefusedInOneLine) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kBase), 48);
  const calibration::Dataset d = arm.Run(1, 49);
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  problem.upper[1] = std::numeric_limits<double>::infinity();
  for (const auto solve : {calibration::GradientDescent, calibration::Genetic, calibration::ParticleFilter}) {
    try {
      solve(problem);
      ADD_FAILURE() << "accepted";
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(arm.model().column_name(1)), std::string::npos) << e.what();
    }
  }
}

struct Search {
  const char* name;
  Solution (*solve)(const Problem&);
  bool random;
};
void PrintTo(const Search& s, std::ostream* out) { *out << s.name; }

class SearchMethod : public testing::TestWithParam<Search> {};

TEST_P(SearchMethod, TwoLinks_ComeCloseToWhatLeastSquaresLeaves) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kStandard), 51);
  const calibration::Dataset d = arm.Run(8, 52);
  const Problem problem = calibration::MakeProblem(arm.model(), {&d});
  const Solution s = GetParam().solve(problem);
  const double found = MeanSpread(problem, s.z), truth = MeanSpread(problem, arm.truth().head(s.z.size()));
  EXPECT_LT(found, 0.5 * MeanSpread(problem, problem.start));
  EXPECT_LT(found, 1.1 * truth);
  EXPECT_GT(found, 0.8 * truth);  // planted fault: an objective that loses rows or joints falls below the noise
  EXPECT_TRUE(s.physical);
  EXPECT_TRUE((s.z.array() >= problem.lower.array() && s.z.array() <= problem.upper.array()).all());
  EXPECT_EQ(s.path.size(), 0);
}

TEST_P(SearchMethod, Stribeck_IsSearchedTooAndWhatIsHeldStays) {
  SyntheticArm arm(WithStribeck(PlainRobot("two_link", Columns::kBase)), 53);
  const calibration::Dataset d = arm.Run(4, 54, Stribeck(arm));
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  HoldDelta(problem);
  const Solution s = GetParam().solve(problem);
  EXPECT_LT(MeanSpread(problem, s.z), 0.6 * MeanSpread(problem, problem.start));
  EXPECT_TRUE((s.z.array() >= problem.lower.array() && s.z.array() <= problem.upper.array()).all());
  int held = 0;
  for (Eigen::Index c = 0; c < s.z.size(); ++c)
    if (problem.lower[c] == problem.upper[c]) {
      EXPECT_EQ(s.z[c], problem.start[c]);
      ++held;
    }
  EXPECT_GE(held, 2);
}

TEST_P(SearchMethod, SameSeed_GivesTheSameBits) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kBase), 55);
  const calibration::Dataset d = arm.Run(2, 56);
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  std::atomic<bool> stop = false;  // a tenth of the way is enough to differ
  problem.stop = &stop;
  problem.progress = [&](double share, double) { stop = share > 0.1; };
  const auto found = [&](std::uint64_t seed) {
    stop = false, problem.seed = seed;
    return GetParam().solve(problem).z;
  };
  const VectorXd z = found(7);
  EXPECT_EQ(found(7), z);
  EXPECT_EQ(found(8) != z, GetParam().random);
}

TEST_P(SearchMethod, Stopped_GivesTheBestSoFar) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kBase), 57);
  const calibration::Dataset d = arm.Run(2, 58);
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  std::atomic<bool> stop = false;
  double last = INFINITY;
  problem.stop = &stop;
  problem.progress = [&](double share, double objective) {
    EXPECT_LE(objective, last);
    last = objective;
    EXPECT_LE(share, 1);
    stop = true;
  };
  const Solution s = GetParam().solve(problem);
  EXPECT_FALSE(s.converged);
  EXPECT_TRUE(s.physical);
  EXPECT_LE(MeanSpread(problem, s.z), 1.01 * last);  // gradient descent counts its barrier, too
}

TEST_P(SearchMethod, StartWithoutPossibleBodies_IsRefused) {
  codegen::Robot robot = PlainRobot("two_link", Columns::kStandard);
  SyntheticArm arm(robot, 59);
  const calibration::Dataset d = arm.Run(1, 60);
  robot.joint[1].link.inertia_kgm2 = {0.01, 0, 0, 0.01, 0, 0.05};  // 0.05 > 0.01 + 0.01
  const codegen::Model model(robot, Records());
  EXPECT_THROW(GetParam().solve(calibration::MakeProblem(model, {&d})), io::InputError);
}

// Weights draw all particles to the better ones. Moves alone bring them there, too, but take far longer: after 61
// rounds the best one is then still 40 % above what the truth leaves. With weights it is 1 % above.
TEST(ParticleFilter, AfterAFewRounds_IsCloseToWhatTheTruthLeaves) {
  SyntheticArm arm(PlainRobot("two_link", Columns::kBase), 51);
  const calibration::Dataset d = arm.Run(4, 52);
  Problem problem = calibration::MakeProblem(arm.model(), {&d});
  std::atomic<bool> stop = false;
  problem.stop = &stop;
  int calls = 0;
  problem.progress = [&](double, double) { stop = ++calls == 7; };  // every tenth round, from the first on
  const double truth = MeanSpread(problem, arm.truth().head(arm.model().columns()));
  constexpr int kSeeds = 16;
  double above = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    stop = false, calls = 0, problem.seed = static_cast<std::uint64_t>(seed);
    const Solution s = calibration::ParticleFilter(problem);
    EXPECT_EQ(s.iterations, 61);
    above += (MeanSpread(problem, s.z) / truth - 1) / kSeeds;
  }
  EXPECT_LT(above, 0.12);
}

INSTANTIATE_TEST_SUITE_P(Of25, SearchMethod,
                         testing::Values(Search{"gradient_descent", calibration::GradientDescent, false},
                                         Search{"genetic", calibration::Genetic, true},
                                         Search{"particle_filter", calibration::ParticleFilter, true}),
                         [](const auto& i) { return std::string(i.param.name); });

}  // namespace
}  // namespace armcal::tests
