// mps2 - PSRAM that plays NOR flash.
#include "port/mps2/psram_storage.hpp"

#include "port/mps2/flash_guard.hpp"
#include "port/mps2/tick_clock.hpp"

extern "C" volatile std::uint8_t nor_begin[];  // linker script

namespace armcal::port::mps2 {
namespace {

constexpr std::uint32_t kSectors = 8, kSector_bytes = 4096, kUnit_bytes = 8;

bool Inside(std::uint32_t address, std::uint32_t count) {
  return address <= kSectors * kSector_bytes && count <= kSectors * kSector_bytes - address;
}

core::Status Read(void*, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count) {
  if (!Inside(address, count)) return core::Status::kStorageFault;
  for (std::uint32_t k = 0; k < count; ++k) bytes[k] = nor_begin[address + k];
  return core::Status::kOk;
}

core::Status Program(void*, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count) {
  if (!Inside(address, count) || address % kUnit_bytes != 0 || count % kUnit_bytes != 0) {
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
  for (std::uint32_t k = 0; k < kSector_bytes; ++k) bytes[k] = 0xFF;
  while (TickRuns() && Ticks() - begin < kErase_ticks) {
  }
}

core::Status Erase(void*, std::uint32_t sector) {
  if (sector >= kSectors) return core::Status::kStorageFault;
  EraseSector(nor_begin + sector * kSector_bytes);
  return core::Status::kOk;
}

}  // namespace

hardware::Storage PsramStorage() { return {nullptr, kSectors, kSector_bytes, kUnit_bytes, 0xFF, Read, Program, Erase}; }

}  // namespace armcal::port::mps2
