// tests - effects with memory inside the estimator: stepped once a sample, started anew after a gap, waited for.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "armcal/estimator/estimator.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using armcal::test::CountingTwoLink;

class Memory : public testing::Test {
 protected:
  using Filter = filter::ForgettingFilter<CountingTwoLink>;
  struct Row {
    float counter;
    bool used;
  };
  void SetUp() override {
    ASSERT_EQ(host_->Adopt(), core::Status::kOk);
    host_->estimator.SetObserver(
        [](void* context, const Sample& s, const float* tau) { static_cast<Memory*>(context)->See(s, tau); }, this);
  }
  // The counter's part of joint 2's torque: measured at the same sample with the plain model.
  void See(const Sample& s, const float* tau) {
    const auto& p = host_->adopted.committed.p;
    const double plain =
        Regressor<TwoLink>(s).row(1) * host_->b0() - p[3] * static_cast<float>((s.qd[1] > 0) - (s.qd[1] < 0));
    seen_.push_back({static_cast<float>((tau[1] - plain) / p[3]), (s.flags[1] & model::kUsed) != 0});
  }
  void Feed(const Sample& s) { ASSERT_EQ(host_->Feed(s), core::Status::kOk); }

  std::unique_ptr<Host<CountingTwoLink, Filter>> host_ = std::make_unique<Host<CountingTwoLink, Filter>>();
  Motion run_;
  std::vector<Row> seen_;
};

TEST_F(Memory, StepsOnceASampleAndTheRowWaitsUntilReady) {
  for (int k = 0; k < 10; ++k) Feed(run_.Next());
  ASSERT_EQ(seen_.size(), 10u);
  for (int k = 0; k < 10; ++k) {
    EXPECT_NEAR(seen_[k].counter, k, 1e-3) << k;
    EXPECT_EQ(seen_[k].used, k > 3) << k;
  }
}

TEST_F(Memory, AfterAGap_StartsAnew) {
  for (int k = 0; k < 7; ++k) Feed(run_.Next());
  run_.Next();  // lost on the way
  for (int k = 0; k < 6; ++k) Feed(run_.Next());
  ASSERT_EQ(seen_.size(), 13u);
  EXPECT_NEAR(seen_[6].counter, 6, 1e-3);
  EXPECT_NEAR(seen_[7].counter, 0, 1e-3);
  EXPECT_FALSE(seen_[7].used);
  EXPECT_NEAR(seen_[12].counter, 5, 1e-3);
  EXPECT_TRUE(seen_[12].used);
}

TEST_F(Memory, SampleThatIsNotFinite_StartsAnewInsteadOfStayingForEver) {
  for (int k = 0; k < 7; ++k) Feed(run_.Next());
  Sample bad = run_.Next();
  bad.qdd[1] = std::numeric_limits<float>::quiet_NaN();
  Feed(bad);
  Feed(run_.Next());
  ASSERT_EQ(seen_.size(), 9u);
  EXPECT_NEAR(seen_[8].counter, 0, 1e-3);
}

}  // namespace
}  // namespace armcal::estimator
