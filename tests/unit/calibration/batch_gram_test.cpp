// calibration tests - batch least squares against Eigen's QR of the stacked rows, its second path, and its memory.
#include "host_sim/identify/calibration/batch_gram.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <Eigen/QR>
#include <fstream>
#include <random>
#include <string>

#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::Er20Model;
using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

// Independent numbers for every joint, sample and signal; nothing in them is a motion.
Dataset RandomNumbers(int samples, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto numbers = [&](double scale) {
    MatrixXd m(samples, 6);
    for (double& v : m.reshaped()) v = scale * any(random);
    return m;
  };
  Dataset d;
  d.s.t = VectorXd::LinSpaced(samples, 0, 0.008 * (samples - 1));
  d.s.q = numbers(3), d.s.qd = numbers(2), d.s.qdd = numbers(9), d.tau = numbers(100);
  d.used = (numbers(1).array() > -0.5).cast<int>();
  return d;
}

VectorXd RandomWeight(unsigned seed) {
  std::mt19937 random(seed);
  VectorXd weight(6);
  for (double& w : weight) w = std::uniform_real_distribution<double>(0.1, 3)(random);
  return weight;
}

// The textbook way: all used rows stacked, then QR with column pivoting. What the product must never store.
template <class Matrix>
Matrix Stack(const Dataset& d, const VectorXd& weight, Matrix& right) {
  const codegen::Model& m = Er20Model();
  std::vector<MatrixXd> row;
  m.Regressor(d.s, std::vector<double>(m.columns(), 0.0), {}, row);
  Matrix A(d.used.sum(), m.columns());
  right.resize(d.used.sum(), 1);
  int r = 0;
  for (int j = 0; j < 6; ++j)
    for (int k = 0; k < d.samples(); ++k) {
      if (!d.used(k, j)) continue;
      using Scalar = typename Matrix::Scalar;
      const Scalar w = std::sqrt(static_cast<Scalar>(weight[j]));
      A.row(r) = w * row[j].row(k).cast<Scalar>();
      right(r++, 0) = w * static_cast<Scalar>(d.tau(k, j));
    }
  return A;
}

// Error of x in units of what one column alone would take of the right-hand side: columns differ by 1e4 in size.
double Distance(const VectorXd& x, const VectorXd& expected, const VectorXd& norm) {
  return (x - expected).cwiseProduct(norm).norm() / expected.cwiseProduct(norm).norm();
}

Solved Batch(const std::vector<const Dataset*>& logs, const VectorXd& weight) {
  return BatchLeastSquares(Er20Model(), logs, weight, VectorXd::Zero(Er20Model().columns()), {});
}

TEST(BatchLeastSquares, RandomNumbers_EqualPivotedQrOfTheStackedRows) {
  const VectorXd weight = RandomWeight(1);
  for (const int samples : {97, 1000}) {  // neither fills its last block or panel
    const Dataset d = RandomNumbers(samples, 2);
    MatrixXd y;
    const MatrixXd A = Stack(d, weight, y);
    const Solved s = Batch({&d}, weight);
    EXPECT_FALSE(s.orthogonal);
    EXPECT_EQ(s.rank, Er20Model().columns());
    // Condition of these rows, squared, is below 1e5: 1e-16 x 1e5 x the length of the sums.
    EXPECT_LT(Distance(s.x, A.colPivHouseholderQr().solve(y), A.colwise().norm()), 1e-10) << samples;
  }
}

TEST(BatchLeastSquares, TwoLogs_EqualTheirRowsTogether) {
  const VectorXd weight = RandomWeight(3);
  const Dataset a = RandomNumbers(150, 4), b = RandomNumbers(333, 5);
  MatrixXd ya, yb;
  const MatrixXd Aa = Stack(a, weight, ya), Ab = Stack(b, weight, yb);
  MatrixXd A(Aa.rows() + Ab.rows(), Aa.cols()), y(A.rows(), 1);
  A << Aa, Ab;
  y << ya, yb;
  EXPECT_LT(Distance(Batch({&a, &b}, weight).x, A.colPivHouseholderQr().solve(y), A.colwise().norm()), 1e-10);
}

// Joint 1 always turns at almost the same speed: only the seventh digit tells viscous from Coulomb friction.
void TurnSteadily(Dataset& d) {
  d.s.qd.col(0) = d.s.qd.col(0).unaryExpr([](double v) { return (v > 0 ? 0.5 : -0.5) + 1e-6 * v; });
}

TEST(BatchLeastSquares, ColumnsAlmostAlike_AreFactorisedAndKeepDigitsThatNormalEquationsLose) {
  const VectorXd weight = RandomWeight(6);
  Dataset d = RandomNumbers(600, 7);
  TurnSteadily(d);
  Wide wide_y;
  const Wide wide = Stack(d, weight, wide_y);
  // A torque that the model explains: then the error is that of the arithmetic, not of a large misfit.
  const VectorXd truth = VectorXd::LinSpaced(Er20Model().columns(), 1, 2);
  MatrixXd y;
  const MatrixXd A = Stack(d, weight, y);
  std::vector<MatrixXd> row;
  Er20Model().Regressor(d.s, std::vector<double>(truth.size(), 0.0), {}, row);
  for (int j = 0; j < 6; ++j) d.tau.col(j) = row[j] * truth;
  Stack(d, weight, wide_y);
  const VectorXd expected = wide.colPivHouseholderQr().solve(wide_y).cast<double>(), norm = A.colwise().norm();
  const Solved s = Batch({&d}, weight);
  EXPECT_TRUE(s.orthogonal);
  EXPECT_GT(s.condition, kNormalLimit);
  EXPECT_EQ(s.rank, Er20Model().columns());
  Stack(d, weight, y);
  const double streamed = Distance(s.x, expected, norm),
               normal = Distance(SolveNormal(A.transpose() * A, A.transpose() * y).x, expected, norm);
  // The condition of the rows, about 1e6 here, times double's rounding and a hundred for the sums' length.
  EXPECT_LT(streamed, 1e-16 * std::sqrt(s.condition) * 100);
  EXPECT_GT(normal, 10 * streamed);
}

TEST(BatchLeastSquares, AJointThatTurnsOneWay_GivesTheSmallestFitThatPredictsTheSame) {
  const VectorXd weight = RandomWeight(8);
  Dataset d = RandomNumbers(400, 9);
  d.s.qd.col(0) = d.s.qd.col(0).cwiseAbs();  // Coulomb friction is then the torque offset
  MatrixXd y;
  const MatrixXd A = Stack(d, weight, y);
  const Solved s = Batch({&d}, weight);
  EXPECT_TRUE(s.orthogonal);
  EXPECT_EQ(s.rank, Er20Model().columns() - 1);
  const MatrixXd fit = A * A.completeOrthogonalDecomposition().solve(y);
  EXPECT_LT((A * s.x - fit).norm(), 1e-9 * fit.norm());
  EXPECT_TRUE(s.x.allFinite());
}

// Numbers without any model: singular values are laid down, so the condition is known.
TEST(GramSolve, LaidDownSingularValues_AreSeenAndBothPathsSolve) {
  std::srand(1);
  constexpr int kRows = 300, kColumns = 20;
  for (const double condition : {1e1, 1e3, 1e6}) {
    const MatrixXd U = MatrixXd::Random(kRows, kColumns).householderQr().householderQ() *
                       MatrixXd::Identity(kRows, kColumns),
                   V = MatrixXd::Random(kColumns, kColumns).householderQr().householderQ();
    VectorXd values(kColumns);
    for (int k = 0; k < kColumns; ++k) values[k] = std::pow(condition, -k / (kColumns - 1.0));
    const MatrixXd A = U * values.asDiagonal() * V.transpose();
    const VectorXd x = VectorXd::Random(kColumns), y = A * x;
    const Solved normal = SolveNormal(A.transpose() * A, A.transpose() * y);
    // Scaling to unit diagonal changes the condition by at most the number of columns, the 1-norm likewise.
    EXPECT_GT(normal.condition, condition * condition / 400);
    EXPECT_LT(normal.condition, condition * condition * 400);
    EXPECT_LT((normal.x - x).norm() / x.norm(), 1e-15 * condition * condition * 20);
    StreamingQr qr(A.colwise().norm().cwiseInverse(), 32);
    for (int r = 0; r < kRows; ++r) qr.AddRow(A.row(r), y[r]);
    const Solved streamed = qr.Solve();
    EXPECT_EQ(streamed.rank, kColumns);
    EXPECT_LT((streamed.x - x).norm() / x.norm(), 1e-15 * condition * 20);
  }
}

TEST(GramSolve, AColumnOfZeros_GetsZero) {
  MatrixXd gram = MatrixXd::Zero(3, 3);
  gram(0, 0) = 4, gram(2, 2) = 9;
  const Solved s = SolveNormal(gram, Eigen::Vector3d(8, 0, 27));
  EXPECT_EQ(s.x, Eigen::Vector3d(2, 0, 3));
  EXPECT_EQ(s.rank, 2);
}

// KiB from /proc/self/status.
long Memory(const std::string& key) {
  std::ifstream in("/proc/self/status");
  for (std::string word; in >> word;)
    if (long value; word == key && in >> value) return value;
  return -1;
}

// Peak of what the call adds to what was there, in KiB; -1 where the kernel does not let us start the count anew.
long Peak(const Dataset& d, const VectorXd& weight) {
  malloc_trim(0);
  if (!(std::ofstream("/proc/self/clear_refs") << 5 << std::flush)) return -1;
  const long before = Memory("VmRSS:");
  Batch({&d}, weight);
  return Memory("VmHWM:") - before;
}

TEST(BatchLeastSquares, SixteenTimesTheSamples_TakeNoMoreMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps what was freed";
#endif
  const VectorXd weight = RandomWeight(10);
  for (const bool second_path : {false, true}) {
    Dataset small = RandomNumbers(2000, 11), large = RandomNumbers(32000, 12);
    for (Dataset* d : {&small, &large})
      if (second_path) TurnSteadily(*d);
    EXPECT_EQ(Batch({&small}, weight).orthogonal, second_path);  // what is loaded once is loaded now
    const long few = Peak(small, weight), many = Peak(large, weight);
    if (few < 0) GTEST_SKIP() << "no peak memory from the kernel";
    // The stored regressor of the large log would take 32000 x 6 x 58 x 8 bytes = 87000 KiB.
    EXPECT_LT(many, few + 1500) << "second path " << second_path;
  }
}

}  // namespace
}  // namespace armcal::calibration
