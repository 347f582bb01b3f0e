// diagnosis tests - a bound is asked of the parameter itself, on a base of one column that is solved by hand.
#include "host_sim/diagnose/diagnosis/metric.hpp"

#include <gtest/gtest.h>

namespace armcal::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// One joint, one parameter with the prior 2 +- 1, and 99 rows in which it acts with the factor 1. The noise has the
// deviation 1, so the parameter's own is 1 / sqrt(99 + 1) = 0.1. It is bounded to 0 .. 5.
BaseRows OneParameter() {
  constexpr int kRows = 99;
  BaseRows rows;
  rows.index.resize(1);
  for (int k = 0; k < kRows; ++k) {
    rows.index[0].dataset.push_back(0);
    rows.index[0].sample.push_back(k);
    rows.index[0].segment_begin.push_back(k == 0);
  }
  rows.columns = {{0}};
  rows.design = {MatrixXd::Ones(kRows, 1)};
  rows.target = {VectorXd::Zero(kRows)};
  rows.L = MatrixXd::Ones(1, 1);
  rows.mean = VectorXd::Constant(1, 2);
  rows.bounded = {{0, 0, 0.0, 5.0}};
  rows.Multiply(0);
  return rows;
}

// z is the deviation from the prior's mean. Two deviations, 0.2, beyond a bound are still within it.
TEST(InBounds, AsksTheParameter_NotItsDeviationFromThePrior) {
  const BaseRows rows = OneParameter();
  const Metric metric(rows, {NoiseModel{}});
  const auto in_bounds = [&](double parameter, const std::vector<int>& joints) {
    Gain g;
    g.z = VectorXd::Constant(1, parameter - 2);
    return metric.InBounds(g, joints);
  };
  for (const double inside : {-0.19, 0.5, 2.0, 4.5, 5.19}) EXPECT_TRUE(in_bounds(inside, {0})) << inside;
  for (const double outside : {-1.0, -0.21, 5.21, 6.5}) {
    EXPECT_FALSE(in_bounds(outside, {0})) << outside;
    EXPECT_TRUE(in_bounds(outside, {1})) << "the bound of another joint, " << outside;
  }
}

// A column of mean 1. The base and its prior take (sum of the column)^2 / 100 of its squares.
TEST(Imitates, ItselfTakesAllThatTheBaseLeavesOfAColumn) {
  const BaseRows rows = OneParameter();
  const Metric metric(rows, {NoiseModel{}});
  Columns column;
  column.joints = {0};
  column.block = {MatrixXd::Ones(rows.index[0].size(), 1)};
  for (int k = 0; k < rows.index[0].size(); ++k) column.block[0](k, 0) += k % 2 ? 0.5 : -0.5;
  const double left = column.block[0].squaredNorm() - std::pow(column.block[0].sum(), 2) / 100;
  const auto [taken, own] = metric.Imitates(column, column, VectorXd::Ones(1));
  EXPECT_NEAR(own, left, 1e-9 * left);
  EXPECT_NEAR(taken, left, 1e-6 * left);
}

}  // namespace
}  // namespace armcal::diagnosis
