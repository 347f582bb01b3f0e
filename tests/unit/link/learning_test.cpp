// link - the registers of learning: what a client may write, and when.
#include "armcal/link/learning_registers.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
namespace reg = link::reg;

struct Learning : test::TestDevice {
  Status Write(std::uint16_t address, std::uint16_t word) { return device.map().Write(address, 1, &word); }
  std::uint16_t Read(std::uint16_t address) {
    std::uint16_t word = 99;
    EXPECT_EQ(device.map().Read(link::RegisterKind::kHolding, address, 1, &word), Status::kOk);
    return word;
  }
  void Unlock() {
    const std::uint16_t key[] = {reg::kUnlockKey >> 16, reg::kUnlockKey & 0xFFFF};
    ASSERT_EQ(device.map().Write(reg::kUnlock, 2, key), Status::kOk);
  }
};

TEST(Learning, Locked_ReachesNobody) {
  Learning drive;
  EXPECT_EQ(drive.Write(reg::kLearningHold, 1), Status::kLocked);
  EXPECT_EQ(drive.Write(reg::kLearningReset, 1), Status::kLocked);
  EXPECT_TRUE(drive.learner.holds.empty() && drive.learner.resets.empty());
}

TEST(Learning, Unlocked_HoldReadsBackAndAResetDoesNot) {
  Learning drive;
  drive.Unlock();
  EXPECT_EQ(drive.Write(reg::kLearningHold, 1), Status::kOk);
  EXPECT_EQ(drive.Read(reg::kLearningHold), 1);
  EXPECT_EQ(drive.Write(reg::kLearningHold, 0), Status::kOk);
  EXPECT_EQ(drive.Read(reg::kLearningHold), 0);
  EXPECT_EQ(drive.learner.holds, (std::vector<bool>{true, false}));
  EXPECT_EQ(drive.Write(reg::kLearningReset, 1), Status::kOk);
  EXPECT_EQ(drive.Write(reg::kLearningReset, test::kAxes + 1), Status::kOk);
  EXPECT_EQ(drive.learner.resets, (std::vector<int>{0, test::kAxes}));
  EXPECT_EQ(drive.Read(reg::kLearningReset), 0);
}

TEST(Learning, WhatIsNotThereOrRefused_ChangesNothing) {
  Learning drive;
  drive.Unlock();
  EXPECT_EQ(drive.Write(reg::kLearningHold, 2), Status::kOutOfRange);
  EXPECT_EQ(drive.Write(reg::kLearningReset, 0), Status::kOutOfRange);
  EXPECT_EQ(drive.Write(reg::kLearningReset, test::kAxes + 2), Status::kOutOfRange);
  EXPECT_TRUE(drive.learner.holds.empty() && drive.learner.resets.empty());
  drive.learner.answer = Status::kBusy;
  EXPECT_EQ(drive.Write(reg::kLearningHold, 1), Status::kBusy);
  EXPECT_EQ(drive.Read(reg::kLearningHold), 0);
}

}  // namespace
