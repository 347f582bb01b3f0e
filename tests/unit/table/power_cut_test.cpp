// table - the power fails at every byte of every operation, and again during recovery. The table is the old or the new.
#include <gtest/gtest.h>

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
                                         Geometry{2, 512, 8, 0xFF}, Geometry{2, 256, 32, 0xFF},
                                         Geometry{2, 256, 32, 0x00}, Geometry{6, 64, 8, 0xFF},
                                         Geometry{4, 128, 64, 0x00}));

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
