// survey tests - the arm's variants, priors and platform, against formulas of their own and another program's figures.
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "tests/unit/survey/survey_arm.hpp"

namespace armcal::survey {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Variants, LinearModel_HasTheSurveys48BaseColumns) {
  EXPECT_EQ(test::Arm(Law::kCoulombViscous, Bodies::kBase).columns(), 48);
  EXPECT_EQ(test::Arm(Law::kGradient, Bodies::kBase).columns(), 60);
}

TEST(Variants, StandardSet_SaysTheSameTorqueAsBaseParameters) {
  const codegen::Model base = test::Arm(Law::kStribeck, Bodies::kBase),
                       standard = test::Arm(Law::kStribeck, Bodies::kStandard);
  const codegen::Signals s = Sampled(test::StudyNonlinear(), 50);
  EXPECT_LT((Torque(base, s, SetParameters(base)) - Torque(standard, s, SetParameters(standard))).cwiseAbs().maxCoeff(),
            1e-9);  // N m of some hundred: round-off
}

// Friction alone: the torque of the variant minus that of (7) with no friction, against (4) to (8) written by hand.
TEST(Variants, StribeckFriction_IsEquationFourWithDeltaTwo) {
  const codegen::Model stribeck = test::Arm(Law::kStribeck, Bodies::kStandard),
                       plain = test::Arm(Law::kCoulombViscous, Bodies::kStandard);
  const codegen::Signals s = Sampled(test::StudyNonlinear(), 400);
  const MatrixXd difference = Torque(stribeck, s, SetParameters(stribeck)) - Torque(plain, s, SetParameters(plain));
  for (int j = 0; j < 6; ++j) {
    const double fc = test::File().joint[j].nominal.at("Fc");
    for (int k = 0; k < s.samples(); ++k) {
      const double v = s.qd(k, j), sign = v > 0 ? 1 : v < 0 ? -1 : 0;
      EXPECT_NEAR(difference(k, j), 0.2 * fc * std::exp(-std::pow(std::abs(v) / 0.1, 2)) * sign, 1e-9);
    }
  }
}

TEST(Variants, GradientColumns_AreTheDerivativesOfTheStribeckTorque) {
  const codegen::Model gradient = test::Arm(Law::kGradient, Bodies::kBase);
  const codegen::Signals s = Sampled(test::StudyNonlinear(), 100);
  std::vector<MatrixXd> row;
  gradient.Regressor(s, {}, {}, row);
  const auto law = [](double v, double fc, double fs, double qs, double beta) {
    return v == 0 ? 0 : (fc + (fs - fc) * std::exp(-v * v / (qs * qs))) * std::copysign(1, v) + beta * v;
  };
  const int j = 3;
  double phi[] = {12, 14.4, 0.1, 10};
  const char* const names[] = {"Fc4", "Fs4", "qs4", "beta4"};
  for (int p = 0; p < 4; ++p) {
    const int column = PlaceOf(gradient, std::string("stribeck_gradient.") + names[p]);
    ASSERT_GE(column, 0) << names[p];
    // d / d qs carries the constant 2 (Fs - Fc) / qs^3
    const double scale = p == 2 ? 2 * (phi[1] - phi[0]) / std::pow(phi[2], 3) : 1;
    for (int k = 0; k < s.samples(); ++k) {
      const double v = s.qd(k, j), h = 1e-6 * phi[p], at = phi[p];
      phi[p] = at + h;
      const double above = law(v, phi[0], phi[1], phi[2], phi[3]);
      phi[p] = at - h;
      const double below = law(v, phi[0], phi[1], phi[2], phi[3]);
      phi[p] = at;
      EXPECT_NEAR(scale * row[j](k, column), (above - below) / (2 * h), 1e-5 * (1 + std::abs(scale))) << names[p];
    }
  }
}

ExcitedBy Examined(Law law, const excitation::Series& series) {
  ExcitedBy e;
  e.law = law, e.series = series;
  Examine(test::File(), test::AllRecords(), e);
  return e;
}

// Two trajectories and their condition numbers from another program in another language. Printed with 3 digits, and
// the coefficients with 4.
TEST(Trajectories, StudysOwn_HaveTheConditionNumbersItFound) {
  const ExcitedBy linear = Examined(Law::kCoulombViscous, test::StudyLinear());
  EXPECT_NEAR(linear.condition, 4.37, 0.02);
  EXPECT_EQ(linear.columns, 48);
  EXPECT_LE(linear.share, 1.0);
  const ExcitedBy nonlinear = Examined(Law::kGradient, test::StudyNonlinear());
  EXPECT_NEAR(nonlinear.condition, 4.40, 0.02);
  EXPECT_EQ(nonlinear.columns, 60);
}

TEST(Trajectories, ConditionNumber_OfUnscaledColumnsIsAnotherNumber) {
  const ExcitedBy e = Examined(Law::kCoulombViscous, test::StudyLinear());
  EXPECT_GT(e.raw, 20 * e.condition);  // the study: 160 to 310
  EXPECT_NE(e.unweighted, e.condition);
}

TEST(Priors, WorstCase_IsTwentyPercentOffEverywhereAndPhysical) {
  const codegen::Robot prior = DrawPrior(test::File(), {PriorError::kWorst, 0.2}, 5);
  for (int j = 0; j < 6; ++j) {
    const codegen::Link &a = prior.joint[j].link, &b = test::File().joint[j].link;
    EXPECT_NEAR(std::abs(a.mass_kg / b.mass_kg - 1), 0.2, 1e-12);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(a.center_m[k] / b.center_m[k] - 1), 0.2, 1e-12);
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(std::abs(a.inertia_kgm2[k] / b.inertia_kgm2[k] - 1), 0.2, 1e-12);
    EXPECT_NEAR(std::abs(prior.joint[j].nominal.at("Fc") / test::File().joint[j].nominal.at("Fc") - 1), 0.2, 1e-12);
  }
  const codegen::Model model(Variant(prior, Law::kCoulombViscous, Bodies::kStandard, SetStribeck(6)),
                             test::AllRecords());
  EXPECT_TRUE(calibration::IsPhysical(calibration::BodyMean(model)));
  EXPECT_NEAR(CompareBodies(calibration::BodyMean(test::Arm(Law::kCoulombViscous, Bodies::kStandard)),
                            calibration::BodyMean(model), test::LevelFile())
                  .e_d,
              0.2, 1e-9);
}

TEST(Priors, SameSeed_SameDraw_AndAnotherSeedAnother) {
  const PriorError e;
  EXPECT_EQ(DrawPrior(test::File(), e, 3).joint[1].link.mass_kg, DrawPrior(test::File(), e, 3).joint[1].link.mass_kg);
  EXPECT_NE(DrawPrior(test::File(), e, 3).joint[1].link.mass_kg, DrawPrior(test::File(), e, 4).joint[1].link.mass_kg);
}

TEST(Priors, ProblemsDeviation_OfFrictionIsRelativeToItsMean) {
  const codegen::Model model = test::Arm(Law::kStribeck, Bodies::kStandard);
  const calibration::Dataset log = Measured(Sampled(test::StudyNonlinear(), 10), MatrixXd::Zero(10, 6));
  const calibration::Problem p = WithPrior(model, {&log}, 0.2);
  const int dfs = PlaceOf(model, "stribeck.dFs3"), vs = PlaceOf(model, "stribeck.vs3");
  EXPECT_NEAR(p.covariance(dfs, dfs), std::pow(0.2 * 10, 2), 1e-12);
  EXPECT_NEAR(p.covariance(vs, vs), std::pow(0.2 * 0.1, 2), 1e-12);
  EXPECT_LE(p.lower[vs], 0.1);
  EXPECT_GE(p.upper[vs], 0.1);
}

TEST(Platform, CentralDifferences_OfASineAreItsDerivatives) {
  const VectorXd t = VectorXd::LinSpaced(1000, 0, 9.99);
  const MatrixXd q = (2 * t.array()).sin();
  for (const codegen::Signals& s : {Differentiated(t, q), Filtered(t, q)}) {
    const auto inner = Eigen::seq(200, 800);
    EXPECT_LT((s.qd.col(0)(inner).array() - 2 * (2 * t(inner).array()).cos()).abs().maxCoeff(),
              3e-4);  // (2 h)^2 / 6 * 2
    EXPECT_LT((s.qdd.col(0)(inner).array() + 4 * (2 * t(inner).array()).sin()).abs().maxCoeff(), 3e-4);
  }
}

TEST(Platform, TwentyHertzFilter_LowersTheNoiseOfTheAcceleration) {
  const VectorXd t = VectorXd::LinSpaced(1000, 0, 9.99);
  const MatrixXd q = Noise(1000, VectorXd::Constant(1, 1e-4), 1);
  const double plain = Differentiated(t, q).qdd.norm(), filtered = Filtered(t, q).qdd.norm();
  EXPECT_NEAR(plain / std::sqrt(1000), std::sqrt(6.0), 0.2);  // sqrt(6) sigma / h^2
  EXPECT_LT(filtered, 0.4 * plain);
}

}  // namespace
}  // namespace armcal::survey
