// end-to-end tests - sends a running drive requests that no honest client sends. It refuses them and goes on.
#include <gtest/gtest.h>

#include <vector>

#include "armcal/core/words.hpp"
#include "host_sim/client/drive_client.hpp"
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

}  // namespace
}  // namespace armcal::tests
