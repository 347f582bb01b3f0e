// client - tests our client against our server: every function, and every refusal with its reason.
#include "host_sim/client/drive_client.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "tests/unit/client/cutting_proxy.hpp"
#include "tests/unit/client/test_server.hpp"

namespace {

using namespace armcal;
using client::RefusedError;
using core::Status;
namespace reg = link::reg;
using Words = std::vector<std::uint16_t>;

// The status with which a call is refused; kOk if it is not refused.
Status RefusalOf(const std::function<void()>& call, int exception) {
  try {
    call();
  } catch (const RefusedError& error) {
    EXPECT_EQ(error.exception, exception) << error.what();
    return error.status;
  }
  return Status::kOk;
}

TEST(DriveClient, Identity_IsReadAndItsProbesChecked) {
  test::TestServer server;
  auto drive = server.Connect();
  const client::Identity id = drive.ReadIdentity();
  EXPECT_EQ(id.schema, test::kSchema);
  EXPECT_EQ(id.layout_crc, link::kLayoutCrc);
  EXPECT_EQ(id.axes, test::kAxes);
  EXPECT_EQ(id.columns, test::kColumns);
  EXPECT_EQ(id.table_words, test::kTableWords);
  EXPECT_EQ(id.serial_number, 77u);
  EXPECT_EQ(id.tick_rate_Hz, 1000u);
  EXPECT_EQ(id.sample_ticks, 8);
  EXPECT_EQ(drive.ReadValue<reg::kProbeFloat>(), 123456.789f);
  EXPECT_EQ(drive.ReadValue<reg::kProbeU32>(), 0x12345678u);
}

TEST(DriveClient, Registers_LongerThanARequest_AreSplit) {
  test::TestServer server;
  auto drive = server.Connect();
  const std::vector<float> estimate = drive.ReadFloats(reg::kEstimateA, test::kColumns);
  for (int i = 0; i < test::kColumns; ++i)
    EXPECT_EQ(estimate[static_cast<std::size_t>(i)], 0.5f * static_cast<float>(i));
  EXPECT_TRUE(std::isnan(drive.ReadFloats(reg::kDeviationB, 1)[0]));
  EXPECT_EQ(drive.ReadHolding(reg::kActiveTable.address, test::kTableWords), Words(test::kTableWords));
}

TEST(DriveClient, Scratch_WrittenByEveryFunction_ReadsBack) {
  test::TestServer server;
  auto drive = server.Connect();
  Words words(reg::kScratchWords);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = static_cast<std::uint16_t>(0xF000 + i);
  drive.Write(reg::kScratch.address, words);
  drive.WriteSingle(reg::kScratch + 3, 0x1234);
  words[3] = 0x1234;
  EXPECT_EQ(drive.Read(SpanOf(reg::kScratch)), words);
  drive.Write(reg::kScratchU32.address, Words{0xDEAD, 0xBEEF});
  EXPECT_EQ(drive.ReadHolding(reg::kScratchU32.address, 2), (Words{0xDEAD, 0xBEEF}));
}

TEST(DriveClient, Refusals_CarryTheExceptionAndTheDrivesOwnReason) {
  test::TestServer server;
  auto drive = server.Connect();
  const Words two(2, 1), nan = {0x7FC0, 0};
  EXPECT_EQ(RefusalOf([&] { drive.ReadInput(0x30, 1); }, 2), Status::kBadAddress);
  EXPECT_EQ(RefusalOf([&] { drive.Write(reg::kActiveTable.address, two); }, 4), Status::kReadOnly);
  EXPECT_EQ(RefusalOf([&] { drive.Write(reg::kStagedTable.address, two); }, 4), Status::kLocked);
  EXPECT_EQ(RefusalOf([&] { drive.WriteSingle(reg::kScratchFloat.address, 1); }, 3), Status::kWrongSize);
  EXPECT_EQ(RefusalOf([&] { drive.Write(reg::kScratchU32 + 1, two); }, 3), Status::kWrongSize);
  EXPECT_EQ(RefusalOf([&] { drive.Write(reg::kScratchFloat.address, nan); }, 3), Status::kNotFinite);
  EXPECT_EQ(RefusalOf([&] { drive.Write(reg::kCommandBlock.first, two); }, 3), Status::kWrongSize);
  EXPECT_EQ(RefusalOf([&] { drive.WriteValue<reg::kUnlock>(1234); }, 4), Status::kLocked);
  try {
    drive.ReadInput(0x30, 1);
    FAIL();
  } catch (const RefusedError& error) {
    EXPECT_NE(std::string(error.what()).find("no such register"), std::string::npos) << error.what();
  }
}

TEST(DriveClient, Unlock_HoldsForAMinuteAfterTheLastUse) {
  test::TestServer server;
  auto drive = server.Connect();
  drive.WriteValue<reg::kUnlock>(reg::kUnlockKey);
  EXPECT_TRUE(drive.ReadStatus().unlocked);
  EXPECT_EQ(drive.ReadValue<reg::kUnlock>(), 1u) << "the key itself is never read back";
  server.Jump(link::Device::kUnlock_ms);
  auto again = server.Connect();  // the idle connection is closed at that time, too
  EXPECT_FALSE(again.ReadStatus().unlocked);
}

TEST(DriveClient, WithoutAServer_SaysSo) {
  int port = 0;
  {
    test::TestServer server;
    port = server.port();
  }
  EXPECT_THROW(client::DriveClient("127.0.0.1", port), client::LinkError);
}

TEST(DriveClient, AHostThatNobodyKnows_IsNotCalledARefusal) {
  try {
    client::DriveClient("no-such-host.invalid", 502);
    FAIL();
  } catch (const client::LinkError& error) {
    EXPECT_EQ(std::string(error.what()).rfind("no-such-host.invalid: cannot find this host: ", 0), 0u) << error.what();
  }
}

TEST(DriveClient, AfterTheServerClosedTheConnection_ConnectsAnew) {
  test::TestServer server;
  auto drive = server.Connect();
  EXPECT_EQ(drive.ReadValue<reg::kProbeU32>(), 0x12345678u);
  ASSERT_TRUE(test::Await([&] {
    server.Jump(1000);
    return server.connections() == 0;
  }));
  EXPECT_EQ(drive.ReadValue<reg::kProbeU32>(), 0x12345678u);
}

// A drive that restarts refuses connections for a while. The client tries again, as on a serial line.
TEST(DriveClient, WhenALinkThatWasUpIsRefused_TriesAgain) {
  test::TestServer server;
  auto proxy = std::make_unique<test::CuttingProxy>(server.port());
  client::DriveClient drive("127.0.0.1", proxy->port());
  EXPECT_EQ(drive.ReadValue<reg::kProbeU32>(), 0x12345678u);
  proxy.reset();
  try {
    (void)drive.ReadValue<reg::kProbeU32>();
    FAIL();
  } catch (const client::LinkError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("cannot connect"), what.npos) << what;
    EXPECT_NE(what.find("(tried "), what.npos) << what;
  }
}

// Runs the line that README and SPEC show, with the program that they name.
TEST(Mbpoll, FloatProbe_ReadsAsDocumented) {
  if (std::system("command -v mbpoll > /dev/null 2>&1") != 0) GTEST_SKIP() << "mbpoll is not installed";
  test::TestServer server;
  const std::string command =
      "mbpoll -m tcp -a 1 -0 -B -t 3:float -r 12 -c 1 -1 -p " + std::to_string(server.port()) + " 127.0.0.1";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string output;
  for (char part[256]; fgets(part, sizeof part, pipe) != nullptr;) output += part;
  EXPECT_EQ(pclose(pipe), 0);
  EXPECT_NE(output.find("123457"), std::string::npos) << output;
}

}  // namespace
