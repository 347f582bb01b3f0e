// calibration tests - the sums over logs against the stacked rows, and the memory that they take.
#include "host_sim/identify/calibration/information.hpp"

#include <gtest/gtest.h>
#include <malloc.h>

#include <fstream>
#include <random>
#include <string>

#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::Er20Model;

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

// The textbook way: the used rows of one joint, one below the other, and their torque.
MatrixXd Stack(const Dataset& d, int joint, VectorXd& right) {
  const codegen::Model& m = Er20Model();
  std::vector<MatrixXd> row;
  m.Regressor(d.s, std::vector<double>(m.columns(), 0.0), {}, row);
  std::vector<int> used;
  for (int k = 0; k < d.samples(); ++k)
    if (d.used(k, joint)) used.push_back(k);
  right = d.tau.col(joint)(used);
  return row[joint](used, Eigen::all);
}

Information Sums(const Dataset& d) { return Accumulate(Er20Model(), d, VectorXd::Zero(Er20Model().columns()), {}); }

// The sums are those of the stacked rows, in another order: 1e-16 times the root of a thousand rows, and some to spare.
constexpr double kRounding = 1e-13;

void ExpectSums(const Information& sums, int joint, const MatrixXd& A, const VectorXd& y) {
  const auto columns = Er20Model().columns();
  const MatrixXd gram = A.transpose() * A;
  const VectorXd right = A.transpose() * y;
  EXPECT_LT((sums.gram[joint].topLeftCorner(columns, columns) - gram).norm(), kRounding * gram.norm()) << joint;
  EXPECT_LT((sums.right[joint].head(columns) - right).norm(), kRounding * A.norm() * y.norm()) << joint;
  EXPECT_NEAR(sums.square[joint], y.squaredNorm(), kRounding * y.squaredNorm()) << joint;
  EXPECT_EQ(sums.rows[joint], A.rows()) << joint;
}

TEST(Information, RandomNumbers_EqualTheProductsOfTheStackedRows) {
  for (const int samples : {97, 1000}) {  // neither fills its last block or panel
    const Dataset d = RandomNumbers(samples, 2);
    const Information sums = Sums(d);
    for (int j = 0; j < 6; ++j) {
      VectorXd y;
      const MatrixXd A = Stack(d, j, y);
      ExpectSums(sums, j, A, y);
    }
  }
}

TEST(Information, TwoLogs_EqualTheirRowsTogether) {
  const Dataset a = RandomNumbers(150, 4), b = RandomNumbers(333, 5);
  Information sums = Sums(a);
  sums += Sums(b);
  for (int j = 0; j < 6; ++j) {
    VectorXd ya, yb;
    const MatrixXd Aa = Stack(a, j, ya), Ab = Stack(b, j, yb);
    MatrixXd A(Aa.rows() + Ab.rows(), Aa.cols());
    VectorXd y(A.rows());
    A << Aa, Ab;
    y << ya, yb;
    ExpectSums(sums, j, A, y);
  }
}

// KiB from /proc/self/status.
long Memory(const std::string& key) {
  std::ifstream in("/proc/self/status");
  for (std::string word; in >> word;)
    if (long value; word == key && in >> value) return value;
  return -1;
}

// Peak of what the call adds to what was there, in KiB; -1 where the kernel does not let us start the count anew.
long Peak(const Dataset& d) {
  malloc_trim(0);
  if (!(std::ofstream("/proc/self/clear_refs") << 5 << std::flush)) return -1;
  const long before = Memory("VmRSS:");
  Sums(d);
  return Memory("VmHWM:") - before;
}

TEST(Information, SixteenTimesTheSamples_TakeNoMoreMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps what was freed";
#endif
  const Dataset small = RandomNumbers(2000, 11), large = RandomNumbers(32000, 12);
  Sums(small);  // what is loaded once is loaded now
  const long few = Peak(small), many = Peak(large);
  if (few < 0) GTEST_SKIP() << "no peak memory from the kernel";
  // The stored regressor of the large log would take 32000 x 6 x 58 x 8 bytes = 87000 KiB.
  EXPECT_LT(many, few + 1500);
}

}  // namespace
}  // namespace armcal::calibration
