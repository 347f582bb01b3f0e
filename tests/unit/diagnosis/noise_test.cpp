// diagnosis tests - fit noise of known coefficients, and compare the gain of a column with a refit.
#include <gtest/gtest.h>

#include <Eigen/LU>
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
    ASSERT_GE(noise.order(), 2);
    ASSERT_LE(noise.order(), 4);         // by chance a coefficient may earn log(40000)
    EXPECT_NEAR(noise.a[0], kA1, 0.03);  // standard deviation 1 / sqrt(40000) = 0.005; more coefficients spread it
    EXPECT_NEAR(noise.a[1], kA2, 0.04);
    EXPECT_LT(noise.a.tail(noise.order() - 2).cwiseAbs().sum(), 0.04);
    EXPECT_NEAR(noise.innovation, kInnovation, 0.02 * kInnovation);
    // The process itself: variance (1 - a2) / ((1 + a2) ((1 - a2)^2 - a1^2)) of its innovation's, and what is left of
    // it if one row before is known, 1 / (1 - a2^2).
    EXPECT_NEAR(noise.start_sd[0], std::sqrt((1 - kA2) / ((1 + kA2) * ((1 - kA2) * (1 - kA2) - kA1 * kA1))), 0.1);
    EXPECT_NEAR(noise.start_sd[1], std::sqrt(1 / (1 - kA2 * kA2)), 0.03);
  }
}

// A torque drifts by up to 100 times the white noise, whose deviation is 1, in stretches of unequal lengths. Rows with
// 30 rows before them can be foreseen up to that noise.
TEST(FitNoise, OfATorqueThatDrifts_LeavesTheWhiteNoise) {
  for (const double level : {10, 30, 100})
    for (const std::uint64_t seed : {11U, 12U, 13U}) {
      std::mt19937_64 random(seed);
      std::normal_distribution<double> normal;
      std::uniform_real_distribution<double> part;
      RowIndex rows = Rows(8000, 8000);
      for (char& begin : rows.segment_begin) begin = part(random) < 0.01;
      rows.segment_begin[0] = 1;
      VectorXd e(rows.size());
      for (int k = 0; k < e.size(); ++k)
        e[k] = level * (1 + 0.5 * std::sin(k * 2 * M_PI / 2000) - std::exp(-k / 1800.0)) + normal(random);
      const NoiseModel noise = FitNoise(rows, e);
      const VectorXd white = noise.innovation * Whiten(noise, rows, e);
      std::vector<double> later;
      for (int k = 100; k < e.size(); ++k)
        if (std::none_of(rows.segment_begin.begin() + k - 30, rows.segment_begin.begin() + k + 1,
                         [](char b) { return b; }))
          later.push_back(std::abs(white[k]));
      EXPECT_NEAR(1.4826 * Median(later), 1, 0.2) << level << " " << seed;
    }
}

TEST(FitNoise, OfTooFewRows_IsWhite) {
  const RowIndex rows = Rows(10, 10);
  const VectorXd e = Coloured(rows, 1);
  const NoiseModel noise = FitNoise(rows, e);
  EXPECT_TRUE(IsWhite(noise));
  EXPECT_NEAR(noise.innovation, std::sqrt(e.squaredNorm() / 10), 1e-12);
}

TEST(Whiten, OfAColouredSeries_LeavesNoCorrelation) {
  const RowIndex rows = Rows(40000, 40000);
  const VectorXd e = Coloured(rows, 2);
  const NoiseModel noise = FitNoise(rows, e);
  const VectorXd white = Whiten(noise, rows, e);
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
}

// At 1 kHz noise that hangs together over a quarter of a second, and a white part. Averages over 0.2 s are as large as
// those of whitened rows must be.
TEST(Whiten, OfNoiseThatIsSlowForTheRate_LeavesNoSlowPart) {
  const RowIndex rows = Rows(40000, 40000);
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  VectorXd e(40000);
  double slow = 0;
  for (double& v : e) {
    slow = 0.996 * slow + std::sqrt(1 - 0.996 * 0.996) * normal(random);
    v = slow + 0.1 * normal(random);
  }
  const VectorXd white = Whiten(FitNoise(rows, e), rows, e);
  double squares = 0;
  for (int block = 0; block < 200; ++block) squares += 200 * std::pow(white.segment(200 * block, 200).mean(), 2);
  EXPECT_NEAR(squares / 200, 1, 0.4);  // its own deviation is 0.1
}

// Short stretches, most of whose rows have few rows before them: a covariance matrix of the process itself gives the
// same squares and the same determinant.
TEST(Whiten, OfTheFirstRowsOfAStretch_IsWhatTheProcessSays) {
  const RowIndex rows = Rows(12000, 3);
  const VectorXd e = Coloured(rows, 4);
  const NoiseModel noise = FitNoise(rows, e);
  ASSERT_EQ(noise.order(), 2);
  const double first = kA1 / (1 - kA2), second = kA1 * first + kA2;
  const double variance = kInnovation * kInnovation * (1 - kA2) / ((1 + kA2) * ((1 - kA2) * (1 - kA2) - kA1 * kA1));
  Eigen::Matrix3d C;
  C << 1, first, second, first, 1, first, second, first, 1;
  C *= variance;
  double squares = 0;
  for (int k = 0; k < 12000; k += 3) squares += e.segment<3>(k).dot(C.llt().solve(e.segment<3>(k)));
  EXPECT_NEAR(Whiten(noise, rows, e).squaredNorm(), squares, 0.02 * squares);
  EXPECT_NEAR(Deviance(noise, rows) - 2 * std::log(12000), 4000 * std::log(C.determinant()), 150);
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
  noise[1] = FitNoise(rows.index[1], Coloured(rows.index[1], 5));
  ASSERT_FALSE(IsWhite(noise[1]));
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

// Weighted squares of one fold's rows, as a fit of base (with unit prior) and columns to all other rows predicts them.
// The noise is white.
double SquaresOfFold(const BaseRows& rows, const std::vector<NoiseModel>& noise, const Columns& c, int fold) {
  constexpr int kRowsOfABlock = 20, kFolds = 5;
  const int d = rows.coordinates(), k = c.count();
  std::vector<VectorXd> fitted, judged;  // each row: base, columns, torque
  for (int i = 0; i < d; ++i) fitted.push_back(VectorXd::Unit(d + k + 1, i));
  for (std::size_t j = 0; j < rows.index.size(); ++j)
    for (int row = 0; row < rows.index[j].size(); ++row) {
      VectorXd all = VectorXd::Zero(d + k + 1);
      all.head(d) = rows.design[j].row(row);
      for (std::size_t r = 0; r < c.joints.size(); ++r)
        if (c.joints[r] == static_cast<int>(j)) all.segment(d, k) = c.block[r].row(row);
      all[d + k] = rows.target[j][row];
      (row / kRowsOfABlock % kFolds == fold ? judged : fitted).push_back(all / noise[j].innovation);
    }
  MatrixXd A(fitted.size(), d + k);
  VectorXd y(fitted.size());
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    A.row(at) = fitted[i].head(d + k), y[at] = fitted[i][d + k];
  }
  const VectorXd x = A.householderQr().solve(y);
  double sum = 0;
  for (const VectorXd& row : judged) sum += std::pow(row[d + k] - row.head(d + k).dot(x), 2);
  return sum;
}

// The columns explain more in the first half of the rows than in the second, so no two folds are alike.
TEST(Metric, GainOfAFold_IsThatOfAFitToTheOtherFolds) {
  std::srand(7);
  BaseRows rows;
  rows.L = MatrixXd::Identity(4, 4);
  rows.mean = VectorXd::Zero(4);
  Columns c, none;
  c.joints = none.joints = {1, 2};
  std::vector<NoiseModel> noise(3);
  for (int j = 0; j < 3; ++j) {
    noise[j].innovation = 0.1 * (j + 1);
    rows.index.push_back(Rows(400, 400));
    rows.columns.push_back({0, 1, 2, 3});
    rows.design.push_back(MatrixXd::Random(400, 4));
    rows.target.push_back(rows.design[j] * Eigen::Vector4d(1, -2, 0.5, 3) + 0.2 * VectorXd::Random(400));
    if (j == 0) continue;
    c.block.push_back(MatrixXd::Random(400, 2)), none.block.emplace_back(400, 0);
    rows.target[j].head(200) += c.block.back().topRows(200) * Eigen::Vector2d(0.3, -0.1);
  }
  for (int j = 0; j < 3; ++j) rows.Multiply(j);
  const VectorXd gains = Metric(rows, noise).FoldGains(c, 20, 5, {});
  ASSERT_EQ(gains.size(), 5);
  for (int fold = 0; fold < 5; ++fold) {
    const double expected = SquaresOfFold(rows, noise, none, fold) - SquaresOfFold(rows, noise, c, fold);
    EXPECT_NEAR(gains[fold], expected, 1e-6 * gains.norm()) << fold;
  }
}

}  // namespace
}  // namespace armcal::diagnosis
