// filter - the Kalman form against dense double algebra.
#include "armcal/filter/kalman_filter.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

using SmallKalman = KalmanFilter<Small>;

template <class Any>
class EitherForm : public testing::Test {};
using Forms = testing::Types<KalmanFilter<Small>, KalmanFilter<Small, Form::kBlock>>;
TYPED_TEST_SUITE(EitherForm, Forms);

template <class Any>
void Feed(Any& filter, const std::vector<Row>& rows) {
  for (std::size_t at = 0; at < rows.size(); at += Small::kJoints) {
    (void)TakeRows(filter, &rows[at]);
    for (int j = 0; j < Small::kJoints; ++j) EXPECT_TRUE(filter.report(j).accepted);
    filter.EndSample(kAll);
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

TYPED_TEST(EitherForm, WithoutNoise_IsTheBatchSolution) {
  Bench bench;
  bench.size = 3;
  const std::vector<Row> rows = bench.Rows(2000);
  TypeParam filter;
  filter.Restart(bench.prior);
  Feed(filter, rows);
  const Posterior oracle = SolveBatch(bench.prior, rows);
  const typename TypeParam::ReadOut out = Read(filter);
  EXPECT_LT(Distance<Small>(out.x, oracle), 0.01);  // float32: 6e-8 of 1, sd about 5e-3
  for (int k = 0; k < Small::kColumns; ++k) EXPECT_NEAR(out.sd[k] / oracle.sd(k), 1, 1e-3);
}

TYPED_TEST(EitherForm, EachReport_IsTheTextbookInnovationAndVariance) {
  Bench bench;
  TypeParam filter;
  filter.Restart(bench.prior);
  Textbook textbook(bench.prior);
  // Whole samples, and rows by themselves.
  const std::vector<Row> rows = bench.Rows(40);
  for (std::size_t at = 0; at < rows.size(); ++at) {
    const Row& r = rows[at];
    if (at >= 60) (void)filter.Update(r.joint, r.front, r.dense, r.y, true);
    else if (r.joint == 0) (void)TakeRows(filter, &r);
    const UpdateReport got = filter.report(r.joint);
    const UpdateReport expected = textbook.Update(Full<Small>(r), r.y, Vector::Zero(Small::kColumns));
    EXPECT_NEAR(got.innovation, expected.innovation, 2e-5);
    EXPECT_NEAR(got.variance / expected.variance, 1, 1e-4);
  }
}

template <class Any>
void Reset(Any& filter, int block) {
  filter.BeginReset(block);
  for (int credit = 8; !filter.StepReset(credit); credit = 8) {
  }
}

TYPED_TEST(EitherForm, Reset_AddsThePriorsVarianceToItsBlockAndNothingElse) {
  for (int block = 0; TypeParam::CanReset(block); ++block) {
    Bench bench;
    TypeParam filter;
    filter.Restart(bench.prior);
    Textbook textbook(bench.prior);
    for (const Row& r : bench.Rows(40)) {
      (void)filter.Update(r.joint, r.front, r.dense, r.y, true);
      (void)textbook.Update(Full<Small>(r), r.y, Vector::Zero(Small::kColumns));
    }
    const typename TypeParam::ReadOut before = Read(filter);
    Reset(filter, block);
    const bool joint = block < Small::kJoints;
    for (int k = joint ? Small::kFrontBegin[block] : Small::kFront;
         k < (joint ? Small::kFrontBegin[block + 1] : Small::kColumns); ++k)
      textbook.p(k, k) += 1;
    const typename TypeParam::ReadOut after = Read(filter);
    for (int k = 0; k < Small::kColumns; ++k) {
      EXPECT_EQ(after.x[k], before.x[k]);
      EXPECT_NEAR(after.sd[k] / std::sqrt(textbook.p(k, k)), 1, 1e-3) << "block " << block << ", column " << k;
    }
    for (const Row& r : bench.Rows(20)) {  // covariances, too
      const Vector h = Full<Small>(r);
      const UpdateReport report = TypeParam(filter).Update(r.joint, r.front, r.dense, r.y, true);
      EXPECT_NEAR(report.variance / (1 + h.dot(textbook.p * h)), 1, 1e-3);
    }
  }
  EXPECT_FALSE(TypeParam::CanReset(-1));
  EXPECT_FALSE(TypeParam::CanReset(Small::kJoints + 1));
}

TEST(KalmanFilter, ConsideredColumns_CountAndDoNotMove) {
  Bench bench;
  for (const int k : {1, 6}) {
    bench.prior.considered[k] = true;
    bench.prior.any_considered = true;
  }
  Vector considered = Vector::Zero(Small::kColumns);
  considered(1) = considered(6) = 1;
  SmallKalman filter;
  filter.Restart(bench.prior);
  Textbook textbook(bench.prior);
  for (const Row& r : bench.Rows(300)) {
    if (r.joint == 0) (void)TakeRows(filter, &r);
    textbook.Update(Full<Small>(r), r.y, considered);
  }
  const SmallKalman::ReadOut out = Read(filter);
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
  SmallKalman filter;
  filter.Restart(bench.prior);
  for (int s = 0; s < 300; ++s) filter.EndSample(kAll);
  SmallKalman::ReadOut out = Read(filter);
  // Two samples have passed since the turn of column 0, and one since that of column 8.
  EXPECT_NEAR(out.sd[0] * out.sd[0], 1 + 0.298, 1e-4);
  EXPECT_NEAR(out.sd[3] * out.sd[3], 1 + 0.6, 1e-4);
  EXPECT_NEAR(out.sd[8] * out.sd[8], 1 + 1.196, 1e-4);
  EXPECT_NEAR(out.sd[1], 1, 1e-6);

  filter.Restart(bench.prior);
  for (int s = 0; s < 300; ++s) filter.EndSample(1);  // only the first joint moves
  out = Read(filter);
  EXPECT_NEAR(out.sd[0] * out.sd[0], 1 + 0.298, 1e-4);
  EXPECT_EQ(out.sd[3], 1.0f);
  EXPECT_NEAR(out.sd[8], 1.0f, 1e-6f);

  // All joints move in every second sample, or in every third one, whichever column has its turn then.
  for (const int every : {2, 3}) {
    filter.Restart(bench.prior);
    for (int s = 0; s < 300; ++s) filter.EndSample(s % every == 0 ? kAll : 2u);
    out = Read(filter);
    for (const int k : {0, 3}) {
      const double samples = 300.0 / every, noise = bench.prior.noise[k];
      EXPECT_NEAR(out.sd[k] * out.sd[k], 1 + samples * noise, 1.01 * noise) << k << ", every " << every;
    }
  }
}

TYPED_TEST(EitherForm, LinkFloor_HoldsDAndCountsItself) {
  Bench bench;
  bench.prior.link_floor = 1e-3f;
  TypeParam filter;
  filter.Restart(bench.prior);
  Feed(filter, bench.Rows(3000));
  EXPECT_GT(filter.floor_count(), 0u);
  for (int k = Small::kFront; k < Small::kColumns; ++k)
    EXPECT_GE(filter.estimate().d(TypeParam::Columns::kAt.position[k]), 1e-3f);
}

TYPED_TEST(EitherForm, GatedOrRefusedRow_LeavesEveryBit) {
  Bench bench;
  TypeParam filter;
  filter.Restart(bench.prior);
  for (const Row& r : bench.Rows(50)) filter.Update(r.joint, r.front, r.dense, r.y, true);
  const std::vector<unsigned char> before = EstimateBytes(filter.estimate());

  Row row = bench.Next(2);
  EXPECT_EQ(filter.Update(2, row.front, row.dense, row.y, false).status, core::Status::kGated);
  EXPECT_EQ(EstimateBytes(filter.estimate()), before);
  row.dense[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(filter.Update(2, row.front, row.dense, row.y, true).status, core::Status::kNotFinite);
  EXPECT_EQ(EstimateBytes(filter.estimate()), before);
  row.dense[5] = 1e9f;
  EXPECT_EQ(filter.Update(2, row.front, row.dense, row.y, true).status, core::Status::kOutOfRange);
  EXPECT_EQ(EstimateBytes(filter.estimate()), before);
  row.dense[5] = 0.5f;
  EXPECT_EQ(filter.Update(2, row.front, row.dense, std::numeric_limits<float>::infinity(), true).status,
            core::Status::kNotFinite);
  EXPECT_EQ(EstimateBytes(filter.estimate()), before);
  row.y = static_cast<float>(Full<Small>(row).dot(bench.truth));
  EXPECT_TRUE(filter.Update(2, row.front, row.dense, row.y, true).accepted);
  EXPECT_NE(EstimateBytes(filter.estimate()), before);
}

TYPED_TEST(EitherForm, InactiveColumn_StaysKnown) {
  Bench bench;
  bench.prior.active[4] = 0;
  TypeParam filter;
  filter.Restart(bench.prior);
  for (Row r : bench.Rows(100)) {
    if (r.joint == 2) r.front[2] = 0;
    filter.Update(r.joint, r.front, r.dense, r.y, true);
  }
  EXPECT_EQ(Read(filter).x[4], 0.0f);
  EXPECT_EQ(Read(filter).sd[4], 0.0f);
}

TYPED_TEST(EitherForm, FrontNoise_IsTheTextbooksInTurn) {
  Bench bench;
  const int noisy[3] = {0, 1, 4};
  for (const int k : noisy) bench.prior.noise[k] = 1e-3f * static_cast<float>(k + 1);
  TypeParam filter;
  filter.Restart(bench.prior);
  Textbook textbook(bench.prior);
  int samples = 0, last[3] = {};  // of each column's turn
  for (const Row& r : bench.Rows(300)) {
    if (r.joint == 0) (void)TakeRows(filter, &r);
    const UpdateReport got = filter.report(r.joint);
    const UpdateReport expected = textbook.Update(Full<Small>(r), r.y, Vector::Zero(Small::kColumns));
    EXPECT_NEAR(got.innovation, expected.innovation, 1e-4);
    EXPECT_NEAR(got.variance / expected.variance, 1, 1e-4);
    if (r.joint < Small::kJoints - 1) continue;
    // In the order of the factor: joint 0's columns, then joint 2's.
    const int turn = samples++ % 3, k = noisy[turn];
    textbook.p(k, k) += (samples - last[turn]) * static_cast<double>(bench.prior.noise[k]);
    last[turn] = samples;
    filter.EndSample(kAll);
  }
}

TYPED_TEST(EitherForm, AnySlices_GiveTheSameBits) {
  for (const bool considered : {false, true}) {
    Bench bench;
    for (int k = 0; k < Small::kFront; ++k) bench.prior.noise[k] = 1e-4f;
    bench.prior.considered[2] = bench.prior.any_considered = considered;
    if (!TypeParam::Suits(bench.prior)) continue;
    TypeParam whole, sliced;
    whole.Restart(bench.prior);
    sliced.Restart(bench.prior);
    int slices = 0;
    const std::vector<Row> rows = bench.Rows(300);
    for (std::size_t at = 0; at < rows.size(); at += Small::kJoints) {
      (void)TakeRows(whole, &rows[at]);
      slices += TakeRows(sliced, &rows[at], 17);
      for (int j = 0; j < Small::kJoints; ++j) {
        EXPECT_EQ(sliced.report(j).innovation, whole.report(j).innovation);
        EXPECT_EQ(sliced.report(j).variance, whole.report(j).variance);
        EXPECT_EQ(sliced.report(j).accepted, whole.report(j).accepted);
      }
      whole.EndSample(kAll);
      sliced.BeginEnd(kAll);
      for (int credit = 0; (credit += 17, !sliced.StepEnd(credit));) ++slices;
    }
    EXPECT_GT(slices, 1000);
    EXPECT_EQ(EstimateBytes(whole.estimate()), EstimateBytes(sliced.estimate()));
  }
}

TEST(KalmanFilter, BlockForm_IsTheDenseOneInLessRoom_AndSaysWhatItCannotHold) {
  using Block = KalmanFilter<Small, Form::kBlock>;
  Bench bench;
  for (int k = 0; k < Small::kFront; ++k) bench.prior.noise[k] = 1e-4f;
  SmallKalman dense;
  Block block;
  dense.Restart(bench.prior);
  block.Restart(bench.prior);
  const std::vector<Row> rows = bench.Rows(1000);
  Feed(dense, rows);
  Feed(block, rows);
  const auto a = Read(dense);
  const auto b = Read(block);
  for (int k = 0; k < Small::kColumns; ++k) {
    EXPECT_NEAR((a.x[k] - b.x[k]) / a.sd[k], 0, 0.01) << k;  // sums in another order
    EXPECT_NEAR(a.sd[k] / b.sd[k], 1, 1e-4) << k;
  }
  EXPECT_LT(sizeof block, sizeof dense);
  EXPECT_TRUE(Block::Suits(bench.prior));
  bench.prior.noise[Small::kFront] = 1e-6f;
  EXPECT_FALSE(Block::Suits(bench.prior));
  EXPECT_TRUE(SmallKalman::Suits(bench.prior));
  bench.prior.noise[Small::kFront] = 0;
  bench.prior.considered[1] = true;
  EXPECT_FALSE(Block::Suits(bench.prior));
}

}  // namespace
}  // namespace armcal::filter
