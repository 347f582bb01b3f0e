// table - what the store answers and keeps: blank, corrupt, other schema, faults, wear, bit rot.
#include "armcal/table/table_store.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "armcal/core/words.hpp"
#include "tests/unit/table/nor_flash.hpp"
#include "tests/unit/table/tables.hpp"

namespace {

using namespace armcal;
using core::Status;
using table::SlotState;
using table::TableStore;
using test::kSchema;
using test::kWords;
using test::NorFlash;
using test::Table;
using test::Words;

constexpr std::uint32_t kOther = 0x55550000;
const test::Geometry kNor{2, 512, 8, 0xFF};

Status Finish(TableStore& store) {
  Status status;
  int steps = 0;
  while ((status = store.Step()) == Status::kBusy && ++steps < 10000) {
  }
  return status;
}

Status SaveAll(TableStore& store, const Words& words) {
  const Status begun = store.Save(words.data());
  return core::IsOk(begun) ? Finish(store) : begun;
}

// Powers up and loads. Empty unless kOk.
Words Boot(NorFlash& flash, Status expected = Status::kOk, std::uint32_t schema = kSchema) {
  TableStore store(flash.storage(), schema, kWords);
  Words words(kWords);
  EXPECT_EQ(store.Load(words.data()), expected);
  return expected == Status::kOk ? words : Words{};
}

void Prepare(NorFlash& flash, int number, std::uint32_t schema = kSchema) {
  TableStore store(flash.storage(), schema, kWords);
  Words old(kWords);
  static_cast<void>(store.Load(old.data()));
  ASSERT_EQ(SaveAll(store, Table(number)), Status::kOk);
}

TEST(Store, OnBlankStorage_SaysBlank_NotCorrupt) {
  for (const std::uint8_t erased : {std::uint8_t{0xFF}, std::uint8_t{0x00}}) {
    NorFlash flash({2, 512, 4, erased});
    Boot(flash, Status::kBlank);
  }
}

TEST(Store, AfterASave_LoadsItAtTheNextPowerUp) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  EXPECT_EQ(Boot(flash), Table(1));
  Prepare(flash, 2);
  EXPECT_EQ(Boot(flash), Table(2));
  EXPECT_FALSE(flash.misused());
}

TEST(Store, DuringASave_DoesOneStorageOperationAStep) {
  NorFlash flash(kNor);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words = Table(1);
  ASSERT_EQ(store.Save(words.data()), Status::kOk);
  EXPECT_EQ(store.Save(words.data()), Status::kBusy);
  for (int before = flash.operations(); store.Step() == Status::kBusy; before = flash.operations())
    EXPECT_LE(flash.operations() - before, 1);
}

TEST(Store, Copy_GivesTheOlderTable_OrSaysThatItHasFaded) {
  NorFlash flash(kNor);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words(kWords), copy(kWords);
  ASSERT_EQ(store.Load(words.data()), Status::kBlank);
  EXPECT_EQ(store.Copy(copy.data()), Status::kEmpty);
  ASSERT_EQ(SaveAll(store, Table(1)), Status::kOk);
  EXPECT_EQ(store.Copy(copy.data()), Status::kEmpty);
  ASSERT_EQ(SaveAll(store, Table(2)), Status::kOk);
  ASSERT_EQ(store.Copy(copy.data()), Status::kOk);
  EXPECT_EQ(store.Copy(copy.data()), Status::kBusy);
  EXPECT_EQ(store.Save(words.data()), Status::kBusy);
  EXPECT_EQ(Finish(store), Status::kOk);
  EXPECT_EQ(copy, Table(1));
  EXPECT_EQ(store.words_copied(), kWords);
  const std::uint32_t older = store.slot() == 0 ? 512 : 0;
  for (std::uint32_t byte = 0; byte < 20 + 2 * kWords + 4; ++byte) {
    flash.Fade(older + byte, static_cast<int>(byte % 8));
    ASSERT_EQ(store.Copy(copy.data()), Status::kOk);
    EXPECT_EQ(Finish(store), Status::kCorrupt) << byte;
    flash.Fade(older + byte, static_cast<int>(byte % 8));
  }
  ASSERT_EQ(store.Copy(copy.data()), Status::kOk);
  EXPECT_EQ(Finish(store), Status::kOk);
}

TEST(Store, Read_GivesWordsOfAnyWholeRecord) {
  NorFlash flash(kNor);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words(kWords), part(32);
  ASSERT_EQ(store.Load(words.data()), Status::kBlank);
  EXPECT_EQ(store.Read(0, 0, 1, part.data()), Status::kEmpty);
  Prepare(flash, 5, kOther);
  ASSERT_EQ(store.Load(words.data()), Status::kWrongSchema);
  const int slot = store.words_in(0) != 0 ? 0 : 1;
  EXPECT_EQ(store.words_in(slot), kWords);
  EXPECT_EQ(store.words_in(1 - slot), 0u);
  ASSERT_EQ(store.Read(slot, kWords - 32, 32, part.data()), Status::kOk);
  for (std::uint32_t k = 0; k < 32; ++k) EXPECT_EQ(part[k], Table(5)[kWords - 32 + k]);
  EXPECT_EQ(store.Read(slot, kWords - 31, 32, part.data()), Status::kOutOfRange);
  EXPECT_EQ(store.Read(slot, 0, 33, part.data()), Status::kOutOfRange);
  EXPECT_EQ(store.Read(1 - slot, 0, 1, part.data()), Status::kEmpty);
}

TEST(Store, OfManySaves_ErasesOnceASaveAndAlternates) {
  NorFlash flash(kNor);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words(kWords);
  ASSERT_EQ(store.Load(words.data()), Status::kBlank);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(SaveAll(store, Table(i)), Status::kOk);
    ASSERT_EQ(flash.erases(0) + flash.erases(1), i + 1);
    ASSERT_LE(std::abs(flash.erases(0) - flash.erases(1)), 1);
  }
  EXPECT_EQ(store.sequence(), 1000u);
  EXPECT_FALSE(flash.misused());
}

TEST(Store, WithARecordOfAnotherSchema_KeepsItUntilTheNewOneIsSaved) {
  for (const int saves : {1, 2, 3}) {  // the newest lies in slot 0, 1, 0
    NorFlash flash(kNor);
    for (int i = 1; i <= saves; ++i) Prepare(flash, i, kOther);
    TableStore store(flash.storage(), kSchema, kWords);
    Words words(kWords);
    EXPECT_EQ(store.Load(words.data()), Status::kWrongSchema);
    ASSERT_EQ(SaveAll(store, Table(9)), Status::kOk);
    EXPECT_EQ(Boot(flash), Table(9));
    EXPECT_EQ(Boot(flash, Status::kOk, kOther), Table(saves)) << "the newest table of the other schema must survive";
  }
}

TEST(Store, WithBothSlotsSpoilt_SaysCorrupt_AndStillSaves) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  Prepare(flash, 2);
  flash.cells()[30] ^= 1;
  flash.cells()[512 + 30] ^= 1;
  Boot(flash, Status::kCorrupt);
  Prepare(flash, 3);
  EXPECT_EQ(Boot(flash), Table(3));
}

TEST(Store, AfterAnySingleBitError_NeverHandsOutAWrongTable) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  Prepare(flash, 2);  // slot 1 is in force
  const std::uint32_t record = table::RecordBytes(kWords, 8);
  const std::uint32_t body = table::BodyBytes(kWords), commit = table::CommitOffset(kWords, 8);
  for (std::uint32_t bit = 0; bit < 8 * record; ++bit) {
    std::uint8_t& cell = flash.cells()[512 + bit / 8];
    cell ^= static_cast<std::uint8_t>(1u << (bit % 8));
    TableStore store(flash.storage(), kSchema, kWords);
    Words words(kWords);
    ASSERT_EQ(store.Load(words.data()), Status::kOk);
    const bool padding = (bit / 8 >= body && bit / 8 < commit) || bit / 8 >= commit + 4;
    EXPECT_EQ(words, Table(padding ? 2 : 1)) << "bit " << bit;
    if (!padding) {
      EXPECT_EQ(store.slot_state(1), SlotState::kCorrupt) << "bit " << bit;
    }
    cell ^= static_cast<std::uint8_t>(1u << (bit % 8));
  }
}

TEST(Store, WhenAnyOperationFailsOrDoesNothing_KeepsTheTableInForce) {
  int operations = 0;
  {
    NorFlash flash(kNor);
    Prepare(flash, 1);
    operations = flash.operations();
  }
  for (const bool silent : {false, true}) {
    for (int failing = 0; failing < operations; ++failing) {
      NorFlash flash(kNor);
      Prepare(flash, 1);
      Prepare(flash, 2);
      TableStore store(flash.storage(), kSchema, kWords);
      Words words(kWords);
      ASSERT_EQ(store.Load(words.data()), Status::kOk);
      const int operation = flash.operations() + failing;
      silent ? flash.SkipOperation(operation) : flash.FailOperation(operation);
      EXPECT_EQ(SaveAll(store, Table(3)), Status::kStorageFault) << failing << (silent ? " silent" : "");
      EXPECT_EQ(Boot(flash), Table(2));
      EXPECT_EQ(SaveAll(store, Table(4)), Status::kOk) << "a passing fault must not stay";
      EXPECT_EQ(Boot(flash), Table(4));
    }
  }
}

TEST(Store, Revoked_IsAsBeforeTheSave_AlsoOnABusyFlash) {
  for (const test::Geometry& geometry : {kNor, test::Geometry{2, 512, 8, 0xFF, 2, 3}}) {
    NorFlash flash(geometry);
    Prepare(flash, 1);
    TableStore store(flash.storage(), kSchema, kWords);
    Words words(kWords);
    ASSERT_EQ(store.Load(words.data()), Status::kOk);
    EXPECT_EQ(store.Revoke(), Status::kWrongOrder);
    ASSERT_EQ(SaveAll(store, Table(2)), Status::kOk);
    ASSERT_EQ(store.Revoke(), Status::kOk);
    EXPECT_EQ(Finish(store), Status::kOk);
    EXPECT_EQ(store.sequence(), 1u);
    EXPECT_FALSE(flash.misused());
    EXPECT_EQ(Boot(flash), Table(1));
  }
}

// Until the commit word is being written, a cancelled save leaves no record: not for a moment, and not on a busy flash.
TEST(Store, CancelledSave_NeverBecomesWhole) {
  for (const test::Geometry& geometry : {kNor, test::Geometry{2, 512, 8, 0xFF, 2, 3}}) {
    NorFlash whole(geometry);
    Prepare(whole, 1);
    const auto first = whole.operations();
    Prepare(whole, 2);
    const auto each = whole.operations() - first;  // the last one writes the commit word
    int cancelled = 0, completed = 0;
    for (int steps = 0; completed == 0; ++steps) {
      ASSERT_LT(steps, 1000);
      NorFlash flash(geometry);
      Prepare(flash, 1);
      TableStore store(flash.storage(), kSchema, kWords);
      Words words(kWords);
      ASSERT_EQ(store.Load(words.data()), Status::kOk);
      const Words next = Table(2);
      ASSERT_EQ(store.Save(next.data()), Status::kOk);
      for (int k = 0; k < steps; ++k) ASSERT_EQ(store.Step(), Status::kBusy);
      const int left = each - (flash.operations() - first);
      store.Cancel();
      Status status = Status::kBusy;
      bool was_whole = false;
      while (status == Status::kBusy) {
        status = store.Step();
        NorFlash cut = flash;
        cut.PowerUp();
        was_whole |= Boot(cut) == next;
      }
      EXPECT_FALSE(flash.misused()) << steps;
      // A busy flash counts an operation at its end.
      const bool may_be_writing = left == 0 || (left == 1 && geometry.busy_program != 0);
      ASSERT_TRUE(status == Status::kEmpty || (status == Status::kOk && may_be_writing)) << steps;
      if (status == Status::kOk) {
        ++completed;
        EXPECT_EQ(Boot(flash), next);
        continue;
      }
      ++cancelled;
      EXPECT_FALSE(was_whole) << steps;
      EXPECT_FALSE(store.busy());
      EXPECT_EQ(store.sequence(), 1u);
      EXPECT_EQ(Boot(flash), Table(1)) << steps;
      ASSERT_EQ(SaveAll(store, Table(3)), Status::kOk) << "the next save is none the worse for it";
      EXPECT_EQ(Boot(flash), Table(3));
    }
    EXPECT_GT(cancelled, 10);
  }
}

TEST(Store, WithAWrappedSequence_TakesTheNewerOne) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  // Gives the record in slot 0 the sequence 0xFFFFFFFF and the checksum for it.
  std::uint8_t* record = flash.cells().data();
  core::PutBytes32(record + 16, 0xFFFFFFFFu);
  const std::uint32_t covered = table::kHeaderBytes + 2 * kWords;
  std::uint32_t crc = 0xFFFFFFFFu;
  for (std::uint32_t i = 0; i < covered; ++i) {
    crc ^= record[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) ? (crc >> 1) ^ 0xEDB88320u : crc >> 1;
  }
  core::PutBytes32(record + covered, ~crc);
  EXPECT_EQ(Boot(flash), Table(1));
  Prepare(flash, 2);  // gets sequence 0
  EXPECT_EQ(Boot(flash), Table(2));
}

TEST(Store, OnStorageThatIsTooSmallOrOdd_RefusesToSave) {
  for (const test::Geometry g : {test::Geometry{2, 64, 8, 0xFF}, test::Geometry{1, 512, 8, 0xFF},
                                 test::Geometry{2, 512, 128, 0xFF}, test::Geometry{2, 512, 3, 0xFF}}) {
    NorFlash flash(g);
    TableStore store(flash.storage(), kSchema, kWords);
    Words words = Table(1);
    EXPECT_EQ(store.Load(words.data()), Status::kWrongSize);
    EXPECT_EQ(store.Save(words.data()), Status::kWrongSize);
  }
}

TEST(Store, RefusedRecord_IsPassedOver_AndTheNextSaveTakesItsSlot) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  Prepare(flash, 2);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words(kWords);
  ASSERT_EQ(store.Load(words.data()), Status::kOk);
  ASSERT_EQ(words, Table(2));
  const int refused = store.slot();
  ASSERT_EQ(store.LoadOlder(words.data()), Status::kOk);
  EXPECT_EQ(words, Table(1));
  EXPECT_EQ(store.slot_state(refused), SlotState::kRefused);
  EXPECT_EQ(store.fallbacks(), 1u);
  ASSERT_EQ(SaveAll(store, Table(3)), Status::kOk);
  EXPECT_EQ(store.slot(), refused);
  EXPECT_EQ(Boot(flash), Table(3));
}

TEST(Store, WithoutAnOlderRecord_SaysSo) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words(kWords);
  ASSERT_EQ(store.Load(words.data()), Status::kOk);
  EXPECT_EQ(store.LoadOlder(words.data()), Status::kBlank);
  EXPECT_EQ(store.slot(), -1);
  EXPECT_EQ(SaveAll(store, Table(2)), Status::kOk);
  EXPECT_EQ(Boot(flash), Table(2));
}

TEST(Store, DamagedRecord_IsCountedAtPowerUp) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  Prepare(flash, 2);
  TableStore sound(flash.storage(), kSchema, kWords);
  Words words(kWords);
  ASSERT_EQ(sound.Load(words.data()), Status::kOk);
  EXPECT_EQ(sound.fallbacks(), 0u);
  flash.Fade(static_cast<std::uint32_t>(sound.slot()) * 512 + 40, 2);
  TableStore store(flash.storage(), kSchema, kWords);
  ASSERT_EQ(store.Load(words.data()), Status::kOk);
  EXPECT_EQ(words, Table(1));
  EXPECT_EQ(store.fallbacks(), 1u);
}

TEST(Store, WithTwoDamagedRecords_CountsEachOnce_ThoughItReadsThemAgain) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  Prepare(flash, 2);
  for (const std::uint32_t slot : {0u, 1u}) flash.Fade(slot * 512 + 40, 2);
  TableStore store(flash.storage(), kSchema, kWords);
  Words words(kWords);
  ASSERT_EQ(store.Load(words.data()), Status::kCorrupt);
  EXPECT_EQ(store.fallbacks(), 2u);
}

// Every other reading is right, and a load reads the record twice.
TEST(Store, WhoseOnlyRecordReadsWellSometimes_TriesAgainAtPowerUp) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  flash.MakeUnstable(40, 2);
  for (int k = 0; k < 200; ++k) EXPECT_EQ(Boot(flash), Table(1));
}

// A cell of the header: the schema must not be taken from another reading than the checksum.
TEST(Store, WhoseSchemaReadsWellSometimes_NeverSaysThatItIsAnothers) {
  NorFlash flash(kNor);
  Prepare(flash, 1);
  flash.MakeUnstable(9, 3);
  for (int k = 0; k < 200; ++k) EXPECT_EQ(Boot(flash), Table(1));
}

// The record in force has a cell that reads wrong every other time. It passes eight readings in 1 of 256 cases. In all
// others the new record takes its slot, and the older one stays.
TEST(Store, WhoseRecordInForceReadsWellSometimes_KeepsTheOlderOne) {
  constexpr int kCases = 512;
  int kept = 0;
  for (int k = 0; k < kCases; ++k) {
    NorFlash flash(kNor, static_cast<std::uint32_t>(k));
    Prepare(flash, 1);
    TableStore store(flash.storage(), kSchema, kWords);
    Words words(kWords);
    ASSERT_EQ(store.Load(words.data()), Status::kOk);
    ASSERT_EQ(SaveAll(store, Table(2)), Status::kOk);
    flash.MakeUnstable(static_cast<std::uint32_t>(store.slot()) * 512 + 40, 2);
    ASSERT_EQ(SaveAll(store, Table(3)), Status::kOk);
    TableStore after(flash.storage(), kSchema, kWords);
    ASSERT_EQ(after.Load(words.data()), Status::kOk);
    EXPECT_EQ(words, Table(3));
    ASSERT_EQ(after.Copy(words.data()), Status::kOk);
    kept += Finish(after) == Status::kOk && words == Table(1);
  }
  EXPECT_GE(kept, kCases - 12);
}

}  // namespace
