// diagnosis tests - fit noise of known coefficients, and compare the gain of a column with a refit.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <random>

#include "host_sim/diagnose/diagnosis/metric.hpp"
#include "host_sim/diagnose/diagnosis/noise.hpp"

namespace armcal::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kA1 = 1.2, kA2 = -0.5, kInnovation = 0.3;

// One log whose stretches of `stretch` rows are apart; each begins a new, settled AR(2) process.
RowIndex Rows(int count, int stretch) {
  RowIndex rows;
  for (int k = 0; k < count; ++k) {
    rows.dataset.push_back(0);
    rows.sample.push_back(k + k / stretch);
    rows.segment_begin.push_back(k % stretch == 0);
  }
  return rows;
}

VectorXd Coloured(const RowIndex& rows, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, kInnovation);
  VectorXd e(rows.size());
  double one = 0, two = 0;
  const auto next = [&] {
    const double v = kA1 * one + kA2 * two + normal(random);
    two = one, one = v;
    return v;
  };
  for (int k = 0; k < rows.size(); ++k) {
    if (rows.segment_begin[k])
      for (int settle = 0; settle < 100; ++settle) next();
    e[k] = next();
  }
  return e;
}

double Correlation(const VectorXd& v, int lag) {
  return v.head(v.size() - lag).dot(v.tail(v.size() - lag)) / v.squaredNorm();
}

TEST(FitNoise, OfAKnownProcess_RecoversItsCoefficients) {
  for (const int stretch : {40000, 200}) {
    const RowIndex rows = Rows(40000, stretch);
    const NoiseModel noise = FitNoise(rows, Coloured(rows, 1));
    EXPECT_NEAR(noise.a[0], kA1, 0.03);  // standard deviation 1 / sqrt(40000) = 0.005; order 8 spreads it
    EXPECT_NEAR(noise.a[1], kA2, 0.04);
    EXPECT_LT(noise.a.tail(kArOrder - 2).cwiseAbs().maxCoeff(), 0.04);
    EXPECT_NEAR(noise.innovation, kInnovation, 0.02 * kInnovation);
  }
}

TEST(FitNoise, OfTooFewRows_IsWhite) {
  const RowIndex rows = Rows(100, 100);
  const VectorXd e = Coloured(rows, 1);
  const NoiseModel noise = FitNoise(rows, e);
  EXPECT_EQ(noise.a.norm(), 0);
  EXPECT_NEAR(noise.innovation, std::sqrt(e.squaredNorm() / 100), 1e-12);
}

TEST(Whiten, OfAColouredSeries_LeavesNoCorrelation) {
  const RowIndex rows = Rows(40000, 40000);
  const VectorXd e = Coloured(rows, 2);
  const NoiseModel noise = FitNoise(rows, e);
  const VectorXd white = Whiten(noise, rows, e).tail(40000 - kArOrder);
  EXPECT_NEAR(white.squaredNorm() / static_cast<double>(white.size()), 1, 0.03);
  EXPECT_GT(Correlation(e, 1), 0.7);
  for (int lag = 1; lag <= 20; ++lag) EXPECT_LT(std::abs(Correlation(white, lag)), 0.02) << lag;  // 4 / sqrt(40000)
}

TEST(Whiten, AcrossAGap_UsesNoNeighbourFromBeforeIt) {
  const RowIndex rows = Rows(40000, 200);
  VectorXd e = Coloured(rows, 3);
  const NoiseModel noise = FitNoise(rows, e);
  const VectorXd before = Whiten(noise, rows, e);
  e.head(200).setConstant(1e6);  // the first stretch; nothing after it may notice
  const VectorXd after = Whiten(noise, rows, e);
  EXPECT_EQ(before.tail(39800), after.tail(39800));
  int kept = 0;
  for (int k = 0; k < rows.size(); ++k) kept += before[k] != 0;
  EXPECT_EQ(kept, WhitenedRows(noise, rows));
  EXPECT_EQ(kept, 200 * (200 - kArOrder));
}

// Weighted squares that remain when z (with unit prior) and amplitudes (without) are fitted together.
double ChiSquare(const BaseRows& rows, const std::vector<NoiseModel>& noise, const Columns& c) {
  const int d = rows.coordinates(), k = c.count();
  int total = d;
  for (const auto& i : rows.index) total += i.size();
  MatrixXd A = MatrixXd::Zero(total, d + k);
  VectorXd y = VectorXd::Zero(total);
  A.topLeftCorner(d, d).setIdentity();
  int at = d;
  for (std::size_t j = 0; j < rows.index.size(); ++j) {
    const int size = rows.index[j].size();
    for (int i = 0; i < d; ++i) A.block(at, i, size, 1) = Whiten(noise[j], rows.index[j], rows.design[j].col(i));
    for (std::size_t r = 0; r < c.joints.size(); ++r)
      if (c.joints[r] == static_cast<int>(j))
        for (int i = 0; i < k; ++i) A.block(at, d + i, size, 1) = Whiten(noise[j], rows.index[j], c.block[r].col(i));
    y.segment(at, size) = Whiten(noise[j], rows.index[j], rows.target[j]);
    at += size;
  }
  return (y - A * A.householderQr().solve(y)).squaredNorm();
}

TEST(Metric, GainOfColumns_IsTheDropOfChiSquareInARefit) {
  std::srand(5);
  BaseRows rows;
  rows.L = MatrixXd::Identity(7, 7);
  rows.mean = VectorXd::Zero(7);
  const VectorXd z = VectorXd::Random(7);
  std::vector<NoiseModel> noise(3);
  for (int j = 0; j < 3; ++j) {
    rows.index.push_back(Rows(400, 400));
    rows.columns.push_back({0, 1, 2, 3, 4, 5, 6});
    rows.design.push_back(MatrixXd::Random(400, 7));
    rows.target.push_back(rows.design[j] * z + 0.2 * VectorXd::Random(400));
    noise[j].innovation = 0.1 * (j + 1);
  }
  noise[1].a[0] = 0.6, noise[1].a[1] = -0.2;
  Columns c;
  c.joints = {1, 2};
  c.block = {MatrixXd::Random(400, 2), MatrixXd::Random(400, 2)};
  rows.target[1] += c.block[0] * Eigen::Vector2d(0.3, -0.1);
  rows.target[2] += c.block[1] * Eigen::Vector2d(0.3, -0.1);
  for (int j = 0; j < 3; ++j) rows.Multiply(j);
  const Metric metric(rows, noise);
  const Gain gain = metric.Try(c);
  Columns none;
  none.joints = c.joints;
  none.block = {MatrixXd(400, 0), MatrixXd(400, 0)};
  const double drop = ChiSquare(rows, noise, none) - ChiSquare(rows, noise, c);
  EXPECT_GT(gain.gain, 100);
  EXPECT_NEAR(gain.gain, drop, 1e-9 * drop);
  EXPECT_EQ(gain.rank, 2);
  EXPECT_NEAR(gain.amplitude[0], 0.3, 4 * gain.sd[0]);
  EXPECT_NEAR(gain.amplitude[1], -0.1, 4 * gain.sd[1]);
}

TEST(Metric, AColumnOfTheBase_HasNoDirectionOfItsOwn) {
  std::srand(6);
  BaseRows rows;
  rows.L = 1e5 * MatrixXd::Identity(3, 3);  // a prior that holds nothing
  rows.mean = VectorXd::Zero(3);
  rows.index = {Rows(400, 400)};
  rows.columns = {{0, 1, 2}};
  rows.design = {MatrixXd::Random(400, 3)};
  rows.target = {VectorXd::Random(400)};
  rows.Multiply(0);
  Columns c;
  c.joints = {0};
  c.block = {rows.design[0].col(1) - 2 * rows.design[0].col(2)};
  EXPECT_EQ(Metric(rows, {NoiseModel{}}).Try(c).rank, 0);
}

}  // namespace
}  // namespace armcal::diagnosis
