// client - tests flashing over the wire: success, every refusal, a drive that lies, a connection cut at any byte.
#include "host_sim/client/table_flash.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/table_backup.hpp"
#include "tests/unit/client/cutting_proxy.hpp"
#include "tests/unit/client/test_server.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace {

using namespace armcal;
using client::FlashTable;
using client::RefusedError;
using core::Status;
using test::MakeTable;
namespace reg = link::reg;
using Words = std::vector<std::uint16_t>;

Status RefusalOf(client::DriveClient& drive, const Words& words) {
  try {
    FlashTable(drive, words);
  } catch (const RefusedError& error) {
    return error.status;
  }
  return Status::kOk;
}

link::Words<reg::kCommandBlock> Open() {
  link::Words<reg::kCommandBlock> w;
  w.Set<reg::kSequence>(std::uint32_t{1});
  w.Set<reg::kCommand>(reg::kOpen);
  w.Set<reg::kCommandSchema>(test::kSchema);
  w.Set<reg::kCommandWords>(test::kTableWords);
  return w;
}

TEST(Flash, OfAGoodTable_IsActiveStoredAndReadBack) {
  test::TestServer server;
  auto drive = server.Connect();
  double progress = 0;
  const client::FlashReport report = FlashTable(drive, MakeTable(1), [&](double share) { progress = share; });
  EXPECT_EQ(progress, 1.0);
  EXPECT_EQ(report.crc, core::Crc32Words(MakeTable(1).data(), test::kTableWords));
  EXPECT_EQ(report.store_sequence, 1u);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(1));
  EXPECT_EQ(FlashTable(drive, MakeTable(2)).store_sequence, 2u);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(2));
  EXPECT_EQ(drive.ReadStatus().table_status, Status::kOk);
}

// Older firmware takes the checksum before its defaults are in place.
TEST(Flash, OfABlankDriveThatTellsAnotherChecksum_Succeeds) {
  test::TestServer server;
  std::ranges::copy(MakeTable(7), server.drive.active.begin());  // the transaction keeps the place
  auto drive = server.Connect();
  ASSERT_NE(drive.ReadStatus().active_crc, core::Crc32Words(MakeTable(7).data(), test::kTableWords));
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(7));
  EXPECT_NO_THROW(FlashTable(drive, MakeTable(1)));
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(1));
  server.drive.active[3] ^= 1;  // a table in force is never believed without its checksum
  EXPECT_THROW(client::ReadActiveTable(drive), client::VerifyError);
}

TEST(Flash, OnTrial_IsInForceAndNotStored_UntilItIsConfirmed) {
  test::TestServer server;
  auto drive = server.Connect();
  FlashTable(drive, MakeTable(1));
  EXPECT_EQ(client::TryTable(drive, MakeTable(2), 30).store_sequence, 1u);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(2));
  EXPECT_EQ(drive.ReadValue<reg::kTrialLeft>(), 30);
  const auto refusal = [](auto call) -> std::string {
    try {
      call();
    } catch (const RefusedError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal([&] { client::Rollback(drive); }).find("a trial runs; end or confirm it first"), std::string::npos);
  client::EndTrial(drive);
  EXPECT_NE(refusal([&] { client::EndTrial(drive); }).find("no table is on trial"), std::string::npos);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(1));
  client::TryTable(drive, MakeTable(3), 30);
  EXPECT_EQ(client::ConfirmTrial(drive).store_sequence, 2u);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(3));
  EXPECT_EQ(client::Rollback(drive).store_sequence, 3u);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(1));
}

TEST(Flash, Refused_SaysWhyAndLeavesTheOldTable) {
  test::TestServer server;
  auto drive = server.Connect();
  FlashTable(drive, MakeTable(1));
  EXPECT_EQ(RefusalOf(drive, MakeTable(2, 0x11112222)), Status::kWrongSchema);
  EXPECT_EQ(RefusalOf(drive, Words(test::kTableWords - 2, 0)), Status::kWrongSchema);
  Words shorter = MakeTable(2);
  shorter.pop_back();
  EXPECT_EQ(RefusalOf(drive, shorter), Status::kWrongSize);
  Words unphysical = MakeTable(2);
  unphysical[5] = test::kBadPhysics;
  EXPECT_EQ(RefusalOf(drive, unphysical), Status::kUnphysical);
  server.drive.application.enabled = true;
  EXPECT_EQ(RefusalOf(drive, MakeTable(2)), Status::kAxisEnabled);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(1));
  EXPECT_EQ(drive.ReadStatus().store_sequence, 1u);
  server.drive.application.enabled = false;
  EXPECT_EQ(RefusalOf(drive, MakeTable(2)), Status::kOk);
}

TEST(Flash, WithAnAxisEnabledDuringTheSave_FailsAndIsTakenBack) {
  std::atomic<test::TestServer*> running{nullptr};
  test::TestServer server([&](test::TestDevice& drive) {
    // as soon as everything is stored, the time runs out in which the drive waits
    if (running != nullptr && drive.store.sequence() == 2) running.load()->Jump(1000);
  });
  auto drive = server.Connect();
  FlashTable(drive, MakeTable(1));
  server.drive.application.enable_on_save = true;
  running = &server;
  EXPECT_EQ(RefusalOf(drive, MakeTable(2)), Status::kAxisEnabled);
  EXPECT_EQ(client::ReadActiveTable(drive), MakeTable(1));
  EXPECT_EQ(drive.ReadStatus().store_sequence, 1u);
}

TEST(Flash, WithAWrongChecksum_IsRefusedAtTheCheck) {
  test::TestServer server;
  auto drive = server.Connect();
  drive.WriteValue<reg::kUnlock>(reg::kUnlockKey);
  link::Words<reg::kCommandBlock> command = Open();
  drive.Write(command);
  const Words part(10, 3);
  drive.Write(reg::kStagedTable + 50, part);
  EXPECT_EQ(drive.ReadHolding(reg::kStagedTable + 50, 10), part);
  command.Set<reg::kSequence>(std::uint32_t{2});
  command.Set<reg::kCommand>(reg::kCheck);
  command.Set<reg::kCommandCrc>(std::uint32_t{0x12345678});
  try {
    drive.Write(command);
    FAIL();
  } catch (const RefusedError& error) {
    EXPECT_EQ(error.status, Status::kBadCrc);
    EXPECT_EQ(error.exception, 4);
  }
}

TEST(Flash, AbandonedHalfWay_TimesOut) {
  test::TestServer server;
  auto drive = server.Connect();
  drive.WriteValue<reg::kUnlock>(reg::kUnlockKey);
  link::Words<reg::kCommandBlock> command = Open();
  drive.Write(command);
  EXPECT_EQ(drive.ReadStatus().transaction_state, link::TransactionState::kOpen);
  server.Jump(link::TableTransaction::kStageTimeout_ms);
  EXPECT_TRUE(test::Await([&] { return drive.ReadStatus().transaction_state == link::TransactionState::kIdle; }));
  EXPECT_EQ(drive.ReadStatus().transaction_status, Status::kTimeout);
}

TEST(Flash, WhenTheDriveReadsBackSomethingElse_IsAVerifyError) {
  test::TestServer server([](test::TestDevice& drive) {
    if (drive.transaction.state() == link::TransactionState::kActive) drive.active[200] = 0xBEEF;  // the planted fault
  });
  auto drive = server.Connect();
  EXPECT_THROW(FlashTable(drive, MakeTable(1)), client::VerifyError);
}

// The drive goes on with the save although the link is lost.
TEST(Flash, WithTheLinkLostAfterTheSave_SaysThatTheTableWasSent) {
  std::atomic<bool> lost{false};
  test::TestServer server([&](test::TestDevice& drive) {
    const link::TransactionState state = drive.transaction.state();
    lost = lost || state == link::TransactionState::kCommitting || state == link::TransactionState::kActive;
  });
  test::LoopbackProxy proxy(server.port(), [&](int from, int to, bool) {
    char bytes[512];
    const ssize_t count = ::recv(from, bytes, sizeof bytes, 0);
    return count > 0 && !lost && ::send(to, bytes, static_cast<std::size_t>(count), MSG_NOSIGNAL) == count;
  });
  client::DriveClient drive("127.0.0.1", proxy.port());
  try {
    FlashTable(drive, MakeTable(1));
    FAIL();
  } catch (const client::SentError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("the table was sent, and it is unknown whether it is in force"), what.npos) << what;
    EXPECT_NE(what.find("armcal verify or armcal info"), what.npos) << what;
  }
  auto direct = server.Connect();
  EXPECT_TRUE(test::Await([&] { return direct.ReadStatus().store_sequence == 1; }));
  EXPECT_EQ(client::ReadActiveTable(direct), MakeTable(1));
}

TEST(Flash, LinkLostBeforeTheSave_IsAPlainLinkError) {
  test::TestServer server;
  auto proxy = std::make_unique<test::CuttingProxy>(server.port());
  client::DriveClient drive("127.0.0.1", proxy->port());
  bool sent = true;
  try {
    FlashTable(drive, MakeTable(1), [&](double) { proxy.reset(); });  // while the words are on their way
  } catch (const client::LinkError& error) {
    sent = dynamic_cast<const client::SentError*>(&error) != nullptr;
  }
  EXPECT_FALSE(sent);
}

TEST(Backup, HoldsItsDrive_AndADamagedHeaderIsRefused) {
  const files::test::TemporaryFolder folder;
  const auto json = client::BackupJson(MakeTable(1), test::kSchema, 77);
  const auto read = [&](const nlohmann::ordered_json& j) {
    return client::ReadBackup(folder.Write("backup.json", j.dump()));
  };
  EXPECT_EQ(read(json).words, MakeTable(1));
  EXPECT_EQ(read(json).serial_number, 77u);
  auto changed = json;
  changed.erase("serial_number"), changed.erase("schema");
  EXPECT_EQ(read(changed).serial_number, std::nullopt) << "written by hand, of no drive";
  changed = json, changed["schema"] = "5C4E3A22";
  EXPECT_THROW(read(changed), io::InputError);
  changed = json, changed["serial_number"] = "77";
  EXPECT_THROW(read(changed), io::InputError);
}

// Two clients at once: one waits for the other, and each ends with its own table having been in force.
TEST(Flash, OfTwoClientsAtOnce_EndsWithBothTablesFlashedOneAfterTheOther) {
  test::TestServer server;
  constexpr int kRounds = 5;
  const auto flash = [&](int first) {
    auto drive = server.Connect();
    for (int k = 0; k < kRounds; ++k) EXPECT_NO_THROW(FlashTable(drive, MakeTable(first + k)));
  };
  std::thread other(flash, 100);
  flash(200);
  other.join();
  EXPECT_EQ(server.drive.application.adoptions, 2 * kRounds);
}

// A check that is refused says which word, what it holds and what would have been accepted.
TEST(Flash, RefusedForOneWord_NamesIt) {
  test::TestServer server;
  auto drive = server.Connect();
  Words unphysical = MakeTable(2);
  unphysical[5] = test::kBadPhysics;
  try {
    FlashTable(drive, unphysical);
    FAIL();
  } catch (const RefusedError& error) {
    EXPECT_NE(std::string(error.what()).find("word 5 of the table is 1"), std::string::npos) << error.what();
  }
}

// The connection is cut once, after every possible number of reply bytes. The client connects again and finishes, and
// each table is adopted exactly once.
TEST(Flash, WithTheConnectionCutAtAnyByte_EndsWithTheNewTable) {
  test::TestServer server;
  test::CuttingProxy proxy(server.port());
  std::size_t total = 0;
  {
    client::DriveClient drive("127.0.0.1", proxy.port());
    FlashTable(drive, MakeTable(0));
    total = proxy.forwarded();
  }
  int flashes = 1;
  for (std::size_t cut = 0; cut < total; cut += cut < 100 ? 1 : 23) {
    proxy.CutAfter(cut);
    client::DriveClient drive("127.0.0.1", proxy.port());
    ASSERT_NO_THROW(FlashTable(drive, MakeTable(++flashes))) << "cut after " << cut << " of " << total;
    ASSERT_EQ(client::ReadActiveTable(drive), MakeTable(flashes));
    ASSERT_EQ(server.drive.application.adoptions, flashes);
  }
}

}  // namespace
