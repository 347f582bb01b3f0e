// excitation tests - the series against the survey's formula and difference quotients; the search's minimiser.
#include "host_sim/excitation/fourier.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/excitation/minimise.hpp"
#include "tests/unit/excitation/arms.hpp"

namespace armcal::excitation {
namespace {

using Eigen::VectorXd;

TEST(Fourier, Position_IsEquation27) {
  const Fourier series = test::PublishedSeries();
  const double t = 3.7, w = series.frequency_radps;
  const codegen::Signals s = series.At(VectorXd::Constant(1, t));
  for (int j = 0; j < 6; ++j) {
    double q = series.coefficient(10, j);
    for (int l = 1; l <= 5; ++l)
      q += series.coefficient(l - 1, j) / (w * l) * std::sin(w * l * t) -
           series.coefficient(4 + l, j) / (w * l) * std::cos(w * l * t);
    EXPECT_NEAR(s.q(0, j), q, 1e-14);
  }
}

TEST(Fourier, SpeedAndAcceleration_AreDifferenceQuotientsOfPosition) {
  const Fourier series = test::PublishedSeries();
  const double d = 1e-4;
  const VectorXd t = test::OnePeriod(97), shift = VectorXd::Constant(97, d);
  const auto here = series.At(t), before = series.At(t - shift), after = series.At(t + shift);
  // Error of the quotients: d^2 / 6 times the third derivative of speed or position (order 100).
  EXPECT_LT(((after.q - before.q) / (2 * d) - here.qd).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(((after.qd - before.qd) / (2 * d) - here.qdd).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Fourier, RepeatsAfterItsPeriod_AndScalesAboutItsOffset) {
  const Fourier series = test::PublishedSeries();
  EXPECT_NEAR(series.period_s(), 10, 1e-12);
  const VectorXd t = test::OnePeriod(50);
  EXPECT_LT((series.At(t).q - series.At(t + VectorXd::Constant(50, 10)).q).cwiseAbs().maxCoeff(), 1e-12);
  const auto half = series.Scaled(0.5).At(t);
  const Eigen::RowVectorXd q0 = series.coefficient.row(10);
  EXPECT_LT(((series.At(t).q.rowwise() - q0) / 2 - (half.q.rowwise() - q0)).cwiseAbs().maxCoeff(), 1e-14);
}

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
}  // namespace armcal::excitation
