// methods tests - the steps that methods share, against matrices in Eigen.
#include "host_sim/identify/methods/shared_steps.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::calibration {
namespace {

TEST(PriorFactor, OfAFullCovariance_GivesItBackOverTheFreeCoordinates) {
  const tests::SyntheticArm arm(tests::WithStribeck(tests::PlainRobot("two_link", tests::Columns::kBase)), 1);
  Problem p = MakeProblem(arm.model(), {});
  tests::HoldDelta(p);
  const std::vector<int> free = FreeCoordinates(p);
  const int size = static_cast<int>(p.start.size()), count = static_cast<int>(free.size());
  ASSERT_EQ(count, size - 2);  // delta is held on both joints
  // Deviations of different size, and neighbours that go together: 0.5^|i - k|.
  for (int i = 0; i < size; ++i)
    for (int k = 0; k < size; ++k) p.covariance(i, k) = (1 + 0.3 * i) * (1 + 0.3 * k) * std::pow(0.5, std::abs(i - k));
  const Eigen::MatrixXd L = PriorFactor(p);
  ASSERT_EQ(L.rows(), size);
  ASSERT_EQ(L.cols(), count);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(size, size);
  for (const int i : free)
    for (const int k : free) expected(i, k) = p.covariance(i, k);
  EXPECT_LT((L * L.transpose() - expected).norm(), 1e-12 * expected.norm());
}

}  // namespace
}  // namespace armcal::calibration
