// excitation tests - the curves against the survey's formula and difference quotients, and the properties of each
// family.
#include "host_sim/identify/excitation/series.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/excitation/arms.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::excitation {
namespace {

using Eigen::VectorXd;

Series Some(Family family, int terms = 10) {
  Eigen::MatrixXd c(terms + 1, 2);
  for (Eigen::Index i = 0; i < c.size(); ++i) c.data()[i] = std::sin(1.7 * static_cast<double>(i) + 0.3);
  return {family, 10, c};
}

TEST(Series, FouriersPosition_IsEquation27) {
  const Series series = test::PublishedSeries();
  const double t = 3.7, w = 2 * std::numbers::pi / 10;
  const codegen::Signals s = series.At(VectorXd::Constant(1, t));
  for (int j = 0; j < 6; ++j) {
    double q = series.coefficient(10, j);
    for (int l = 1; l <= 5; ++l)
      q += series.coefficient(l - 1, j) / (w * l) * std::sin(w * l * t) -
           series.coefficient(4 + l, j) / (w * l) * std::cos(w * l * t);
    EXPECT_NEAR(s.q(0, j), q, 1e-14);
  }
}

TEST(Series, SpeedAndAcceleration_AreDifferenceQuotientsOfPosition) {
  const double d = 1e-4;
  const VectorXd t = test::OnePeriod(97), shift = VectorXd::Constant(97, d);
  for (const Family family : kFamilies) {
    const Series series = Some(family);
    const auto here = series.At(t), before = series.At(t - shift), after = series.At(t + shift);
    // Error of the quotients: d^2 / 6 times the third derivative of position or speed; 8 reached by the polynomial's.
    const double worst = 1e-5 * std::max(1.0, here.qdd.cwiseAbs().maxCoeff());
    EXPECT_LT(((after.q - before.q) / (2 * d) - here.qd).cwiseAbs().maxCoeff(), worst) << Name(family);
    EXPECT_LT(((after.qd - before.qd) / (2 * d) - here.qdd).cwiseAbs().maxCoeff(), worst) << Name(family);
  }
}

TEST(Series, RepeatsAfterItsPeriod_AndScalesAboutItsOffset) {
  const VectorXd t = test::OnePeriod(50), later = t + VectorXd::Constant(50, 10);
  for (const Family family : kFamilies) {
    const Series series = Some(family);
    EXPECT_LT((series.At(t).qdd - series.At(later).qdd).cwiseAbs().maxCoeff(), 1e-9) << Name(family);
    const auto half = series.Scaled(0.5).At(t);
    const Eigen::RowVectorXd q0 = series.offset();
    EXPECT_LT(((series.At(t).q.rowwise() - q0) / 2 - (half.q.rowwise() - q0)).cwiseAbs().maxCoeff(), 1e-14);
  }
}

// Position, speed and acceleration do not jump where the period closes.
TEST(Series, ClosesSmoothly) {
  const VectorXd begin = VectorXd::Constant(1, 1e-9), end = VectorXd::Constant(1, 10 - 1e-9);
  for (const Family family : kFamilies) {
    const Series series = Some(family);
    const auto a = series.At(begin), b = series.At(end);
    EXPECT_LT((a.q - b.q).cwiseAbs().maxCoeff(), 1e-6) << Name(family);
    EXPECT_LT((a.qd - b.qd).cwiseAbs().maxCoeff(), 1e-6) << Name(family);
    EXPECT_LT((a.qdd - b.qdd).cwiseAbs().maxCoeff(), 1e-6) << Name(family);
  }
}

TEST(Series, ThePolynomial_IsAtRestAtItsOffsetAtBothEnds) {
  const Series series = Some(Family::kPolynomial);
  const auto s = series.At(VectorXd::Zero(1));
  EXPECT_EQ(s.q, series.offset());
  EXPECT_EQ(s.qd.cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(s.qdd.cwiseAbs().maxCoeff(), 0);
}

// B-splines of any degree sum to one; ours are scaled to a peak of one, and the quintic's is 66 / 120.
TEST(Series, EqualSplineWeights_AreAConstant) {
  for (const int terms : {3, 6, 10}) {
    Series series{Family::kSpline, 10, Eigen::MatrixXd::Constant(terms + 1, 1, 0.7)};
    const auto s = series.At(test::OnePeriod(77));
    EXPECT_LT((s.q.array() - 0.7 - 0.7 * 120 / 66.0).abs().maxCoeff(), 1e-12) << terms;
    EXPECT_LT(s.qd.cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Series, AnUnknownFamily_IsNamed) {
  for (const Family family : kFamilies) EXPECT_EQ(FamilyNamed(Name(family)), family);
  EXPECT_NE(files::test::ErrorOf([] { FamilyNamed("bezier"); }).find("bezier"), std::string::npos);
}

}  // namespace
}  // namespace armcal::excitation
