// table - a store on flash that wears out: cells fade, read differently from time to time, and take no erase any more,
// while power fails during saves. ARMCAL_STORE_CASES says how many cases; one case is five power-ups.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "armcal/table/table_store.hpp"
#include "tests/unit/table/nor_flash.hpp"
#include "tests/unit/table/tables.hpp"

namespace {

using namespace armcal;
using core::Status;
using table::TableStore;
using test::Geometry;
using test::kSchema;
using test::kWords;
using test::NorFlash;
using test::Table;
using test::Words;

constexpr int kPowerUps = 5;

// SPEC's record, read bit by bit and without the store's code: whole, and all its cells read well every time.
bool HoldsGoodRecord(NorFlash& flash, const Geometry& g, int slot) {
  const std::uint32_t base = static_cast<std::uint32_t>(slot) * (g.sectors / 2) * g.sector_bytes;
  const std::uint32_t body = 20 + 2 * kWords, commit = (body + 4 + g.unit - 1) / g.unit * g.unit;
  const auto& cells = flash.cells();
  const auto number = [&](std::uint32_t at) {
    return static_cast<std::uint32_t>(cells[base + at]) << 24 | static_cast<std::uint32_t>(cells[base + at + 1]) << 16 |
           static_cast<std::uint32_t>(cells[base + at + 2]) << 8 | cells[base + at + 3];
  };
  std::uint32_t crc = ~0u;
  for (std::uint32_t at = 0; at < body; ++at) {
    crc ^= cells[base + at];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1u)));
  }
  if (number(0) != 0x41524D54 || number(8) != kSchema || number(12) != kWords) return false;
  if (number(body) != ~crc || number(commit) != 0x434D4954) return false;
  for (std::uint32_t at = 0; at < commit + 4; ++at)
    if ((at < body + 4 || at >= commit) && flash.IsUnstable(base + at)) return false;
  return true;
}

struct Tally {
  int power_ups = 0, cuts = 0, failed_saves = 0;
  int mixed = 0;        // something was loaded that nobody saved
  int passed_over = 0;  // nothing was loaded, though a good record lay there
  int lost = 0;         // nothing was loaded, though a good record lay there before the save
  int nothing = 0;      // nothing was loaded, and nothing good was there before the save
  int misused = 0;
};

void RunCase(std::uint32_t seed, Tally& tally) {
  static const Geometry geometries[] = {{2, 256, 1, 0xFF},  {2, 256, 4, 0x00}, {2, 512, 8, 0xFF, 2, 7},
                                        {2, 256, 32, 0xFF}, {6, 64, 8, 0xFF},  {4, 128, 64, 0x00, 1, 1},
                                        {2, 256, 32, 0x00}, {4, 256, 16, 0xFF}};
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  const auto chance = [&] { return std::uniform_real_distribution<double>(0.0, 1.0)(random); };
  const Geometry& g = geometries[below(8)];
  NorFlash flash(g, seed + 1);
  const std::uint32_t slot_bytes = g.sectors / 2 * g.sector_bytes, record = table::RecordBytes(kWords, g.unit);
  if (below(2) == 0) flash.Wear(0.02);
  bool good_before = false;
  for (int number = 1; number <= kPowerUps; ++number) {
    flash.PowerUp();
    ++tally.power_ups;
    const bool good_now = HoldsGoodRecord(flash, g, 0) || HoldsGoodRecord(flash, g, 1);
    TableStore store(flash.storage(), kSchema, kWords);
    Words loaded(kWords);
    if (core::IsOk(store.Load(loaded.data()))) {
      bool known = false;
      for (int k = 1; k < number; ++k) known = known || loaded == Table(k);
      tally.mixed += !known;
    } else {
      tally.passed_over += good_now;
      tally.lost += good_before;
      tally.nothing += !good_now && !good_before;
    }
    // Cells go bad, in one slot or in both, while the drive runs.
    for (std::uint32_t bad = below(4) == 0 ? 2 : below(2); bad > 0; --bad) {
      const std::uint32_t at = below(2) * slot_bytes + below(record);
      const auto bit = static_cast<int>(below(8));
      // A cell that fades reads as erased. The other way would mend what had faded before.
      const bool programmed = ((flash.cells()[at] ^ g.erased) >> bit & 1) != 0;
      if (below(2) != 0) flash.MakeUnstable(at, bit, chance());
      else if (programmed) flash.Fade(at, bit);
    }
    good_before = HoldsGoodRecord(flash, g, 0) || HoldsGoodRecord(flash, g, 1);
    const Words words = Table(number);
    if (below(4) != 0) {  // power fails somewhere in the save, or after it
      flash.CutAt({static_cast<int>(below(2 + (record + 63) / 64 + g.sectors / 2)), below(g.sector_bytes)});
    }
    Status status = store.Save(words.data());
    while (core::IsOk(status) && (status = store.Step()) == Status::kBusy && !flash.dead()) status = Status::kOk;
    tally.cuts += flash.dead();
    tally.failed_saves += !core::IsOk(status) && !flash.dead();
    tally.misused += flash.misused();
  }
}

TEST(WornFlash, Store_NeverMixesTables_AndKeepsWhatIsGood) {
  const char* wanted = std::getenv("ARMCAL_STORE_CASES");
  const int cases = wanted != nullptr ? std::atoi(wanted) : 100000;
  Tally tally;
  for (int k = 0; k < cases; ++k) RunCase(static_cast<std::uint32_t>(k), tally);
  std::printf(
      "%d cases, %d power-ups, %d cuts, %d failed saves: mixed %d, passed over %d, lost %d; nothing good was there "
      "%d\n",
      cases, tally.power_ups, tally.cuts, tally.failed_saves, tally.mixed, tally.passed_over, tally.lost,
      tally.nothing);
  EXPECT_EQ(tally.mixed, 0);
  EXPECT_EQ(tally.passed_over, 0);
  EXPECT_EQ(tally.lost, 0);
  EXPECT_EQ(tally.misused, 0);
  EXPECT_GT(tally.cuts, cases);
  EXPECT_GT(tally.failed_saves, 0);
}

}  // namespace
