// estimator - hold, and reset of a block; the truth is the motion's own.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using core::Status;

template <class Filter>
class HoldAndReset : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(host_->Adopt(), Status::kOk); }
  void Run(int samples) {
    for (int k = 0; k < samples; ++k) ASSERT_EQ(host_->Feed(run_.Next()), Status::kOk);
  }
  Estimates<TwoLink> Now() {
    Estimates<TwoLink> e;
    host_->estimator.RequestReadOut();
    while (host_->estimator.Step()) {
    }
    EXPECT_TRUE(host_->estimator.Take(e));
    return e;
  }
  // Largest distance from the truth over columns [begin, end), in the estimate's own standard deviations.
  double Off(const Estimates<TwoLink>& e, int begin, int end) const {
    double most = 0;
    for (int k = begin; k < end; ++k)
      if (e.sd[k] > 0) most = std::max(most, std::abs(e.value[k] - run_.truth(k)) / e.sd[k]);
    return most;
  }

  std::unique_ptr<Host<TwoLink, Filter>> host_ = std::make_unique<Host<TwoLink, Filter>>();
  Motion run_;
};

using HoldAndResetFilters =
    testing::Types<filter::KalmanFilter<TwoLink>, filter::KalmanFilter<TwoLink, filter::Form::kBlock>,
                   filter::ForgettingFilter<TwoLink>, filter::ModelBank<TwoLink>>;
TYPED_TEST_SUITE(HoldAndReset, HoldAndResetFilters);

TYPED_TEST(HoldAndReset, Hold_KeepsEveryBitOfTheEstimate_AndCountsTheRows) {
  this->Run(500);
  const Estimates<TwoLink> before = this->Now();
  this->host_->estimator.Hold(true);
  this->run_.truth(0) += 5;
  this->Run(500);
  const Estimates<TwoLink> held = this->Now();
  EXPECT_EQ(std::memcmp(held.value, before.value, sizeof held.value), 0);
  EXPECT_EQ(std::memcmp(held.sd, before.sd, sizeof held.sd), 0);
  EXPECT_GT(held.rows_gated[0], before.rows_gated[0] + 400);
  EXPECT_EQ(held.samples, before.samples + 500);
  this->host_->estimator.Hold(false);
  this->Run(500);
  EXPECT_NE(this->Now().value[0], held.value[0]);
}

// A joint that has been taken apart: its friction is another one.
TYPED_TEST(HoldAndReset, AResetJoint_IsFoundAgain_TheOtherOneKeepsWhatIsKnownOfIt) {
  this->Run(4000);
  const Estimates<TwoLink> before = this->Now();
  ASSERT_LT(this->Off(before, 0, kColumns), 5);
  this->run_.truth(0) += 8;
  this->run_.truth(1) -= 2;
  ASSERT_EQ(this->host_->estimator.Reset(0), Status::kOk);
  const Estimates<TwoLink> reset = this->Now();
  EXPECT_GT(reset.sd[0], 10 * before.sd[0]);
  for (int k = 3; k < 5; ++k) EXPECT_LT(reset.sd[k], 1.2 * before.sd[k]) << k;
  this->Run(1000);
  // Without the reset the Kalman forms, whose friction has no process noise here, would be off by dozens.
  EXPECT_LT(this->Off(this->Now(), 0, 5), 5);
}

TYPED_TEST(HoldAndReset, ResetLinks_FollowAnotherPayload_OrTheFormSaysNo) {
  this->Run(4000);
  const Estimates<TwoLink> before = this->Now();
  for (int k = TwoLink::kFront; k < kColumns; ++k) this->run_.truth(k) *= 1.1;
  if (!TypeParam::CanReset(2)) {
    EXPECT_EQ(this->host_->estimator.Reset(2), Status::kOutOfRange);
    EXPECT_EQ(std::memcmp(this->Now().value, before.value, sizeof before.value), 0);
    return;
  }
  ASSERT_EQ(this->host_->estimator.Reset(2), Status::kOk);
  this->Run(2000);
  EXPECT_LT(this->Off(this->Now(), TwoLink::kFront, kColumns), 5);
}

TYPED_TEST(HoldAndReset, ResetOfNoBlock_IsRefused) {
  EXPECT_EQ(this->host_->estimator.Reset(-1), Status::kOutOfRange);
  EXPECT_EQ(this->host_->estimator.Reset(3), Status::kOutOfRange);
}

}  // namespace
}  // namespace armcal::estimator
