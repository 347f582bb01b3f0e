// link - the page of residual statistics holds one snapshot, however it is read.
#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
using link::RegisterKind;
namespace reg = link::reg;

Status Select(test::TestDevice& drive, std::uint16_t joint) {
  return drive.device.map().Write(reg::kResidualSelect.address, 1, &joint);
}

TEST(ResidualPages, BeforeASelection_SayJointZero) {
  test::TestDevice drive;
  std::uint16_t joint = 99;
  ASSERT_EQ(drive.device.map().Read(RegisterKind::kInput, reg::kResidualJoint.address, 1, &joint), Status::kOk);
  EXPECT_EQ(joint, 0);
  EXPECT_EQ(drive.estimator.snapshots_taken, 0);
}

// The values of the test drive change with each snapshot, so a read that took one would show.
TEST(ResidualPages, ReadWordByWord_AreTheSnapshotOfTheSelection) {
  test::TestDevice drive;
  ASSERT_EQ(Select(drive, 5), Status::kOk);
  constexpr int kWords = reg::kResidualHeaderBlock.count + reg::kResidualValuesBlock.count;
  std::vector<std::uint16_t> w(kWords);
  for (int i = 0; i < kWords; ++i)
    ASSERT_EQ(drive.device.map().Read(RegisterKind::kInput, reg::kResidualJoint + i, 1, &w[i]), Status::kOk);
  EXPECT_EQ(w[0], 5);
  EXPECT_EQ(w[1], 1);
  EXPECT_EQ(core::GetU32(&w[2]), 3u);
  EXPECT_EQ(core::GetU32(&w[4]), 4000u);
  EXPECT_EQ(core::GetF32(&w[6]), 0.5f);
  for (int k = 0; k < reg::kResidualValues; ++k)
    ASSERT_EQ(core::GetF32(&w[reg::kResidualHeaderBlock.count + 2 * k]), static_cast<float>(10000 + 4000 + k));
}

TEST(ResidualPages, AJointThatIsNotThere_IsRefusedAndTheSnapshotStays) {
  test::TestDevice drive;
  ASSERT_EQ(Select(drive, 2), Status::kOk);
  EXPECT_EQ(Select(drive, 0), Status::kOutOfRange);
  EXPECT_EQ(Select(drive, test::kAxes + 1), Status::kOutOfRange);
  std::uint16_t header[2], selected;
  ASSERT_EQ(drive.device.map().Read(RegisterKind::kInput, reg::kResidualJoint.address, 2, header), Status::kOk);
  ASSERT_EQ(drive.device.map().Read(RegisterKind::kHolding, reg::kResidualSelect.address, 1, &selected), Status::kOk);
  EXPECT_EQ(header[0], 2);
  EXPECT_EQ(header[1], 1);
  EXPECT_EQ(selected, 2);
}

}  // namespace
