// filter - the Kalman form against dense double algebra; knows no model.
#include "armcal/filter/kalman_filter.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

constexpr std::uint32_t kAll = 7;
using Filter = KalmanFilter<Small>;

void Feed(Filter& filter, const std::vector<Row>& rows) {
  for (const Row& r : rows) {
    EXPECT_TRUE(filter.Update(r.joint, r.front, r.dense, r.y, true).accepted);
    if (r.joint == Small::kJoints - 1) filter.EndSample(kAll);
  }
}

// The textbook filter in double: P, x, with Schmidt's gain for considered columns.
struct Textbook {
  Matrix p;
  Vector x;
  explicit Textbook(const Prior<Small>& prior) : p(PriorCovariance(prior)), x(Vector::Zero(Small::kColumns)) {}
  UpdateReport Update(const Vector& h, double y, const Vector& considered) {
    const double s = h.dot(p * h) + 1, innovation = y - h.dot(x);
    const Vector gain = (Vector::Ones(x.size()) - considered).cwiseProduct(p * h / s);
    const Matrix keep = Matrix::Identity(x.size(), x.size()) - gain * h.transpose();
    p = keep * p * keep.transpose() + gain * gain.transpose();
    x += gain * innovation;
    return {static_cast<float>(innovation), static_cast<float>(s), true, core::Status::kOk};
  }
};

TEST(KalmanFilter, WithoutNoise_IsTheBatchSolution) {
  Bench bench;
  bench.size = 3;
  const std::vector<Row> rows = bench.Rows(2000);
  Filter filter;
  filter.Restart(bench.prior);
  Feed(filter, rows);
  const Posterior oracle = SolveBatch(bench.prior, rows);
  const Filter::ReadOut out = Read(filter);
  EXPECT_LT(Distance<Small>(out.x, oracle), 0.01);  // float32: 6e-8 of 1, sd about 5e-3
  for (int k = 0; k < Small::kColumns; ++k) EXPECT_NEAR(out.sd[k] / oracle.sd(k), 1, 1e-3);
}

TEST(KalmanFilter, EachReport_IsTheTextbookInnovationAndVariance) {
  Bench bench;
  Filter filter;
  filter.Restart(bench.prior);
  Textbook textbook(bench.prior);
  for (const Row& r : bench.Rows(40)) {
    const UpdateReport got = filter.Update(r.joint, r.front, r.dense, r.y, true);
    const UpdateReport expected = textbook.Update(Full<Small>(r), r.y, Vector::Zero(Small::kColumns));
    EXPECT_NEAR(got.innovation, expected.innovation, 2e-5);
    EXPECT_NEAR(got.variance / expected.variance, 1, 1e-4);
  }
}

TEST(KalmanFilter, ConsideredColumns_CountAndDoNotMove) {
  Bench bench;
  for (const int k : {1, 6}) {
    bench.prior.considered[k] = true;
    bench.prior.any_considered = true;
  }
  Vector considered = Vector::Zero(Small::kColumns);
  considered(1) = considered(6) = 1;
  Filter filter;
  filter.Restart(bench.prior);
  Textbook textbook(bench.prior);
  for (const Row& r : bench.Rows(300)) {
    filter.Update(r.joint, r.front, r.dense, r.y, true);
    textbook.Update(Full<Small>(r), r.y, considered);
  }
  const Filter::ReadOut out = Read(filter);
  EXPECT_EQ(out.x[1], 0.0f);
  EXPECT_EQ(out.x[6], 0.0f);
  for (int k = 0; k < Small::kColumns; ++k) {
    const double sd = std::sqrt(textbook.p(k, k));
    EXPECT_NEAR(out.sd[k] / sd, 1, 2e-3) << k;
    EXPECT_NEAR((out.x[k] - textbook.x(k)) / sd, 0, 0.01) << k;
  }
  EXPECT_NEAR(out.sd[6], 1, 1e-4);
}

TEST(KalmanFilter, ProcessNoise_HasTheStatedMeanRate_AndWaitsForMotion) {
  Bench bench;
  bench.prior.noise[0] = 1e-3f;
  bench.prior.noise[3] = 2e-3f;
  bench.prior.noise[8] = 4e-3f;
  Filter filter;
  filter.Restart(bench.prior);
  for (int s = 0; s < 300; ++s) filter.EndSample(kAll);
  Filter::ReadOut out = Read(filter);
  EXPECT_NEAR(out.sd[0] * out.sd[0], 1 + 0.3, 1e-4);
  EXPECT_NEAR(out.sd[3] * out.sd[3], 1 + 0.6, 1e-4);
  EXPECT_NEAR(out.sd[8] * out.sd[8], 1 + 1.2, 1e-4);
  EXPECT_NEAR(out.sd[1], 1, 1e-6);

  filter.Restart(bench.prior);
  for (int s = 0; s < 300; ++s) filter.EndSample(1);  // only the first joint moves
  out = Read(filter);
  EXPECT_NEAR(out.sd[0] * out.sd[0], 1 + 0.3, 1e-4);
  EXPECT_EQ(out.sd[3], 1.0f);
  EXPECT_NEAR(out.sd[8], 1.0f, 1e-6f);
}

TEST(KalmanFilter, LinkFloor_HoldsDAndCountsItself) {
  Bench bench;
  bench.prior.link_floor = 1e-3f;
  Filter filter;
  filter.Restart(bench.prior);
  Feed(filter, bench.Rows(3000));
  EXPECT_GT(filter.floor_count(), 0u);
  for (int k = Small::kFront; k < Small::kColumns; ++k) EXPECT_GE(filter.factor()[math::UdIndex(k, k)], 1e-3f);
}

TEST(KalmanFilter, GatedOrRefusedRow_LeavesEveryBit) {
  Bench bench;
  bench.prior.gate_sigma = 5.0f;
  Filter filter;
  filter.Restart(bench.prior);
  for (const Row& r : bench.Rows(50)) filter.Update(r.joint, r.front, r.dense, r.y, true);
  const std::vector<unsigned char> before = Bytes(filter);

  Row row = bench.Next(2);
  EXPECT_EQ(filter.Update(2, row.front, row.dense, row.y, false).status, core::Status::kGated);
  EXPECT_EQ(Bytes(filter), before);
  const UpdateReport far = filter.Update(2, row.front, row.dense, row.y + 1000, true);
  EXPECT_EQ(far.status, core::Status::kGated);
  EXPECT_FALSE(far.accepted);
  EXPECT_GT(far.innovation, 900.0f);
  EXPECT_EQ(Bytes(filter), before);
  row.dense[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(filter.Update(2, row.front, row.dense, row.y, true).status, core::Status::kNotFinite);
  EXPECT_EQ(Bytes(filter), before);
  row.dense[5] = 1e9f;
  EXPECT_EQ(filter.Update(2, row.front, row.dense, row.y, true).status, core::Status::kOutOfRange);
  EXPECT_EQ(Bytes(filter), before);
  row.dense[5] = 0.5f;
  EXPECT_EQ(filter.Update(2, row.front, row.dense, std::numeric_limits<float>::infinity(), true).status,
            core::Status::kNotFinite);
  EXPECT_EQ(Bytes(filter), before);
  row.y = static_cast<float>(Full<Small>(row).dot(bench.truth));
  EXPECT_TRUE(filter.Update(2, row.front, row.dense, row.y, true).accepted);
  EXPECT_NE(Bytes(filter), before);
}

TEST(KalmanFilter, InactiveColumn_StaysKnown) {
  Bench bench;
  bench.prior.active[4] = 0;
  Filter filter;
  filter.Restart(bench.prior);
  for (Row r : bench.Rows(100)) {
    if (r.joint == 2) r.front[2] = 0;
    filter.Update(r.joint, r.front, r.dense, r.y, true);
  }
  EXPECT_EQ(Read(filter).x[4], 0.0f);
  EXPECT_EQ(Read(filter).sd[4], 0.0f);
}

}  // namespace
}  // namespace armcal::filter
