// mps2 - PSRAM that plays NOR flash.
#include "port/mps2/psram_storage.hpp"

#include "port/mps2/flash_guard.hpp"
#include "port/mps2/tick_clock.hpp"

extern "C" volatile std::uint8_t nor_begin[];  // linker script

namespace armcal::port::mps2 {
namespace {

struct Layout {
  std::uint32_t sectors, sector_bytes;
};
constexpr Layout kLayout = {8, 4096}, kSlowLayout = {2, 128 * 1024};
constexpr std::uint32_t kUnit_bytes = 8;

template <const Layout& kOf>
bool Inside(std::uint32_t address, std::uint32_t count) {
  constexpr std::uint32_t kAll = kOf.sectors * kOf.sector_bytes;
  return address <= kAll && count <= kAll - address;
}

template <const Layout& kOf>
core::Status Read(void*, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count) {
  if (!Inside<kOf>(address, count)) return core::Status::kStorageFault;
  for (std::uint32_t k = 0; k < count; ++k) bytes[k] = nor_begin[address + k];
  return core::Status::kOk;
}

template <const Layout& kOf>
core::Status Program(void*, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count) {
  if (!Inside<kOf>(address, count) || address % kUnit_bytes != 0 || count % kUnit_bytes != 0) {
    return core::Status::kStorageFault;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint8_t before = nor_begin[address + k];
    nor_begin[address + k] = static_cast<std::uint8_t>(before & bytes[k]);
  }
  return core::Status::kOk;
}

// As flash that the code shares: nobody may read it meanwhile, so this function must lie in RAM, too. It takes some
// ticks if there are any.
[[gnu::noinline]] void EraseSector(volatile std::uint8_t* bytes) {
  constexpr std::uint32_t kErase_ticks = 3;
  const FlashGuard nobody_reads_flash;
  const std::uint32_t begin = Ticks();
  for (std::uint32_t k = 0; k < kLayout.sector_bytes; ++k) bytes[k] = 0xFF;
  while (TickRuns() && Ticks() - begin < kErase_ticks) {
  }
}

core::Status Erase(void*, std::uint32_t sector) {
  if (sector >= kLayout.sectors) return core::Status::kStorageFault;
  EraseSector(nor_begin + sector * kLayout.sector_bytes);
  return core::Status::kOk;
}

// A piece a call, and not done before two seconds have passed.
core::Status EraseSlowly(void*, std::uint32_t sector) {
  constexpr std::uint32_t kErase_ticks = 2000, kPiece_bytes = 512;
  static std::uint32_t begin = 0, erased_bytes = 0;
  if (sector >= kSlowLayout.sectors) return core::Status::kStorageFault;
  if (erased_bytes == 0) begin = Ticks();
  if (erased_bytes < kSlowLayout.sector_bytes) {
    volatile std::uint8_t* const piece = nor_begin + sector * kSlowLayout.sector_bytes + erased_bytes;
    for (std::uint32_t k = 0; k < kPiece_bytes; ++k) piece[k] = 0xFF;
    erased_bytes += kPiece_bytes;
    return core::Status::kBusy;
  }
  if (TickRuns() && Ticks() - begin < kErase_ticks) return core::Status::kBusy;
  erased_bytes = 0;
  return core::Status::kOk;
}

}  // namespace

hardware::Storage PsramStorage() {
  return {nullptr, kLayout.sectors, kLayout.sector_bytes, kUnit_bytes, 0xFF, Read<kLayout>, Program<kLayout>, Erase};
}
hardware::Storage SlowPsramStorage() {
  return {nullptr, kSlowLayout.sectors, kSlowLayout.sector_bytes, kUnit_bytes,
          0xFF,    Read<kSlowLayout>,   Program<kSlowLayout>,     EraseSlowly};
}

}  // namespace armcal::port::mps2
