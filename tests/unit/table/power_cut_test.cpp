// table - the power fails at every byte of every operation, and again during recovery. The table is the old or the new.
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "armcal/table/table_store.hpp"
#include "tests/unit/table/nor_flash.hpp"
#include "tests/unit/table/tables.hpp"

namespace {

using namespace armcal;
using core::Status;
using table::TableStore;
using test::Cut;
using test::Geometry;
using test::kSchema;
using test::kWords;
using test::NorFlash;
using test::Table;
using test::Words;

// Powers up, loads, and tries to save `number`. Returns what was loaded; empty if there was nothing.
Words BootAndSave(NorFlash& flash, int number) {
  TableStore store(flash.storage(), kSchema, kWords);
  Words loaded(kWords);
  if (!core::IsOk(store.Load(loaded.data()))) loaded.clear();
  const Words words = Table(number);
  if (!core::IsOk(store.Save(words.data()))) return loaded;
  while (store.Step() == Status::kBusy && !flash.dead()) {
  }
  return loaded;
}

Words PowerUpAndLoad(NorFlash& flash) {
  flash.PowerUp();
  TableStore store(flash.storage(), kSchema, kWords);
  Words loaded(kWords);
  if (!core::IsOk(store.Load(loaded.data()))) loaded.clear();
  return loaded;
}

// Every place where a save of this geometry can be cut: before and after each operation, and at every byte of it. An
// erase that is cut leaves a part of the sector erased. For erases a coarser grid of bytes is enough.
std::vector<Cut> AllCuts(const Geometry& g) {
  NorFlash flash(g);
  BootAndSave(flash, 1);
  std::vector<Cut> cuts;
  for (std::size_t op = 0; op < flash.lengths().size(); ++op) {
    const std::uint32_t length = flash.lengths()[op];
    const std::uint32_t step = length > 64 ? 13 : 1;
    for (std::uint32_t bytes = 0; bytes <= length; bytes += step) cuts.push_back({static_cast<int>(op), bytes});
    cuts.push_back({static_cast<int>(op), length});
  }
  return cuts;
}

// The record in force and the new one have different lengths, which take one sector or two.
TEST(PowerCutOfTwoLengths, LeavesTheOldOrTheNewTable_WithItsOwnLength) {
  constexpr std::uint32_t kLong = 200;
  const Geometry g{4, 256, 8, 0xFF};
  const auto table = [](int number, std::uint32_t words) {
    Words all(words);
    for (std::size_t i = 0; i < words; ++i) all[i] = static_cast<std::uint16_t>(number + 7 * i);
    return all;
  };
  // Boots, tries to save `words`, and answers what it has booted.
  const auto boot = [](NorFlash& flash, const Words& words) {
    TableStore store(flash.storage(), kSchema, kLong, kWords);
    Words loaded(kLong);
    const bool good = core::IsOk(store.Load(loaded.data()));
    loaded.resize(good ? store.words_in_force() : 0);
    if (!words.empty() && core::IsOk(store.Save(words.data(), static_cast<std::uint32_t>(words.size()))))
      while (store.Step() == Status::kBusy && !flash.dead()) {
      }
    return loaded;
  };
  int cuts = 0;
  for (const bool grows : {true, false}) {
    const Words before = table(1, grows ? kWords : kLong), after = table(2, grows ? kLong : kWords);
    NorFlash start(g);
    boot(start, table(3, kLong));
    boot(start, before);
    start.PowerUp();
    NorFlash whole = start;
    boot(whole, after);
    for (int operation = 0; operation < whole.operations(); ++operation)
      for (const std::uint32_t bytes : {0u, 3u, 8u, 20u, 63u, 128u, 255u}) {
        NorFlash flash = start;
        flash.CutAt({operation, bytes});
        EXPECT_EQ(boot(flash, after), before);
        flash.PowerUp();
        const Words found = boot(flash, after);
        EXPECT_TRUE(found == before || found == after) << operation << ", " << bytes;
        EXPECT_EQ(boot(flash, {}), after) << "the next save must succeed";
        EXPECT_FALSE(flash.misused());
        ++cuts;
      }
  }
  EXPECT_GT(cuts, 100);
}

class PowerCut : public testing::TestWithParam<Geometry> {};

// `tables`: how many saves come before the one that is cut. 0: it is the first one.
void CutOnce(const Geometry& g, int tables) {
  for (const Cut& cut : AllCuts(g)) {
    NorFlash flash(g);
    for (int i = 1; i <= tables; ++i) BootAndSave(flash, i);
    flash.PowerUp();
    flash.CutAt(cut);
    BootAndSave(flash, tables + 1);
    const Words found = PowerUpAndLoad(flash);
    const Words before = tables == 0 ? Words{} : Table(tables);
    ASSERT_TRUE(found == before || found == Table(tables + 1))
        << "operation " << cut.operation << " byte " << cut.bytes;
    BootAndSave(flash, 9);
    ASSERT_EQ(PowerUpAndLoad(flash), Table(9)) << "the store must recover";
    ASSERT_FALSE(flash.misused());
  }
}

TEST_P(PowerCut, Store_AfterCutAtAnyWrite_LoadsOldOrNew) { CutOnce(GetParam(), 2); }
TEST_P(PowerCut, Store_AfterCutOfTheFirstSave_LoadsNothingOrNew) { CutOnce(GetParam(), 0); }
TEST_P(PowerCut, Store_AfterCutOfTheSecondSave_LoadsOldOrNew) { CutOnce(GetParam(), 1); }

TEST_P(PowerCut, Store_AfterASecondCutDuringRecovery_LoadsOldOrNew) {
  const std::vector<Cut> cuts = AllCuts(GetParam());
  for (std::size_t a = 0; a < cuts.size(); a += 5) {
    for (std::size_t b = a % 7; b < cuts.size(); b += 7) {
      NorFlash flash(GetParam());
      BootAndSave(flash, 1);
      BootAndSave(flash, 2);
      flash.PowerUp();
      flash.CutAt(cuts[a]);
      BootAndSave(flash, 3);
      const Words middle = PowerUpAndLoad(flash);
      flash.CutAt(cuts[b]);
      BootAndSave(flash, 4);
      const Words found = PowerUpAndLoad(flash);
      ASSERT_TRUE(found == middle || found == Table(4)) << a << " then " << b;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Geometries, PowerCut,
                         testing::Values(Geometry{2, 256, 1, 0xFF}, Geometry{2, 256, 4, 0x00},
                                         Geometry{2, 512, 8, 0xFF}, Geometry{2, 512, 8, 0xFF, 3, 5},
                                         Geometry{2, 256, 32, 0xFF}, Geometry{2, 256, 32, 0x00},
                                         Geometry{6, 64, 8, 0xFF}, Geometry{4, 128, 64, 0x00}));

// A store that has loaded table 2 while table 1 lies in the other slot. Then cells go bad.
struct LoadedStore {
  NorFlash flash;
  std::unique_ptr<TableStore> store;
  std::uint32_t slot_bytes;

  explicit LoadedStore(const Geometry& g) : flash(g), slot_bytes(g.sectors / 2 * g.sector_bytes) {
    BootAndSave(flash, 1);
    BootAndSave(flash, 2);
    flash.PowerUp();
    store = std::make_unique<TableStore>(flash.storage(), kSchema, kWords);
    Words loaded(kWords);
    EXPECT_EQ(store->Load(loaded.data()), Status::kOk);
    EXPECT_EQ(loaded, Table(2));
  }
  std::uint32_t Base(int slot) const { return static_cast<std::uint32_t>(slot) * slot_bytes; }
  // Saves until done or cut.
  Status Save(int number) {
    const Words words = Table(number);
    Status status = store->Save(words.data());
    if (!core::IsOk(status)) return status;
    while ((status = store->Step()) == Status::kBusy && !flash.dead()) {
    }
    return status;
  }
};

// One faded bit anywhere in the record in force, and then a save that is cut anywhere: the older table or the new one.
TEST_P(PowerCut, Store_WhoseRecordInForceFaded_KeepsTheOlderOneUntilTheNewOneIsThere) {
  const std::uint32_t bytes = table::RecordBytes(kWords, GetParam().unit);
  const std::vector<Cut> cuts = AllCuts(GetParam());
  std::size_t next = 0;
  for (std::uint32_t byte = 0; byte < bytes; byte += 3, next += 11) {
    LoadedStore whole(GetParam());
    const std::uint32_t at = whole.Base(whole.store->slot()) + byte;
    if (byte >= table::BodyBytes(kWords) && byte < table::CommitOffset(kWords, GetParam().unit)) continue;  // unused
    if (byte >= table::CommitOffset(kWords, GetParam().unit) + 4) continue;
    whole.flash.Fade(at, 3);
    ASSERT_EQ(whole.Save(3), Status::kOk) << byte;
    EXPECT_EQ(whole.store->fallbacks(), 1u) << byte;
    EXPECT_EQ(PowerUpAndLoad(whole.flash), Table(3));
    ASSERT_FALSE(whole.flash.misused());
    for (int k = 0; k < 5; ++k) {
      LoadedStore cut(GetParam());
      cut.flash.Fade(at, 3);
      cut.flash.PowerUp();
      cut.flash.CutAt(cuts[(next + 17 * k) % cuts.size()]);
      static_cast<void>(cut.Save(3));
      const Words found = PowerUpAndLoad(cut.flash);
      // Table 2: the erase that was cut has turned the faded bit back.
      ASSERT_TRUE(found == Table(1) || found == Table(2) || found == Table(3))
          << "byte " << byte << " cut " << (next + 17 * k) % cuts.size();
    }
  }
}

// If the older record has faded, too, the one in force is left where it is: another reading of it may succeed.
TEST_P(PowerCut, Store_WhoseRecordsBothFaded_WritesOverTheOlderOne) {
  LoadedStore loaded(GetParam());
  const int slot = loaded.store->slot();
  loaded.flash.Fade(loaded.Base(0) + 30, 1);
  loaded.flash.Fade(loaded.Base(1) + 30, 1);
  ASSERT_EQ(loaded.Save(3), Status::kOk);
  EXPECT_EQ(loaded.store->slot(), 1 - slot);
  EXPECT_EQ(PowerUpAndLoad(loaded.flash), Table(3));
}

// Cells of one slot fade or read as they like, and the save is cut: never a mixture, and never nothing while the other
// slot holds a record that reads well. An unstable cell can pass all eight readings before an erase; but then it also
// passes one of the readings at power-up.
TEST_P(PowerCut, Store_WithBadCellsInOneSlot_LoadsAWholeTable) {
  std::mt19937 random(12);
  const std::uint32_t bytes = table::BodyBytes(kWords);
  const std::vector<Cut> cuts = AllCuts(GetParam());
  for (int k = 0; k < 600; ++k) {
    LoadedStore loaded(GetParam());
    const int slot = static_cast<int>(random() % 2);
    const bool fades = random() % 2 != 0;
    for (auto cells = 1 + random() % 3; cells > 0; --cells) {
      const std::uint32_t at = loaded.Base(slot) + static_cast<std::uint32_t>(random() % bytes);
      if (fades) loaded.flash.Fade(at, static_cast<int>(random() % 8));
      else loaded.flash.MakeUnstable(at, static_cast<int>(random() % 8));
    }
    loaded.flash.PowerUp();
    loaded.flash.CutAt(cuts[random() % cuts.size()]);
    static_cast<void>(loaded.Save(3));
    const Words found = PowerUpAndLoad(loaded.flash);
    ASSERT_FALSE(found.empty()) << "lost";
    ASSERT_TRUE(found == Table(1) || found == Table(2) || found == Table(3)) << "a mixture";
  }
}

// The oracle must be able to fail. A store that wrote the commit word before the payload would hand out a mixture.
TEST(PowerCutOracle, OfARecordWhosePayloadWasTornAfterTheCommit_SeesIt) {
  NorFlash flash({2, 256, 4, 0xFF});
  BootAndSave(flash, 1);
  BootAndSave(flash, 2);
  flash.cells()[256 + 40] ^= 0x10;  // a byte that is half written, with a valid commit word
  const Words found = PowerUpAndLoad(flash);
  EXPECT_EQ(found, Table(1)) << "the checksum, not the commit word alone, must decide";
}

}  // namespace
