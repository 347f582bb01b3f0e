// link - the registers of learning: what a client may write, and when.
#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
namespace reg = link::reg;

struct Learning : test::TestDevice {
  Status Write(const link::Register& r, std::uint16_t word) { return device.map().Write(r.address, 1, &word); }
  std::uint16_t Read(const link::Register& r) {
    std::uint16_t word = 99;
    EXPECT_EQ(device.map().Read(r.kind, r.address, 1, &word), Status::kOk);
    return word;
  }
  void Unlock() {
    link::Words<reg::kUnlock> key;
    key.Set<reg::kUnlock>(reg::kUnlockKey);
    ASSERT_EQ(device.map().Write(reg::kUnlock.address, key.size(), key.data()), Status::kOk);
  }
};

TEST(Learning, Locked_ReachesNobody) {
  Learning drive;
  EXPECT_EQ(drive.Write(reg::kLearningHold, 1), Status::kLocked);
  EXPECT_EQ(drive.Write(reg::kLearningReset, 1), Status::kLocked);
  EXPECT_TRUE(drive.estimator.holds.empty() && drive.estimator.resets.empty());
}

TEST(Learning, Unlocked_HoldReadsBackAndAResetDoesNot) {
  Learning drive;
  drive.Unlock();
  EXPECT_EQ(drive.Write(reg::kLearningHold, 1), Status::kOk);
  EXPECT_EQ(drive.Read(reg::kLearningHold), 1);
  EXPECT_EQ(drive.Write(reg::kLearningHold, 0), Status::kOk);
  EXPECT_EQ(drive.Read(reg::kLearningHold), 0);
  EXPECT_EQ(drive.estimator.holds, (std::vector<bool>{true, false}));
  EXPECT_EQ(drive.Write(reg::kLearningReset, 1), Status::kOk);
  EXPECT_EQ(drive.Write(reg::kLearningReset, test::kAxes + 1), Status::kOk);
  EXPECT_EQ(drive.estimator.resets, (std::vector<int>{0, test::kAxes}));
  EXPECT_EQ(drive.Read(reg::kLearningReset), 0);
}

TEST(Learning, WhatIsNotThereOrRefused_ChangesNothing) {
  Learning drive;
  drive.Unlock();
  EXPECT_EQ(drive.Write(reg::kLearningHold, 2), Status::kOutOfRange);
  EXPECT_EQ(drive.Write(reg::kLearningReset, 0), Status::kOutOfRange);
  EXPECT_EQ(drive.Write(reg::kLearningReset, test::kAxes + 2), Status::kOutOfRange);
  EXPECT_TRUE(drive.estimator.holds.empty() && drive.estimator.resets.empty());
  drive.estimator.answer = Status::kBusy;
  EXPECT_EQ(drive.Write(reg::kLearningHold, 1), Status::kBusy);
  EXPECT_EQ(drive.Read(reg::kLearningHold), 0);
}

}  // namespace
