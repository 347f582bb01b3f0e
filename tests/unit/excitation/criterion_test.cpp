// excitation tests - the criteria against plain linear algebra on K itself, and their derivatives.
#include "host_sim/identify/excitation/criterion.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

#include "host_sim/identify/excitation/optimise.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/identify/excitation/target.hpp"
#include "tests/unit/excitation/arms.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::excitation {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd SomeK() {
  MatrixXd k(40, 7);
  for (Eigen::Index i = 0; i < k.size(); ++i) k.data()[i] = std::sin(2.3 * static_cast<double>(i) + std::cos(i));
  k.col(2) *= 100;                        // of another unit
  k.col(5) = k.col(4) + 0.05 * k.col(5);  // nearly confused
  return k;
}
const Criterion kAll[] = {
    {Criterion::Kind::kCondition, {}}, {Criterion::Kind::kDOptimal, {}}, {Criterion::Kind::kAccuracy, {1, 4, 5}}};

TEST(Criterion, Figures_AreThoseOfKsSingularValuesAndInverse) {
  const MatrixXd k = SomeK(), gram = k.transpose() * k, inverse = gram.fullPivLu().inverse();
  const VectorXd s = Eigen::JacobiSVD<MatrixXd>(k * k.colwise().norm().cwiseInverse().asDiagonal()).singularValues();
  EXPECT_NEAR(Figure(kAll[0], gram) / (s[0] / s[6]), 1, 1e-10);
  EXPECT_NEAR(Figure(kAll[1], gram) * std::pow(gram.determinant(), 1.0 / 14), 1, 1e-10);
  const double product = inverse(1, 1) * inverse(4, 4) * inverse(5, 5);
  EXPECT_NEAR(Figure(kAll[2], gram) / std::pow(product, 1.0 / 6), 1, 1e-9);
  EXPECT_LT((Deviations(gram).array() / inverse.diagonal().array().sqrt() - 1).abs().maxCoeff(), 1e-9);
}

TEST(Criterion, Separation_IsTheShareOfAColumnThatTheOthersCannotExplain) {
  const MatrixXd k = SomeK();
  const VectorXd found = Separation(k.transpose() * k);
  for (int c = 0; c < k.cols(); ++c) {
    MatrixXd others(k.rows(), k.cols() - 1);
    others << k.leftCols(c), k.rightCols(k.cols() - 1 - c);
    const VectorXd rest = k.col(c) - others * others.colPivHouseholderQr().solve(k.col(c));
    EXPECT_NEAR(found[c], rest.norm() / k.col(c).norm(), 1e-10) << c;
  }
}

TEST(Criterion, OfASingularK_IsInfiniteAndSeparatesNothing) {
  MatrixXd k = SomeK();
  k.col(6) = k.col(0) - k.col(1);
  const MatrixXd gram = k.transpose() * k;
  for (const Criterion& c : kAll) EXPECT_EQ(Figure(c, gram), INFINITY);
  EXPECT_EQ(Separation(gram).maxCoeff(), 0);
  EXPECT_EQ(Deviations(gram).minCoeff(), INFINITY);
}

TEST(Criterion, Derivative_IsTheDifferenceQuotientOfTheLogarithm) {
  const MatrixXd k = SomeK(), gram = k.transpose() * k;
  for (const Criterion& c : kAll) {
    MatrixXd derivative, unused;
    SmoothFigure(c, gram, derivative);
    for (int i = 0; i < 7; ++i)
      for (int j = 0; j <= i; ++j) {
        MatrixXd up = gram, down = gram;
        const double d = 1e-6 * std::sqrt(gram(i, i) * gram(j, j)) * 0.01;
        up(i, j) += d, down(i, j) -= d;
        if (i != j) up(j, i) += d, down(j, i) -= d;
        const double quotient = (SmoothFigure(c, up, unused) - SmoothFigure(c, down, unused)) / (2 * d);
        const double expected = i == j ? derivative(i, i) : derivative(i, j) + derivative(j, i);
        const double size = 1 / std::sqrt(gram(i, i) * gram(j, j));
        EXPECT_NEAR(quotient / size, expected / size, 1e-3 * (1 + std::abs(expected / size))) << i << j;
      }
  }
}

TEST(Objective, ForEveryCriterionAndFamily_GradientIsTheDifferenceQuotient) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  for (const Family family : kFamilies)
    for (const Criterion& c : {Criterion{Criterion::Kind::kDOptimal, {}},
                               Criterion{Criterion::Kind::kAccuracy, observation.Places({"coulomb_viscous"})}}) {
      SeriesShape shape;
      shape.family = family;
      Objective objective(observation, c, shape, 0.6);
      const VectorXd u = VectorXd::LinSpaced(objective.size(), 0.1, 20).array().sin();
      VectorXd gradient;
      const double value = objective(u, gradient);
      EXPECT_NEAR(objective(u), value, 1e-12 * std::abs(value));
      for (int k = 0; k < u.size(); ++k) {
        const VectorXd shift = 1e-6 * VectorXd::Unit(u.size(), k);
        EXPECT_NEAR(gradient[k], (objective(u + shift) - objective(u - shift)) / 2e-6, 1e-5 * gradient.norm())
            << Name(family) << " unknown " << k;
      }
    }
}

// Each criterion's search must win by its own figure; if one ignored its setting, the figures would be equal.
TEST(Optimise, ByEachCriterion_WinsByItsOwnFigure) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  const Criterion criteria[] = {{Criterion::Kind::kCondition, {}},
                                {Criterion::Kind::kDOptimal, {}},
                                {Criterion::Kind::kAccuracy, observation.Places({"coulomb_viscous:2"})}};
  MatrixXd gram[3];
  for (int k = 0; k < 3; ++k) {
    OptimiseSettings settings;
    settings.criterion = criteria[k];
    settings.starts = 6, settings.seconds = 1e6;
    const Optimum best = Optimise(observation, settings);
    gram[k] = PeriodGram(observation, best.series);
    EXPECT_DOUBLE_EQ(best.figure, Figure(criteria[k], gram[k]));
  }
  for (int k = 0; k < 3; ++k)
    for (int step = 1; step < 3; ++step)
      EXPECT_LT(Figure(criteria[k], gram[k]), Figure(criteria[k], gram[(k + step) % 3])) << k << " against +" << step;
}

TEST(Optimise, ByGeneticAlgorithm_KeepsTheLimitsAndBeatsItsRandomStarts) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  OptimiseSettings settings;
  settings.search = Search::kGenetic;
  settings.starts = 1, settings.seconds = 1e6;
  const Optimum best = Optimise(observation, settings);
  EXPECT_LE(LargestShare(FindPeaks(observation, best.series.At(test::OnePeriod(10000)))), 0.95 + 1e-6);
  double random = INFINITY;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Series series;
    if (RandomSeries(observation, settings, seed, series))
      random = std::min(random, PeriodCondition(observation, series));
  }
  EXPECT_LT(best.figure, 0.9 * random);
}

TEST(Observation, Places_FindAnEffectsColumns_AndNameOneThatIsNotThere) {
  const codegen::Model model = test::Arm(test::RobotFile("two_link"));
  const Observation observation(model);
  EXPECT_EQ(observation.Places({"coulomb_viscous"}).size(), 4U);
  for (const int place : observation.Places({"coulomb_viscous:2"}))
    EXPECT_EQ(model.column_name(observation.columns()[place]).back(), '2');
  EXPECT_NE(files::test::ErrorOf([&] { observation.Places({"stribeck:1"}); }).find("stribeck:1"), std::string::npos);
}

// A search for the robot's own cond(K) does not separate two low-speed laws on one joint.
TEST(Target, SeparationAware_TellsTwoEffectsApartBetterThanConditionDoes) {
  const codegen::Robot robot = test::RobotFile("two_link");
  const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  const Target both(robot, records, std::vector<std::string>{"stribeck:2", "viscous_cuberoot:2"});
  ASSERT_EQ(both.criterion().about.size(), 2U);
  OptimiseSettings settings;
  settings.shape.samples = 250;  // low speeds are short
  settings.starts = 12, settings.seconds = 1e6, settings.seed = 2;
  const Target plain(robot, records, Criterion::Kind::kCondition);
  const MatrixXd usual = PeriodGram(both.observation(), Optimise(plain.observation(), settings).series);
  settings.criterion = both.criterion();
  const MatrixXd special = PeriodGram(both.observation(), Optimise(both.observation(), settings).series);
  EXPECT_LT(Figure(both.criterion(), special), 0.95 * Figure(both.criterion(), usual));
}

TEST(Target, Friction_AsksForAStribeckTermOnEveryJoint) {
  const Target target = Target::Friction(test::RobotFile("two_link"), codegen::ReadCatalogue("codegen/effects"));
  EXPECT_EQ(target.criterion().about.size(), 6U);  // Coulomb, viscous, Stribeck; two joints
}

TEST(Target, OfWhatCannotBeAsked_SaysWhat) {
  const codegen::Robot robot = test::RobotFile("two_link");
  const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  for (const char* name : {"no_such", "stribeck:7", "stribeck:x", "stribeck:", "temp_viscous:1"}) {
    const std::string error = files::test::ErrorOf([&] { Target(robot, records, std::vector<std::string>{name}); });
    EXPECT_NE(error.find(name), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace armcal::excitation
