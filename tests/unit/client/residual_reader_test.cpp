// client - tests residual statistics over the wire: each number is in its place, and all are of one snapshot.
#include "host_sim/client/residual_reader.hpp"

#include <gtest/gtest.h>

#include <atomic>

#include "tests/unit/client/test_server.hpp"

namespace {

using namespace armcal;
namespace reg = link::reg;

// The test drive's value k of joint j in snapshot s is 10000 s + 1000 (j - 1) + k.
TEST(ResidualReader, EverySum_IsWhereTheMapSays) {
  test::TestServer server;
  client::DriveClient drive = server.Connect();
  const client::JointResiduals r = client::ReadResiduals(drive, 2);
  EXPECT_EQ(r.joint, 2);
  EXPECT_EQ(r.generation, 3u);
  EXPECT_EQ(r.elapsed_s, 4000u);
  EXPECT_EQ(r.sigma_Nm, 0.5);
  const double first = 11000;
  EXPECT_EQ(r.reference.bin[0][0][0].count, first);
  EXPECT_EQ(r.reference.bin[0][0][0].temperature, first + 7);
  EXPECT_EQ(r.reference.bin[2][1][3].square, first + ((2 * 2 + 1) * 4 + 3) * 8 + 2);
  EXPECT_EQ(r.recent.bin[3][0][1].load, first + 256 + ((3 * 2 + 0) * 4 + 1) * 8 + 5);
  ASSERT_EQ(r.slices.size(), 32u);
  EXPECT_EQ(r.slices[31].start_s, first + 512 + 93);
  EXPECT_EQ(r.slices[31].square, first + 512 + 95);
}

TEST(ResidualReader, AJointThatIsNotThere_IsRefused) {
  test::TestServer server;
  client::DriveClient drive = server.Connect();
  EXPECT_THROW(client::ReadResiduals(drive, 7), client::RefusedError);
}

TEST(ResidualReader, WhenAnotherClientSelectsMeanwhile_ReadsAgainAndNeverMixes) {
  // A page takes a dozen requests. Between them the other client selects joint 1, as often as `others` says.
  std::atomic<int> others{1};
  std::uint32_t seen = 0;
  test::TestServer server([&](test::TestDevice& drive) {
    const std::uint32_t requests = drive.device.map().requests();
    if (requests == seen || requests % 8 != 0 || others == 0) return;
    seen = requests;
    --others;
    const std::uint16_t joint = 1;
    EXPECT_EQ(drive.device.map().Write(reg::kResidualSelect.address, 1, &joint), core::Status::kOk);
  });
  client::DriveClient drive = server.Connect();
  const client::JointResiduals r = client::ReadResiduals(drive, 4);
  EXPECT_EQ(others, 0);
  EXPECT_EQ(r.reference.bin[0][0][0].count,
            33000);  // the third snapshot: this client's, the other's, this client's again
  EXPECT_EQ(r.slices[31].square, 33000 + 512 + 95);
  others = 1000;
  EXPECT_THROW(client::ReadResiduals(drive, 4), client::LinkError);
}

}  // namespace
