// calibration tests - products of tall matrices against long-double sums, for every remainder of the kernel's tiles.
#include "host_sim/identify/calibration/tall_product.hpp"

#include <gtest/gtest.h>

namespace armcal::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Largest error of out against a' b, relative to the lengths of the two columns.
double Error(const MatrixXd& a, const MatrixXd& b, const MatrixXd& out) {
  double worst = 0;
  for (Index i = 0; i < a.cols(); ++i)
    for (Index k = 0; k < b.cols(); ++k) {
      long double sum = 0;
      for (Index r = 0; r < a.rows(); ++r) sum += static_cast<long double>(a(r, i)) * b(r, k);
      const double scale = a.col(i).norm() * b.col(k).norm() + 1e-300;
      worst = std::max(worst, std::abs(static_cast<double>(sum) - out(i, k)) / scale);
    }
  return worst;
}

TEST(TallProduct, OfAnyShape_IsTheSumOfProducts) {
  std::srand(1);
  for (const Index rows : {0, 1, 3, 4, 511, 512, 513, 1030})
    for (const Index left : {1, 3, 4, 5, 9})
      for (const Index right : {1, 2, 3, 17}) {
        const MatrixXd a = MatrixXd::Random(rows, left), b = MatrixXd::Random(rows, right);
        const MatrixXd product = TallProduct(a, b), self = SelfProduct(b);
        ASSERT_EQ(product.rows(), left);
        ASSERT_EQ(product.cols(), right);
        EXPECT_LT(Error(a, b, product), 1e-15) << rows << " " << left << " " << right;
        EXPECT_LT(Error(b, b, self), 1e-15) << rows << " " << right;
        EXPECT_EQ(self, self.transpose());
      }
}

TEST(TallProduct, OfABlock_LeavesOutWhatLiesAboutIt) {
  MatrixXd whole = MatrixXd::Constant(40, 12, 1e9);
  whole.block(3, 2, 30, 7) = MatrixXd::Random(30, 7);
  const MatrixXd part = whole.block(3, 2, 30, 7);
  EXPECT_LT(Error(part, part, SelfProduct(whole.block(3, 2, 30, 7))), 1e-15);
  EXPECT_LT(Error(part, part.leftCols(2), TallProduct(whole.block(3, 2, 30, 7), whole.block(3, 2, 30, 2))), 1e-15);
}

}  // namespace
}  // namespace armcal::calibration
