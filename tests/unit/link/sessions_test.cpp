// link - several connections at one drive: who may write, what a refused command leaves, and whose a recording is.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/unit/link/test_device.hpp"

namespace armcal::sessions {
namespace {

using core::Status;
using link::Sessions;
using link::TransactionState;
using test::kTableWords;
using test::MakeTable;
namespace reg = link::reg;
using Words = std::vector<std::uint16_t>;

// A connection, as a transport would make it.
class Connection {
 public:
  explicit Connection(test::TestDevice& drive) : drive_(&drive), session_(drive.device.engine().sessions().Begin()) {}
  void Close() { drive_->device.engine().sessions().End(session_); }
  std::uint32_t session() const { return session_; }

  template <const auto& kBlock>
  link::Words<kBlock> Read() {
    link::Words<kBlock> words;
    const link::Span span = SpanOf(kBlock);
    Ask();
    EXPECT_EQ(drive_->device.map().Read(span.kind, span.first, span.count, words.data()), Status::kOk);
    return words;
  }
  template <const link::Register& kRegister>
  link::ValueOf<kRegister> Value() {
    return Read<kRegister>().template Get<kRegister>();
  }
  template <const auto& kBlock>
  Status Write(const link::Words<kBlock>& w, int trace = 0) {
    Ask();
    return drive_->device.map().Write(SpanOf(kBlock).Of(trace).first, w.size(), w.data());
  }
  template <const link::Register& kRegister>
  Status WriteValue(link::ValueOf<kRegister> value) {
    link::Words<kRegister> w;
    w.template Set<kRegister>(value);
    return Write(w);
  }
  Status Unlock() { return WriteValue<reg::kUnlock>(reg::kUnlockKey); }
  Status Command(std::uint32_t command, const Words& table, std::uint32_t sequence) {
    link::Words<reg::kCommandBlock> w;
    w.Set<reg::kSequence>(sequence);
    w.Set<reg::kCommand>(command);
    w.Set<reg::kCommandSchema>(test::kSchema);
    w.Set<reg::kCommandWords>(kTableWords);
    w.Set<reg::kCommandCrc>(core::Crc32Words(table.data(), table.size()));
    Status status = Write(w);
    for (int k = 0; k < 100 && status == Status::kUnfinished; ++k) {
      drive_->transaction.Step(0);
      status = Write(w);
    }
    return status;
  }
  Status Stage(const Words& words) {
    Ask();
    return drive_->device.map().Write(reg::kStagedTable.address, static_cast<std::uint16_t>(words.size()),
                                      words.data());
  }

 private:
  // The engine says whose request comes; this is one that it does not know, so nothing else happens.
  void Ask() {
    std::uint8_t unknown = 0x64, reply[link::kMaxPdu];
    EXPECT_EQ(drive_->device.engine().Handle(&unknown, 1, reply, session_), 2u);
  }
  test::TestDevice* drive_;
  std::uint32_t session_;
};

class TwoClients : public testing::Test {
 protected:
  void Wait(std::uint32_t ms) { drive_.device.Step(now_ms_ += ms); }
  void Run() {
    for (int k = 0; k < 1000 && drive_.transaction.state() == TransactionState::kCommitting; ++k) Wait(0);
  }
  TransactionState state() const { return drive_.transaction.state(); }

  test::TestDevice drive_;
  std::uint32_t now_ms_ = 0;
  Connection a_{drive_}, b_{drive_};
};

TEST_F(TwoClients, Unlock_IsOfOneConnection) {
  EXPECT_EQ(b_.Value<reg::kWriterSeat>(), 0);
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  EXPECT_EQ(a_.Value<reg::kUnlock>(), 1u);
  EXPECT_EQ(b_.Value<reg::kUnlock>(), 0u);
  EXPECT_EQ(a_.Value<reg::kUnlocked>(), 1);
  EXPECT_EQ(b_.Value<reg::kUnlocked>(), 0);
  EXPECT_EQ(a_.Value<reg::kWriterSeat>(), 1);
  EXPECT_EQ(b_.Value<reg::kWriterSeat>(), 2);
  EXPECT_EQ(b_.Command(reg::kOpen, MakeTable(1), 1), Status::kSeatTaken);
  EXPECT_EQ(b_.Unlock(), Status::kSeatTaken);
  EXPECT_EQ(b_.WriteValue<reg::kLearningHold>(1), Status::kSeatTaken);
  EXPECT_TRUE(drive_.estimator.holds.empty());
  ASSERT_EQ(a_.Command(reg::kOpen, MakeTable(1), 1), Status::kOk);
  EXPECT_EQ(b_.Stage(MakeTable(2)), Status::kSeatTaken);
  EXPECT_EQ(a_.Stage(MakeTable(1)), Status::kOk);
}

// What another one writes to unlock, command or stage while a table is being flashed.
TEST_F(TwoClients, ARefusedCommand_LeavesTheFlashUnderWayAsItIs) {
  const Words table = MakeTable(1);
  const auto meddle = [&] {
    EXPECT_EQ(b_.WriteValue<reg::kUnlock>(0), Status::kLocked);
    EXPECT_EQ(b_.WriteValue<reg::kUnlock>(1234), Status::kLocked);
    EXPECT_EQ(b_.Command(reg::kOpen, MakeTable(2), 77), Status::kSeatTaken);
    EXPECT_EQ(b_.Stage(MakeTable(2)), Status::kSeatTaken);
  };
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  EXPECT_EQ(a_.WriteValue<reg::kUnlock>(1234), Status::kLocked) << "a wrong key is refused";
  EXPECT_EQ(a_.Value<reg::kUnlocked>(), 1) << "and changes nothing";
  meddle();
  ASSERT_EQ(a_.Command(reg::kOpen, table, 1), Status::kOk);
  meddle();
  ASSERT_EQ(a_.Stage(table), Status::kOk);
  meddle();
  ASSERT_EQ(a_.Command(reg::kCheck, table, 2), Status::kOk);
  meddle();
  ASSERT_EQ(a_.Command(reg::kSave, table, 3), Status::kOk);
  meddle();
  Run();
  EXPECT_EQ(state(), TransactionState::kActive);
  EXPECT_EQ(drive_.application.adopted, table);
}

TEST_F(TwoClients, TheSeat_IsFreeWhenItIsGivenUp_AndTheNextWriterBeginsWithOpen) {
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  ASSERT_EQ(a_.Command(reg::kOpen, MakeTable(1), 1), Status::kOk);
  ASSERT_EQ(a_.Stage(MakeTable(1)), Status::kOk);
  ASSERT_EQ(a_.WriteValue<reg::kUnlock>(0), Status::kOk);
  EXPECT_EQ(a_.Value<reg::kUnlocked>(), 0);
  ASSERT_EQ(b_.Unlock(), Status::kOk);
  EXPECT_EQ(state(), TransactionState::kIdle);
  EXPECT_EQ(b_.Stage(MakeTable(2)), Status::kWrongOrder);
  EXPECT_EQ(b_.Command(reg::kCheck, MakeTable(1), 2), Status::kWrongOrder);
  EXPECT_EQ(b_.Command(reg::kOpen, MakeTable(2), 3), Status::kOk);
}

TEST_F(TwoClients, TheSeat_IsFreeWhenItsConnectionCloses) {
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  ASSERT_EQ(a_.Command(reg::kOpen, MakeTable(1), 1), Status::kOk);
  a_.Close();
  EXPECT_EQ(b_.Value<reg::kWriterSeat>(), 0);
  EXPECT_EQ(b_.Command(reg::kOpen, MakeTable(2), 2), Status::kLocked) << "free is not taken";
  ASSERT_EQ(b_.Unlock(), Status::kOk);
  EXPECT_EQ(state(), TransactionState::kIdle);
  Connection again(drive_);  // takes the place of the closed one
  EXPECT_NE(again.session(), a_.session());
  EXPECT_EQ(again.Value<reg::kUnlocked>(), 0);
}

TEST_F(TwoClients, TheStage_IsDroppedWithItsConnection_WithoutAnyOtherClient) {
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  ASSERT_EQ(a_.Command(reg::kOpen, MakeTable(1), 1), Status::kOk);
  a_.Close();
  Wait(1);
  EXPECT_EQ(state(), TransactionState::kIdle);
}

TEST_F(TwoClients, ASilentWriter_KeepsItsSeatForTenSeconds) {
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  Wait(Sessions::kPatience_ms - 1);
  EXPECT_EQ(b_.Unlock(), Status::kSeatTaken);
  EXPECT_EQ(a_.Value<reg::kTick>(), 0u);  // any request counts
  Wait(Sessions::kPatience_ms - 1);
  EXPECT_EQ(b_.Unlock(), Status::kSeatTaken);
  Wait(1);
  EXPECT_EQ(b_.Unlock(), Status::kOk);
  EXPECT_EQ(a_.Command(reg::kOpen, MakeTable(1), 1), Status::kSeatTaken);
}

TEST_F(TwoClients, ASilentWriterThatNobodyReplaces_KeepsItsSeatForAMinute) {
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  Wait(link::Device::kUnlock_ms - 1);
  EXPECT_EQ(a_.Value<reg::kUnlocked>(), 1);
  Wait(1);
  EXPECT_EQ(a_.Value<reg::kUnlocked>(), 0);
}

TEST_F(TwoClients, ACommit_GoesOnWithoutItsConnection_AndTheSaveCanBeAskedForAgain) {
  const Words table = MakeTable(1);
  ASSERT_EQ(a_.Unlock(), Status::kOk);
  ASSERT_EQ(a_.Command(reg::kOpen, table, 1), Status::kOk);
  ASSERT_EQ(a_.Stage(table), Status::kOk);
  ASSERT_EQ(a_.Command(reg::kCheck, table, 2), Status::kOk);
  ASSERT_EQ(a_.Command(reg::kSave, table, 3), Status::kOk);
  a_.Close();
  Wait(1);
  EXPECT_EQ(b_.Command(reg::kSave, table, 3), Status::kOk) << "the same block again";
  EXPECT_EQ(b_.Command(reg::kSave, MakeTable(2), 3), Status::kLocked);
  Run();
  EXPECT_EQ(state(), TransactionState::kActive);
  EXPECT_EQ(drive_.application.adopted, table);
  EXPECT_EQ(drive_.application.adoptions, 1);
}

link::Words<reg::kTraceStartBlock> Recording(std::uint16_t number) {
  link::Words<reg::kTraceStartBlock> w;
  w.Set<reg::kTraceRecording>(number);
  w.Set<reg::kTraceMode>(link::TraceMode::kStreaming);
  w.Set<reg::kTraceDecimation>(std::uint16_t{1});
  w.Set<reg::kTraceChannelMask>(std::uint32_t{3});
  return w;
}

TEST_F(TwoClients, ARecording_BelongsToTheConnectionThatStartedIt) {
  ASSERT_EQ(a_.Write(Recording(1)), Status::kOk);
  const auto produce = [&](std::uint32_t tick) {
    const std::uint16_t record[2] = {1, 2};
    ASSERT_TRUE(drive_.raw.Offer(tick).last);
    EXPECT_EQ(drive_.raw.Push(record, 0), Status::kOk);
  };
  produce(0);
  produce(1);
  EXPECT_EQ(a_.Read<reg::kTracePageBlock>().Get<reg::kTraceCount>(), 2);
  EXPECT_EQ(b_.Write(Recording(2)), Status::kSeatTaken);
  EXPECT_EQ(b_.WriteValue<reg::kTraceAcknowledge>(2), Status::kSeatTaken);
  link::Words<reg::kTraceStartBlock> off = Recording(3);
  off.Set<reg::kTraceMode>(link::TraceMode::kOff);
  EXPECT_EQ(b_.Write(off), Status::kSeatTaken);
  EXPECT_EQ(b_.Read<reg::kTracePageBlock>().Get<reg::kTraceCount>(), 2) << "reading is free";
  EXPECT_EQ(a_.WriteValue<reg::kTraceAcknowledge>(1), Status::kOk);

  a_.Close();  // a client that connects anew goes on with its recording
  EXPECT_EQ(b_.Write(Recording(1)), Status::kOk);
  EXPECT_EQ(b_.Read<reg::kTracePageBlock>().Get<reg::kTraceFirstRecord>(), 1u);
  EXPECT_EQ(b_.WriteValue<reg::kTraceAcknowledge>(2), Status::kOk);
  Connection c(drive_);
  EXPECT_EQ(c.Write(Recording(4)), Status::kSeatTaken);
  Wait(Sessions::kPatience_ms);
  EXPECT_EQ(c.Write(Recording(4)), Status::kOk);
}

TEST(Session, Numbers_AreNeverUsedTwice_AndTheirPlacesAre) {
  Sessions sessions;
  std::vector<std::uint32_t> seen;
  for (int round = 0; round < 100; ++round) {
    std::vector<std::uint32_t> open;
    for (int k = 0; k < Sessions::kMost; ++k) open.push_back(sessions.Begin());
    EXPECT_EQ(sessions.Begin(), 0u) << "there are no more";
    for (const std::uint32_t s : open) {
      EXPECT_TRUE(sessions.IsOpen(s));
      sessions.End(s);
      EXPECT_FALSE(sessions.IsOpen(s));
      seen.push_back(s);
    }
  }
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::unique(seen.begin(), seen.end()), seen.end());
  EXPECT_FALSE(sessions.IsOpen(Sessions::kNobody));
}

}  // namespace
}  // namespace armcal::sessions
