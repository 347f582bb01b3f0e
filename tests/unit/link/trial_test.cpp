// link - a table on trial: it is in force and not stored, and the stored one comes back. What the log tells of it. The
// older table, loaded into the stage.
#include <gtest/gtest.h>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
using link::TransactionState;
using test::kSchema;
using test::kTableWords;
using test::MakeTable;
namespace reg = link::reg;
using Words = std::vector<std::uint16_t>;

class Trial : public testing::Test {
 protected:
  Status Do(std::uint32_t command, const Words& words, std::uint32_t connection = 16) {
    const link::TableCommand c{++sequence_, command, kSchema, kTableWords, core::Crc32Words(words.data(), kTableWords)};
    Status status = t().Command(c, connection);
    for (int k = 0; k < 1000 && status == Status::kUnfinished; ++k) {
      t().Step(now_ms_, tick_);
      status = t().Command(c, connection);
    }
    return status;
  }
  void Check(int number) {
    const Words words = MakeTable(number);
    ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
    ASSERT_EQ(t().WriteStaged(0, kTableWords, words.data()), Status::kOk);
    ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  }
  void Run() {
    for (int i = 0; i < 1000 && t().state() == TransactionState::kCommitting; ++i) t().Step(now_ms_, tick_);
  }
  void Flash(int number) {
    Check(number);
    ASSERT_EQ(Do(reg::kSave, MakeTable(number)), Status::kOk);
    Run();
    ASSERT_EQ(t().state(), TransactionState::kActive);
  }
  void Try(int number) {
    Check(number);
    ASSERT_EQ(Do(reg::kTrial, MakeTable(number)), Status::kOk);
    ASSERT_EQ(t().state(), TransactionState::kOnTrial);
  }
  void ExpectInForce(int number) {
    EXPECT_EQ(drive_.active, MakeTable(number));
    EXPECT_EQ(drive_.application.adopted, MakeTable(number));
    EXPECT_EQ(t().active_crc(), core::Crc32Words(MakeTable(number).data(), kTableWords));
    EXPECT_EQ(t().active_words(), kTableWords);
  }
  // What a power cut now would leave.
  Words Stored() {
    table::TableStore store(drive_.flash.storage(), kSchema, kTableWords);
    Words words(kTableWords);
    return core::IsOk(store.Load(words.data())) ? words : Words{};
  }
  void ExpectEnded(Status why) {
    EXPECT_EQ(t().state(), TransactionState::kFailed);
    EXPECT_EQ(t().status(), why);
    ExpectInForce(1);
    EXPECT_EQ(Stored(), MakeTable(1));
    EXPECT_EQ(t().trial_left_s(), 0);
  }
  link::TableTransaction& t() { return drive_.transaction; }

  test::TestDevice drive_;
  std::uint32_t sequence_ = 0, now_ms_ = 0, tick_ = 0;
};

TEST_F(Trial, OfATable_PutsItInForceAndStoresNothing) {
  Flash(1);
  const int operations = drive_.flash.operations();
  Try(2);
  ExpectInForce(2);
  EXPECT_EQ(drive_.flash.operations(), operations);
  EXPECT_EQ(Stored(), MakeTable(1));
  t().Step(now_ms_, tick_);
  EXPECT_FALSE(t().busy());
  EXPECT_EQ(t().trial_left_s(), 600);
}

TEST_F(Trial, Confirmed_IsStoredAndEndsNoMore) {
  Flash(1);
  Try(2);
  EXPECT_EQ(Do(reg::kConfirm, MakeTable(1)), Status::kBadCrc) << "another table than the one on trial";
  ASSERT_EQ(Do(reg::kConfirm, MakeTable(2)), Status::kOk);
  EXPECT_EQ(t().state(), TransactionState::kCommitting);
  Run();
  EXPECT_EQ(t().state(), TransactionState::kActive);
  ExpectInForce(2);
  EXPECT_EQ(Stored(), MakeTable(2));
  drive_.application.doubts.store(Status::kTrackingError);
  now_ms_ += 3600000;
  t().Step(now_ms_, tick_);
  ExpectInForce(2);
}

TEST_F(Trial, AtItsTimeLimit_GivesTheStoredTableBack) {
  Flash(1);
  for (const std::uint16_t limit_s : {std::uint16_t{0}, std::uint16_t{1}, std::uint16_t{90}, std::uint16_t{3600}}) {
    Check(2);
    ASSERT_EQ(t().SetTrialLimit(limit_s), limit_s != 0 ? Status::kOk : Status::kOutOfRange);
    ASSERT_EQ(Do(reg::kTrial, MakeTable(2)), Status::kOk);
    now_ms_ += 1000u * (limit_s != 0 ? limit_s : 600) - 1;
    t().Step(now_ms_, tick_);
    ExpectInForce(2);
    EXPECT_EQ(t().trial_left_s(), 1);
    ++now_ms_;
    t().Step(now_ms_, tick_);
    ExpectEnded(Status::kTimeout);
  }
  EXPECT_EQ(t().SetTrialLimit(0), Status::kOutOfRange);
  EXPECT_EQ(t().SetTrialLimit(3601), Status::kOutOfRange);
}

TEST_F(Trial, InDoubt_GivesTheStoredTableBack) {
  Flash(1);
  for (const Status why : {Status::kTrackingError, Status::kInconsistent}) {
    Try(2);
    t().Step(now_ms_, tick_);
    ExpectInForce(2);
    drive_.application.doubts.store(why);
    t().Step(now_ms_, tick_);
    ExpectEnded(why);
    drive_.application.doubts.store(Status::kOk);
  }
}

TEST_F(Trial, WhoseClientAsksForIt_GivesTheStoredTableBack) {
  Flash(1);
  EXPECT_EQ(Do(reg::kBack, MakeTable(1)), Status::kWrongOrder) << "there is no trial";
  Try(2);
  ASSERT_EQ(Do(reg::kBack, MakeTable(2)), Status::kOk);
  EXPECT_EQ(t().state(), TransactionState::kIdle);
  ExpectInForce(1);
  Flash(3);
  ExpectInForce(3);
}

TEST_F(Trial, WhileOneRuns_NoOtherTableIsTakenOrTouched) {
  Flash(1);
  Flash(5);
  Flash(1);
  Try(2);
  const Words other = MakeTable(3);
  for (const std::uint32_t command : {reg::kOpen, reg::kCheck, reg::kSave, reg::kTrial, reg::kLoad})
    EXPECT_EQ(Do(command, other), Status::kWrongOrder);
  EXPECT_EQ(t().WriteStaged(0, 10, other.data()), Status::kWrongOrder);
  t().Abandon();  // the writer is gone
  now_ms_ += 60000;
  t().Step(now_ms_, tick_);
  ExpectInForce(2);
  ASSERT_EQ(Do(reg::kBack, other), Status::kOk);
  ExpectInForce(1);
}

TEST_F(Trial, WithoutAStoredTable_OrACheck_IsRefused) {
  Check(2);
  EXPECT_EQ(Do(reg::kTrial, MakeTable(2)), Status::kWrongOrder) << "there is nothing to come back to";
  ASSERT_EQ(Do(reg::kSave, MakeTable(2)), Status::kOk);
  Run();
  EXPECT_EQ(Do(reg::kTrial, MakeTable(2)), Status::kWrongOrder) << "not checked";
  Check(3);
  EXPECT_EQ(Do(reg::kTrial, MakeTable(2)), Status::kBadCrc);
  drive_.application.enabled = true;
  EXPECT_EQ(Do(reg::kTrial, MakeTable(3)), Status::kAxisEnabled);
  ExpectInForce(2);
  EXPECT_EQ(Do(reg::kConfirm, MakeTable(2)), Status::kWrongOrder);
}

TEST_F(Trial, WhoseConfirmIsNotStored_GivesTheStoredTableBack) {
  Flash(1);
  Try(2);
  drive_.flash.FailOperation(drive_.flash.operations() + 2);
  ASSERT_EQ(Do(reg::kConfirm, MakeTable(2)), Status::kOk);
  Run();
  ExpectEnded(Status::kStorageFault);
}

// Doubts between confirm and the end of the save: the record is taken back, too. If they come up before its commit word
// is written, a power cut finds the table before at any moment.
TEST_F(Trial, InDoubtWhileItIsStored_GivesTheStoredTableBack) {
  Flash(1);
  int before_commit = 0, after_commit = 0;
  for (int steps = 0; steps < 1000; ++steps) {
    Try(2);
    ASSERT_EQ(Do(reg::kConfirm, MakeTable(2)), Status::kOk);
    for (int k = 0; k < steps; ++k) t().Step(now_ms_, tick_);
    if (t().state() != TransactionState::kCommitting) break;
    const bool whole = Stored() == MakeTable(2);
    ++(whole ? after_commit : before_commit);
    drive_.application.doubts.store(Status::kTrackingError);
    t().Step(now_ms_, tick_);
    EXPECT_EQ(drive_.application.adopted, MakeTable(1)) << "at once";
    while (t().state() == TransactionState::kCommitting) {
      ASSERT_TRUE(whole || Stored() == MakeTable(1)) << steps;
      t().Step(now_ms_, tick_);
    }
    ExpectEnded(Status::kTrackingError);
    drive_.application.doubts.store(Status::kOk);
  }
  EXPECT_GT(before_commit, 12);
  EXPECT_GT(after_commit, 0);
}

TEST_F(Trial, CutAtAnyOperationOfTheConfirm_LeavesTheOldOrTheNewTable) {
  Flash(1);
  int old = 0, fresh = 0;
  for (int cut = 0; cut < 100; ++cut) {
    test::TestDevice drive;
    drive.flash = drive_.flash;
    drive.flash.PowerUp();
    ASSERT_EQ(drive.transaction.Boot(), Status::kOk);
    std::uint32_t sequence = 0;
    const Words words = MakeTable(2);
    const auto command = [&](std::uint32_t what) {
      const link::TableCommand c{++sequence, what, kSchema, kTableWords, core::Crc32Words(words.data(), kTableWords)};
      Status status = drive.transaction.Command(c);
      for (; status == Status::kUnfinished; status = drive.transaction.Command(c)) drive.transaction.Step(0);
      return status;
    };
    ASSERT_EQ(command(reg::kOpen), Status::kOk);
    ASSERT_EQ(drive.transaction.WriteStaged(0, kTableWords, words.data()), Status::kOk);
    ASSERT_EQ(command(reg::kCheck), Status::kOk);
    ASSERT_EQ(command(reg::kTrial), Status::kOk);
    drive.flash.CutAt({cut % 12, static_cast<std::uint32_t>(5 * (cut / 12))});
    ASSERT_EQ(command(reg::kConfirm), Status::kOk);
    for (int k = 0; k < 1000 && drive.transaction.state() == TransactionState::kCommitting; ++k)
      drive.transaction.Step(0);
    drive.flash.PowerUp();
    table::TableStore store(drive.flash.storage(), kSchema, kTableWords);
    Words found(kTableWords);
    ASSERT_EQ(store.Load(found.data()), Status::kOk) << cut;
    EXPECT_TRUE(found == MakeTable(1) || found == MakeTable(2)) << cut;
    old += found == MakeTable(1), fresh += found == MakeTable(2);
  }
  EXPECT_GT(old, 30);
  EXPECT_GT(fresh, 10);
}

TEST_F(Trial, Load_PutsTheOlderTableOnTheStage_AndItIsStoredAnew) {
  EXPECT_EQ(Do(reg::kLoad, MakeTable(1)), Status::kEmpty);
  Flash(1);
  EXPECT_EQ(Do(reg::kLoad, MakeTable(1)), Status::kEmpty) << "there is none before it";
  EXPECT_EQ(t().state(), TransactionState::kActive);
  Flash(2);
  const std::uint32_t stored = drive_.store.sequence();
  ASSERT_EQ(Do(reg::kLoad, MakeTable(2)), Status::kOk);
  EXPECT_EQ(drive_.staged, MakeTable(1));
  EXPECT_EQ(t().state(), TransactionState::kLoading);
  EXPECT_EQ(Do(reg::kSave, MakeTable(1)), Status::kWrongOrder) << "it is checked like any other";
  ASSERT_EQ(Do(reg::kCheck, MakeTable(1)), Status::kOk);
  ASSERT_EQ(Do(reg::kSave, MakeTable(1)), Status::kOk);
  Run();
  ExpectInForce(1);
  EXPECT_EQ(Stored(), MakeTable(1));
  EXPECT_EQ(drive_.store.sequence(), stored + 1);
  ASSERT_EQ(Do(reg::kLoad, MakeTable(1)), Status::kOk);
  EXPECT_EQ(drive_.staged, MakeTable(2));
}

TEST_F(Trial, Load_ThatIsRefused_LeavesTheStageAsItWas) {
  Flash(1);
  Check(2);
  ASSERT_EQ(t().SetTrialLimit(7), Status::kOk);
  EXPECT_EQ(Do(reg::kLoad, MakeTable(2)), Status::kEmpty);
  EXPECT_EQ(t().state(), TransactionState::kChecked);
  EXPECT_EQ(t().trial_limit_s(), 7);
  EXPECT_EQ(drive_.staged, MakeTable(2));
  ASSERT_EQ(Do(reg::kSave, MakeTable(2)), Status::kOk);
  Run();
  ExpectInForce(2);
}

TEST_F(Trial, Load_OfADamagedRecord_IsRefused) {
  Flash(1);
  Flash(2);
  const std::uint32_t older = drive_.store.slot() == 0 ? 2048u : 0u;
  drive_.flash.Fade(older + 100, 3);
  EXPECT_EQ(Do(reg::kLoad, MakeTable(2)), Status::kCorrupt);
  EXPECT_EQ(t().state(), TransactionState::kIdle);
  EXPECT_EQ(Do(reg::kCheck, MakeTable(2)), Status::kWrongOrder);
  ExpectInForce(2);
}

TEST_F(Trial, Load_WhoseWriterIsGone_Ends) {
  Flash(1);
  Flash(2);
  const link::TableCommand load{++sequence_, reg::kLoad, kSchema, kTableWords, 0};
  ASSERT_EQ(t().Command(load), Status::kUnfinished);
  EXPECT_EQ(t().Command({++sequence_, reg::kOpen, kSchema, kTableWords, 0}), Status::kBusy);
  t().Step(now_ms_, tick_);
  t().Abandon();
  EXPECT_EQ(t().state(), TransactionState::kIdle);
  EXPECT_FALSE(t().busy());
  Flash(3);
  ExpectInForce(3);
}

// Each line: tick, connection, command, Status.
TEST_F(Trial, TheLog_TellsWhatBecameOfTheTable) {
  const auto expect = [&](std::uint32_t k, std::uint32_t tick, std::uint32_t connection, std::uint32_t command,
                          Status status) {
    const link::TableEvent& e = t().log().at(k % 32);
    EXPECT_EQ(e.tick, tick) << k;
    EXPECT_EQ(e.connection, connection) << k;
    EXPECT_EQ(e.command, command) << k;
    EXPECT_EQ(e.status, status) << k;
  };
  tick_ = 10;
  t().Step(now_ms_, tick_);
  Flash(1);
  tick_ = 20;
  t().Step(now_ms_, tick_);
  Try(2);
  EXPECT_EQ(Do(reg::kOpen, MakeTable(3), 33), Status::kWrongOrder);
  tick_ = 30;
  drive_.application.doubts.store(Status::kTrackingError);
  t().Step(now_ms_, tick_);
  ASSERT_EQ(Do(reg::kOpen, MakeTable(3), 33), Status::kOk);
  t().Abandon();
  EXPECT_EQ(t().log().count(), 12u);
  expect(0, 0, 0, link::kBootEvent, Status::kBlank);
  expect(1, 10, 16, reg::kOpen, Status::kOk);
  expect(2, 10, 16, reg::kCheck, Status::kOk);
  expect(3, 10, 16, reg::kSave, Status::kOk);
  expect(4, 10, 0, reg::kSave, Status::kOk);
  expect(5, 20, 16, reg::kOpen, Status::kOk);
  expect(6, 20, 16, reg::kCheck, Status::kOk);
  expect(7, 20, 16, reg::kTrial, Status::kOk);
  expect(8, 20, 33, reg::kOpen, Status::kWrongOrder);
  expect(9, 30, 0, reg::kBack, Status::kTrackingError);
  expect(10, 30, 33, reg::kOpen, Status::kOk);
  expect(11, 30, 0, link::kDropEvent, Status::kTimeout);
  for (int k = 0; k < 30; ++k) (void)Do(reg::kSave, MakeTable(1), 48);
  expect(11, 30, 0, link::kDropEvent, Status::kTimeout);
  expect(41, 30, 48, reg::kSave, Status::kWrongOrder);
  // And in registers.
  link::Words<reg::kLogBlock> w;
  std::uint16_t* words = w.data();
  for (std::uint16_t at = 0; at < w.size(); at = static_cast<std::uint16_t>(at + 113))
    ASSERT_EQ(
        drive_.device.map().Read(link::RegisterKind::kInput, static_cast<std::uint16_t>(0x0D00 + at), 113, words + at),
        Status::kOk);
  EXPECT_EQ(w.Get<reg::kLogCount>(), 42u);
  EXPECT_EQ((w.Get<reg::kLogCommand, 11>()), 0x706F7264u);
  EXPECT_EQ((w.Get<reg::kLogStatus, 11>()), 35);
  EXPECT_EQ((w.Get<reg::kLogConnection, 9>()), 48u);
  EXPECT_EQ((w.Get<reg::kLogTick, 31>()), 30u);
}

// The board's switch, asked at each write that changes the drive.
TEST_F(Trial, BehindAKeySwitch_NothingIsWritten) {
  const auto write = [&](std::uint16_t address, const Words& words) {
    return drive_.device.map().Write(address, static_cast<std::uint16_t>(words.size()), words.data());
  };
  const Words key = {0x6B6C, 0x6E75}, open = {0, 1, 0x6E65, 0x706F, 0x5C4E, 0x3A21, kTableWords, 0, 0, 0};
  const auto allowed = [&] {
    std::uint16_t word = 2;
    EXPECT_EQ(drive_.device.map().Read(link::RegisterKind::kInput, 0x007A, 1, &word), Status::kOk);
    return word;
  };
  drive_.estimator.key_switch = false;
  EXPECT_EQ(allowed(), 0);
  EXPECT_EQ(write(0x0040, key), Status::kForbidden);
  drive_.estimator.key_switch = true;
  EXPECT_EQ(allowed(), 1);
  ASSERT_EQ(write(0x0040, key), Status::kOk);
  drive_.estimator.key_switch = false;  // also for the one who writes
  EXPECT_EQ(write(0x0000, open), Status::kForbidden);
  EXPECT_EQ(write(0x1000, {1, 2}), Status::kForbidden);
  EXPECT_EQ(write(0x0048, {60}), Status::kForbidden);
  EXPECT_EQ(write(0x0150, {1}), Status::kForbidden);
  EXPECT_EQ(write(0x0151, {1}), Status::kForbidden);
  EXPECT_TRUE(drive_.estimator.holds.empty() && drive_.estimator.resets.empty());
  EXPECT_EQ(write(0x0140, {2}), Status::kOk) << "a snapshot is read, not written";
  EXPECT_EQ(write(0x0040, {0, 0}), Status::kOk) << "the seat may always be left";
  drive_.estimator.key_switch = true;
  ASSERT_EQ(write(0x0040, key), Status::kOk);
  EXPECT_EQ(write(0x0000, open), Status::kOk);
}

}  // namespace
