// end-to-end tests - sends a running drive requests that no honest client sends. It refuses them and goes on.
#include <gtest/gtest.h>
#include <algorithm>

#include <thread>
#include <vector>

#include "armcal/core/words.hpp"
#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/table_flash.hpp"
#include "host_sim/client/vendor_registers.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kJoints = 6;
constexpr std::uint32_t kPoints = 20;

// One request with `points` points from `first` on; every position is `position_rad`.
core::Status WritePoints(client::DriveClient& drive, std::uint32_t first, int points, float position_rad) {
  std::vector<std::uint16_t> words(2 + 2 * kJoints * points);
  core::PutU32(words.data(), first);
  for (std::size_t k = 2; k < words.size(); k += 2) core::PutF32(&words[k], position_rad);
  try {
    drive.Write(client::kPlayerPoints, words);
    return core::Status::kOk;
  } catch (const client::RefusedError& e) {
    return e.status;
  }
}

std::uint32_t PointsLoaded(client::DriveClient& drive) {
  return core::GetU32(drive.ReadInput(client::kPlayerStatus, client::kPlayerStatusCount).data() + 2);
}

// The number of the first point and the count of points wrap around when they are added.
TEST(PlayerPoints, BeyondTheTrajectory_AreRefusedWhateverTheirNumber) {
  const RunningDrive running(FreshFolder("player_points"));
  client::DriveClient drive("127.0.0.1", running.port());
  const std::uint32_t beyond[] = {0xFFFFFFFFu, 0xFFFFFFFEu, 0xFFFFFFFFu - kPoints, 0x80000000u, 0x2AAAAAABu, kPoints};
  for (const std::uint32_t first : beyond)
    EXPECT_EQ(WritePoints(drive, first, 1, 1.0f), core::Status::kOutOfRange) << first << " before any setup";
  std::uint16_t setup[4];
  core::PutU32(setup, kPoints);
  core::PutU32(setup + 2, 1000);
  drive.Write(client::kPlayerSetup, setup);
  for (const std::uint32_t first : beyond)
    for (const int points : {1, 2, 4})
      EXPECT_EQ(WritePoints(drive, first, points, 1.0f), core::Status::kOutOfRange) << first << " + " << points;
  EXPECT_EQ(WritePoints(drive, kPoints - 1, 2, 1.0f), core::Status::kOutOfRange);
  EXPECT_EQ(PointsLoaded(drive), 0u);
  EXPECT_EQ(WritePoints(drive, kPoints - 2, 2, 0.5f), core::Status::kOk);
  EXPECT_EQ(PointsLoaded(drive), 2u);
}

// Tables that no tool of ours would send, past the tool. The example arm has 6 joints; parameters begin at word 64.
class HostileTables : public testing::Test {
 protected:
  using Words = std::vector<std::uint16_t>;
  static constexpr int kFrictionOfJoint1 = 64 + 8 * 66;  // Fc1, behind 11 parameters of each link

  core::Status Flash(const Words& words) {
    try {
      client::FlashTable(drive_, words);
      return core::Status::kOk;
    } catch (const client::RefusedError& e) {
      return e.status;
    }
  }
  core::Status FlashWith(int word, float value) {
    Words words = good_;
    core::PutF32(&words[word], value);
    return Flash(words);
  }
  core::Status FlashWithWord(int word, std::uint16_t value) {
    Words words = good_;
    words[word] = value;
    return Flash(words);
  }

  RunningDrive running_{FreshFolder("hostile_tables")};
  client::DriveClient drive_{"127.0.0.1", running_.port()};
  Words good_ = client::ReadActiveTable(drive_);
};

TEST_F(HostileTables, AreRefused_AndTheTableInForceStays) {
  using core::Status;
  ASSERT_EQ(Flash(good_), Status::kOk);
  for (int joint = 0; joint < kJoints; ++joint) {
    const int word = 16 + 8 * joint;
    EXPECT_EQ(FlashWith(word, 1e-30f), Status::kBeyondCeiling) << "noise of joint " << joint + 1;
    EXPECT_EQ(FlashWith(word + 2, 1e-30f), Status::kBeyondCeiling) << "v_min of joint " << joint + 1;
    EXPECT_EQ(FlashWith(word + 4, 1e30f), Status::kBeyondCeiling) << "torque limit of joint " << joint + 1;
    EXPECT_EQ(FlashWith(word + 6, 1e9f), Status::kBeyondCeiling) << "torque scale of joint " << joint + 1;
  }
  for (const float friction : {-1e6f, 5000.0f})
    EXPECT_EQ(FlashWith(kFrictionOfJoint1, friction), Status::kBeyondCeiling) << friction;
  for (const float friction : {-1000.0f, -80.0f})
    EXPECT_EQ(FlashWith(kFrictionOfJoint1, friction), Status::kFeedsEnergy) << friction;
  EXPECT_EQ(FlashWith(64, 1e30f), Status::kBeyondCeiling) << "mass of link 1";
  EXPECT_EQ(FlashWith(8, 1e-30f), Status::kBeyondCeiling) << "forgetting";
  EXPECT_EQ(FlashWithWord(5, 0xFFFE), Status::kOutOfRange) << "reserved flags";
  EXPECT_EQ(FlashWithWord(64 + 7, 0xFFFF), Status::kOutOfRange) << "reserved word";
  Words fade = good_;
  fade[6] = fade[7] = 0xFFFF;
  EXPECT_EQ(Flash(fade), Status::kBeyondCeiling) << "a cross-fade of 49 days";
  EXPECT_EQ(client::ReadActiveTable(drive_), good_);
  const client::DriveStatus status = drive_.ReadStatus();
  EXPECT_EQ(status.table_status, Status::kOk);
  EXPECT_EQ(status.store_sequence, 1u);
}

// The flag lets a table come into force while axes are enabled. This drive does not allow that.
TEST_F(HostileTables, ThatAreBumpless_AreNotAdoptedWhileAxesAreEnabled) {
  ASSERT_EQ(Flash(good_), core::Status::kOk);
  drive_.WriteSingle(client::kPlayerCommand, static_cast<std::uint16_t>(client::PlayerCommand::kEnable));
  for (int k = 0; k < 20000 && drive_.ReadStatus().enabled_axes == 0; ++k) std::this_thread::yield();
  ASSERT_NE(drive_.ReadStatus().enabled_axes, 0u);
  Words words = good_;
  for (const int fade_ms : {0, 500, 60000}) {
    words[5] = 1, words[7] = static_cast<std::uint16_t>(fade_ms);
    EXPECT_EQ(Flash(words), core::Status::kForbidden) << fade_ms;
  }
  EXPECT_EQ(client::ReadActiveTable(drive_), good_);
}

// The tick of a real drive goes on after the motion, and a record of it always waits.
TEST(RealTime, ARecordingOfATrajectory_EndsWithTheMotion) {
  const fs::path folder = FreshFolder("real_time");
  const RunningDrive running(folder, "none", {"--real-time"});
  const std::string path = (folder / "path.csv").string(), log = (folder / "log.csv").string();
  ASSERT_EQ(Tool({"excite", "--robot", "er20_like", "--purpose", "test", "--search-seconds", "2", "--out", path}).code,
            0);
  const Outcome o =
      Tool({"record", "--robot", "er20_like", "--connect", running.address(), "--trajectory", path, "--out", log});
  EXPECT_EQ(o.code, 0) << o.err;
  const std::string rows = ReadText(log);
  EXPECT_GT(std::count(rows.begin(), rows.end(), '\n'), 100);
}

}  // namespace
}  // namespace armcal::tests
