// link - flashing step by step: order, retries, refusals, time-outs and power cuts.
#include "armcal/link/table_transaction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;
using core::Status;
using link::TableCommand;
using link::TransactionState;
using test::kSchema;
using test::kTableWords;
using test::MakeTable;
namespace reg = link::reg;
using Words = std::vector<std::uint16_t>;

class Transaction : public testing::Test {
 protected:
  TableCommand Make(std::uint32_t command, const Words& words) {
    return {++sequence_, command, core::GetU32(words.data()), static_cast<std::uint16_t>(words.size()),
            core::Crc32Words(words.data(), words.size())};
  }
  Status Do(std::uint32_t command, const Words& words) { return Finish(t(), Make(command, words)); }
  // The command, and again until its answer is there.
  Status Finish(link::TableTransaction& transaction, const TableCommand& command) {
    Status status = transaction.Command(command);
    for (int k = 0; k < 100 && status == Status::kUnfinished; ++k) {
      transaction.Step(now_ms_);
      status = transaction.Command(command);
    }
    return status;
  }
  void Stage(const Words& words) {
    for (std::uint16_t at = 0; at < words.size(); at = static_cast<std::uint16_t>(at + 100)) {
      const auto count = static_cast<std::uint16_t>(std::min<std::size_t>(100, words.size() - at));
      ASSERT_EQ(t().WriteStaged(at, count, words.data() + at), Status::kOk);
    }
  }
  void Run() {
    for (int i = 0; i < 1000 && t().state() == TransactionState::kCommitting; ++i) t().Step(now_ms_);
  }
  void Flash(int number) {
    const Words words = MakeTable(number);
    ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
    Stage(words);
    ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
    ASSERT_EQ(Do(reg::kSave, words), Status::kOk);
    Run();
    ASSERT_EQ(t().state(), TransactionState::kActive);
  }
  // The stored, the adopted and the served table are this one.
  void ExpectInForce(int number) {
    EXPECT_EQ(drive_.active, MakeTable(number));
    EXPECT_EQ(drive_.application.adopted, MakeTable(number));
    EXPECT_EQ(Stored(), MakeTable(number));
  }
  Words Stored() {
    table::TableStore store(drive_.flash.storage(), kSchema, kTableWords);
    Words words(kTableWords);
    return core::IsOk(store.Load(words.data())) ? words : Words{};
  }
  link::TableTransaction& t() { return drive_.transaction; }

  test::TestDevice drive_;
  std::uint32_t sequence_ = 100;
  std::uint32_t now_ms_ = 0;
};

TEST_F(Transaction, Flash_OfAGoodTable_IsStoredAdoptedAndServed) {
  EXPECT_EQ(t().table_status(), Status::kBlank);
  Flash(1);
  ExpectInForce(1);
  EXPECT_EQ(t().table_status(), Status::kOk);
  EXPECT_EQ(t().active_crc(), core::Crc32Words(MakeTable(1).data(), kTableWords));
  Flash(2);
  ExpectInForce(2);
}

// The check builds what is adopted later. So each table is checked once, and what is adopted is what was checked last.
TEST_F(Transaction, EachTable_IsCheckedOnce_AndWhatWasCheckedIsAdopted) {
  Flash(1);
  EXPECT_EQ(drive_.application.checks, 1);
  ASSERT_EQ(Do(reg::kOpen, MakeTable(2)), Status::kOk);
  Stage(MakeTable(2));
  ASSERT_EQ(Do(reg::kCheck, MakeTable(2)), Status::kOk) << "and left there";
  Flash(3);
  EXPECT_EQ(drive_.application.checks, 3);
  ExpectInForce(3);
}

TEST_F(Transaction, SecondCheckThatIsRefused_LeavesNothingToSave) {
  Flash(1);
  const Words words = MakeTable(2);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  drive_.application.refuse_check = true;
  EXPECT_EQ(Do(reg::kCheck, words), Status::kUnphysical);
  EXPECT_EQ(Do(reg::kSave, words), Status::kWrongOrder);
  Run();
  ExpectInForce(1);
}

// The answer is held, and what others ask meanwhile is refused. Nothing is checked twice.
TEST_F(Transaction, CheckInSlices_IsAnsweredOnce_WhenTheLastSliceIsDone) {
  drive_.application.slices = 5;
  const Words words = MakeTable(1);
  for (const bool refuse : {true, false}) {
    drive_.application.refuse_check = refuse;
    ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
    Stage(words);
    const TableCommand check = Make(reg::kCheck, words);
    ASSERT_EQ(t().Command(check), Status::kUnfinished);
    EXPECT_TRUE(t().busy());
    int turns = 0;
    for (; t().Command(check) == Status::kUnfinished && turns < 100; ++turns) {
      EXPECT_EQ(t().Command(Make(reg::kSave, words)), Status::kBusy);
      EXPECT_EQ(t().WriteStaged(0, 1, words.data()), Status::kBusy);
      EXPECT_EQ(drive_.application.checks, refuse ? 0 : 1);
      t().Step(now_ms_);
    }
    EXPECT_GE(turns, 5);
    EXPECT_FALSE(t().busy());
    EXPECT_EQ(t().status(), refuse ? Status::kUnphysical : Status::kOk);
    EXPECT_EQ(t().state(), refuse ? TransactionState::kLoading : TransactionState::kChecked);
    EXPECT_EQ(drive_.application.checks, refuse ? 1 : 2);
  }
  ASSERT_EQ(Do(reg::kSave, words), Status::kOk);
  Run();
  ExpectInForce(1);
}

// A stage that changed after a refusal is checked anew, also under the number of the refused command.
TEST_F(Transaction, CheckWhoseWriterIsGone_Ends_AndTheNextOneBeginsAnew) {
  drive_.application.slices = 5;
  const Words words = MakeTable(1);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  const TableCommand check = Make(reg::kCheck, words);
  ASSERT_EQ(t().Command(check), Status::kUnfinished);
  for (int k = 0; k < 8; ++k) t().Step(now_ms_);
  t().Abandon();
  EXPECT_FALSE(t().busy());
  EXPECT_EQ(t().Command(check), Status::kWrongOrder) << "there is no stage";
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Words other = words;
  other[5] = test::kBadPhysics;
  Stage(other);
  const TableCommand again = Make(reg::kCheck, other);
  ASSERT_EQ(Finish(t(), again), Status::kUnphysical);
  EXPECT_EQ(drive_.application.checks, 1) << "only whole checks";
  Stage(other);
  EXPECT_EQ(t().Command(again), Status::kUnfinished);
}

TEST_F(Transaction, Commands_OutOfOrder_AreRefused) {
  const Words words = MakeTable(1);
  EXPECT_EQ(Do(reg::kCheck, words), Status::kWrongOrder);
  EXPECT_EQ(Do(reg::kSave, words), Status::kWrongOrder);
  EXPECT_EQ(t().WriteStaged(0, 2, words.data()), Status::kWrongOrder);
  EXPECT_EQ(Do(0x12345678, words), Status::kOutOfRange);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  EXPECT_EQ(Do(reg::kCheck, words), Status::kWrongOrder) << "nothing staged";
  Stage(words);
  EXPECT_EQ(Do(reg::kSave, words), Status::kWrongOrder) << "not checked";
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  ASSERT_EQ(t().WriteStaged(7, 1, words.data()), Status::kOk);
  EXPECT_EQ(t().state(), TransactionState::kLoading) << "a write after the check voids the check";
  EXPECT_EQ(Do(reg::kSave, words), Status::kWrongOrder);
}

TEST_F(Transaction, WrongTables_AreRefused_AndNothingIsStored) {
  const Words other = MakeTable(1, 0x99999999);
  EXPECT_EQ(Do(reg::kOpen, other), Status::kWrongSchema);
  Words longer = MakeTable(1);
  longer.push_back(0);
  EXPECT_EQ(Do(reg::kOpen, longer), Status::kWrongSize);

  Words words = MakeTable(1);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  words[100] ^= 1;
  EXPECT_EQ(Do(reg::kCheck, words), Status::kBadCrc);
  words[100] ^= 1;
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  words[100] ^= 1;
  EXPECT_EQ(Do(reg::kCheck, words), Status::kBadCrc);
  EXPECT_EQ(t().state(), TransactionState::kLoading);
  EXPECT_EQ(t().refusal().status, Status::kBadCrc);
  words[100] ^= 1;
  EXPECT_EQ(Do(reg::kSave, words), Status::kWrongOrder) << "what an earlier check accepted can no longer be saved";

  Words unphysical = MakeTable(1);
  unphysical[5] = test::kBadPhysics;
  ASSERT_EQ(Do(reg::kOpen, unphysical), Status::kOk);
  Stage(unphysical);
  EXPECT_EQ(Do(reg::kCheck, unphysical), Status::kUnphysical);
  EXPECT_EQ(drive_.flash.operations(), 0);
}

TEST_F(Transaction, Save_WhileAnAxisIsEnabled_IsRefusedBeforeAnythingIsStored) {
  Flash(1);
  const int operations = drive_.flash.operations();
  const Words words = MakeTable(2);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  drive_.application.enabled = true;
  EXPECT_EQ(Do(reg::kSave, words), Status::kAxisEnabled);
  EXPECT_EQ(drive_.flash.operations(), operations);
  ExpectInForce(1);
  drive_.application.enabled = false;
  EXPECT_EQ(Do(reg::kSave, words), Status::kOk) << "the stage is still there";
  Run();
  ExpectInForce(2);
}

TEST_F(Transaction, AxisEnabledDuringTheSave_IsWaitedFor) {
  Flash(1);
  drive_.application.enable_on_save = true;
  const Words words = MakeTable(2);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  ASSERT_EQ(Do(reg::kSave, words), Status::kOk);
  Run();
  EXPECT_EQ(t().state(), TransactionState::kCommitting);
  EXPECT_EQ(drive_.active, MakeTable(1)) << "the old table stays in force";
  EXPECT_EQ(Do(reg::kOpen, words), Status::kBusy);
  EXPECT_EQ(t().WriteStaged(0, 1, words.data()), Status::kBusy);
  drive_.application.enabled = false;
  Run();
  EXPECT_EQ(t().state(), TransactionState::kActive);
  ExpectInForce(2);
}

TEST_F(Transaction, AxisThatStaysEnabled_TakesTheStoredRecordBack) {
  Flash(1);
  drive_.application.enable_on_save = true;
  const Words words = MakeTable(2);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  ASSERT_EQ(Do(reg::kSave, words), Status::kOk);
  Run();
  now_ms_ += link::TableTransaction::kStageTimeout_ms;
  Run();
  EXPECT_EQ(t().state(), TransactionState::kFailed);
  EXPECT_EQ(t().status(), Status::kAxisEnabled);
  ExpectInForce(1);
}

TEST_F(Transaction, AdoptionInSlices_IsCalledUntilItIsDone_AtPowerUpToo) {
  drive_.application.busy = 5;
  Flash(1);
  ExpectInForce(1);
  Words staged(kTableWords), active(kTableWords);
  test::FakeApplication application;
  application.busy = 3;
  table::TableStore store(drive_.flash.storage(), kSchema, kTableWords);
  link::TableTransaction next(application.Functions(), store, kSchema, staged.data(), active.data(), kTableWords);
  EXPECT_EQ(next.Boot(), Status::kBusy);
  EXPECT_EQ(next.Command(Make(reg::kOpen, MakeTable(2))), Status::kBusy);
  for (int i = 0; i < 10; ++i) next.Step(0);
  EXPECT_EQ(next.table_status(), Status::kOk);
  EXPECT_EQ(next.state(), TransactionState::kIdle);
  EXPECT_EQ(active, MakeTable(1));
}

TEST_F(Transaction, StoredTableThatTheApplicationRefuses_LeavesTheDefaultsActive) {
  Words unphysical = MakeTable(1);
  unphysical[5] = test::kBadPhysics;
  ASSERT_EQ(drive_.store.Save(unphysical.data()), Status::kOk);
  while (drive_.store.Step() == Status::kBusy) {
  }
  const Words defaults(kTableWords, 4711);
  Words staged(kTableWords), active = defaults;
  table::TableStore store(drive_.flash.storage(), kSchema, kTableWords);
  link::TableTransaction next(drive_.application.Functions(), store, kSchema, staged.data(), active.data(),
                              kTableWords);
  EXPECT_EQ(next.Boot(), Status::kUnphysical);
  EXPECT_EQ(next.table_status(), Status::kUnphysical);
  EXPECT_EQ(active, defaults);
  EXPECT_EQ(drive_.application.adoptions, 0);
}

TEST_F(Transaction, NewestStoredTableRefused_BootsTheOlderOne_AndTheNextSaveReplacesTheRefusedOne) {
  Flash(1);
  Words unphysical = MakeTable(2);
  unphysical[5] = test::kBadPhysics;
  ASSERT_EQ(drive_.store.Save(unphysical.data()), Status::kOk);
  while (drive_.store.Step() == Status::kBusy) {
  }
  Words staged(kTableWords), active(kTableWords);
  table::TableStore store(drive_.flash.storage(), kSchema, kTableWords);
  test::FakeApplication application;
  link::TableTransaction next(application.Functions(), store, kSchema, staged.data(), active.data(), kTableWords);
  EXPECT_EQ(next.Boot(), Status::kOk);
  EXPECT_EQ(next.table_status(), Status::kOk);
  EXPECT_EQ(active, MakeTable(1));
  EXPECT_EQ(application.adopted, MakeTable(1));
  EXPECT_EQ(store.fallbacks(), 1u);
  const int kept = store.slot();
  const Words third = MakeTable(3);
  ASSERT_EQ(store.Save(third.data()), Status::kOk);
  while (store.Step() == Status::kBusy) {
  }
  EXPECT_EQ(store.slot(), 1 - kept);
}

TEST_F(Transaction, CommandRepeated_HasNoSecondEffect) {
  const Words words = MakeTable(1);
  const TableCommand open = Make(reg::kOpen, words);
  ASSERT_EQ(t().Command(open), Status::kOk);
  Stage(words);
  EXPECT_EQ(t().Command(open), Status::kOk);
  EXPECT_EQ(t().state(), TransactionState::kLoading) << "the stage must survive the repeated open";
  TableCommand forged = open;
  forged.command = reg::kCheck;
  EXPECT_EQ(t().Command(forged), Status::kWrongOrder) << "a used number with other content";
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  const TableCommand save = Make(reg::kSave, words);
  ASSERT_EQ(t().Command(save), Status::kOk);
  EXPECT_EQ(t().Command(save), Status::kOk) << "while committing";
  Run();
  EXPECT_EQ(t().Command(save), Status::kOk) << "after it";
  EXPECT_EQ(t().state(), TransactionState::kActive);
  EXPECT_EQ(drive_.application.adoptions, 1);
  TableCommand zero = open;
  zero.sequence = 0;
  EXPECT_EQ(t().Command(zero), Status::kWrongOrder);
}

TEST_F(Transaction, AbandonedStage_IsDropped) {
  const Words words = MakeTable(1);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  t().Step(link::TableTransaction::kStageTimeout_ms - 1);
  EXPECT_EQ(t().state(), TransactionState::kLoading);
  t().Step(link::TableTransaction::kStageTimeout_ms);
  EXPECT_EQ(t().state(), TransactionState::kIdle);
  EXPECT_EQ(t().status(), Status::kTimeout);
  EXPECT_EQ(Do(reg::kCheck, words), Status::kWrongOrder);
}

TEST_F(Transaction, NewOpen_DropsTheStage) {
  const Words words = MakeTable(1);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  EXPECT_EQ(drive_.staged, Words(kTableWords));
}

TEST_F(Transaction, StorageFault_FailsAndKeepsTheOldTable) {
  Flash(1);
  const Words words = MakeTable(2);
  ASSERT_EQ(Do(reg::kOpen, words), Status::kOk);
  Stage(words);
  ASSERT_EQ(Do(reg::kCheck, words), Status::kOk);
  drive_.flash.FailOperation(drive_.flash.operations() + 2);
  ASSERT_EQ(Do(reg::kSave, words), Status::kOk);
  Run();
  EXPECT_EQ(t().state(), TransactionState::kFailed);
  EXPECT_EQ(t().status(), Status::kStorageFault);
  ExpectInForce(1);
}

TEST_F(Transaction, PowerCutAtAnyOperation_BootsTheOldOrTheNewTable) {
  Flash(1);
  const int operations = drive_.flash.operations();
  for (int cut = 0; cut < operations; ++cut) {
    test::NorFlash flash = drive_.flash;
    flash.PowerUp();
    flash.CutAt({cut, 3});
    {
      table::TableStore store(flash.storage(), kSchema, kTableWords);
      Words staged(kTableWords), active(kTableWords);
      test::FakeApplication application;
      link::TableTransaction first(application.Functions(), store, kSchema, staged.data(), active.data(), kTableWords);
      ASSERT_EQ(first.Boot(), Status::kOk);
      const Words words = MakeTable(2);
      ASSERT_EQ(first.Command(Make(reg::kOpen, words)), Status::kOk);
      ASSERT_EQ(first.WriteStaged(0, kTableWords, words.data()), Status::kOk);
      ASSERT_EQ(Finish(first, Make(reg::kCheck, words)), Status::kOk);
      ASSERT_EQ(first.Command(Make(reg::kSave, words)), Status::kOk);
      for (int i = 0; i < 1000 && !flash.dead(); ++i) first.Step(0);
    }
    flash.PowerUp();
    table::TableStore store(flash.storage(), kSchema, kTableWords);
    Words staged(kTableWords), active(kTableWords);
    test::FakeApplication application;
    link::TableTransaction second(application.Functions(), store, kSchema, staged.data(), active.data(), kTableWords);
    ASSERT_EQ(second.Boot(), Status::kOk);
    EXPECT_TRUE(active == MakeTable(1) || active == MakeTable(2)) << cut;
    EXPECT_EQ(application.adopted, active);
  }
}

// A drive that takes tables of two lengths: flashes a table of `words` and answers how that ended.
struct TwoLengths {
  static constexpr std::uint16_t kShort = 200;

  Words Cut(int number, std::size_t words) {
    Words table = MakeTable(number);
    table.resize(words);
    return table;
  }
  Status Do(std::uint32_t command, const Words& words) {
    const TableCommand c{++sequence, command, kSchema, static_cast<std::uint16_t>(words.size()),
                         core::Crc32Words(words.data(), words.size())};
    Status status = transaction.Command(c);
    for (; status == Status::kUnfinished; status = transaction.Command(c)) transaction.Step(0);
    return status;
  }
  Status Flash(const Words& words) {
    Status status = Do(reg::kOpen, words);
    if (core::IsOk(status)) status = transaction.WriteStaged(0, static_cast<std::uint16_t>(words.size()), words.data());
    if (core::IsOk(status)) status = Do(reg::kCheck, words);
    if (core::IsOk(status)) status = Do(reg::kSave, words);
    for (int k = 0; k < 1000 && transaction.state() == TransactionState::kCommitting; ++k) transaction.Step(0);
    return status;
  }

  explicit TwoLengths(test::NorFlash& flash) : store(flash.storage(), kSchema, kTableWords, kShort) {}

  table::TableStore store;
  test::FakeApplication application;
  Words staged = Words(kTableWords), active = Words(kTableWords);
  link::TableTransaction transaction{application.Functions(), store,       kSchema, staged.data(),
                                     active.data(),           kTableWords, {1, 0}};
  std::uint32_t sequence = 0;
};

TEST(TransactionOfTwoLengths, EitherTable_IsStoredServedAndBootedWithItsOwnLength) {
  test::NorFlash flash{{2, 2048, 8, 0xFF}};
  const auto drive = std::make_unique<TwoLengths>(flash);
  EXPECT_EQ(drive->transaction.Boot(), Status::kBlank);
  for (const std::uint16_t words : {kTableWords, TwoLengths::kShort, TwoLengths::kShort, kTableWords}) {
    const Words table = drive->Cut(words, words);
    ASSERT_EQ(drive->Flash(table), Status::kOk);
    EXPECT_EQ(drive->transaction.state(), TransactionState::kActive);
    EXPECT_EQ(drive->transaction.active_words(), words);
    EXPECT_EQ(drive->application.adopted, table);
    Words served = table;
    served.resize(kTableWords);  // zeros behind a short table
    EXPECT_EQ(drive->active, served);
    EXPECT_EQ(drive->transaction.active_crc(), core::Crc32Words(table.data(), words));
    const auto next = std::make_unique<TwoLengths>(flash);
    ASSERT_EQ(next->transaction.Boot(), Status::kOk);
    EXPECT_EQ(next->application.adopted, table);
    EXPECT_EQ(next->transaction.active_words(), words);
  }
}

TEST(TransactionOfTwoLengths, AnotherLengthThanOpened_IsRefused) {
  test::NorFlash flash{{2, 2048, 8, 0xFF}};
  const auto drive = std::make_unique<TwoLengths>(flash);
  EXPECT_EQ(drive->transaction.Boot(), Status::kBlank);
  const Words shorter = drive->Cut(1, TwoLengths::kShort), longer = MakeTable(1);
  EXPECT_EQ(drive->Do(reg::kOpen, drive->Cut(1, 201)), Status::kWrongSize);
  ASSERT_EQ(drive->Do(reg::kOpen, shorter), Status::kOk);
  EXPECT_EQ(drive->transaction.WriteStaged(101, 100, longer.data()), Status::kWrongSize) << "one word too far";
  ASSERT_EQ(drive->transaction.WriteStaged(0, TwoLengths::kShort, shorter.data()), Status::kOk);
  EXPECT_EQ(drive->Do(reg::kCheck, longer), Status::kWrongSize);
  ASSERT_EQ(drive->Do(reg::kCheck, shorter), Status::kOk);
  EXPECT_EQ(drive->Do(reg::kSave, longer), Status::kWrongSize);
  EXPECT_EQ(drive->Do(reg::kSave, shorter), Status::kOk);
}

// A firmware that knows one length alone neither takes a longer table nor loses its own.
TEST_F(Transaction, ALongerTable_IsRefusedAndTheOldOneStays) {
  Flash(1);
  Words longer = MakeTable(2);
  longer.resize(kTableWords + 52);
  EXPECT_EQ(Do(reg::kOpen, longer), Status::kWrongSize);
  ExpectInForce(1);
}

}  // namespace
