// tests - Eigen's views on the target: the same bits, and an image without a heap, with and without NDEBUG.
#include "armcal/eigen.hpp"

#include "armcal/filter/kalman_filter.hpp"
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"

using namespace armcal;          // NOLINT: all of it is under test
using namespace armcal::target;  // NOLINT: the bench of these programs

namespace {

struct Layout {
  static constexpr int kJoints = 2, kFront = 4, kDense = 3, kColumns = 7, kNonlinear = 0;
  static constexpr int kFrontBegin[3] = {0, 2, 4};
  static constexpr int kRowBegin[2] = {0, 1};
};
using Filter = filter::KalmanFilter<Layout>;

filter::Prior<Layout> prior;
Filter kalman;
float front[4], dense[3], estimate[7];
Eigen::Matrix3f block;

}  // namespace

int Program() {
  for (int k = 0; k < Layout::kColumns; ++k) prior.active[k] = ~0u, prior.lambda[k] = 1.0f;
  for (int k = 0; k < Layout::kDense; ++k) prior.dense_ud[math::UdIndex(k, k)] = 1.0f;
  kalman.Restart(prior);
  Numbers numbers(9);
  for (int row = 0; row < 40; ++row) {
    for (float& h : front) h = numbers.Signed();
    for (float& h : dense) h = numbers.Signed();
    if (row % 2 == 1) dense[0] = 0.0f;
    (void)kalman.Update(row % 2, front, dense, numbers.Signed(), true);
  }
  for (int k = 0; k < Layout::kColumns; ++k) estimate[k] = kalman.x(k);
  eigen::View(estimate).tail<3>() -= 0.5f * eigen::View(dense);
  const int columns[3] = {1, 6, 2};
  eigen::CovarianceBlock<Filter, 3> sum;
  sum.Begin(columns, nullptr, block);
  while (!sum.Step(kalman, 2)) {
  }
  Digest digest;
  digest.Add(estimate, 7);
  digest.Add(block.data(), 9);
  port::runner::Line("eigen").Hex(digest.value()).End();
  return 0;
}
