// mps2 - PSRAM that plays NOR flash.
#include "port/mps2/psram_storage.hpp"

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

core::Status Erase(void*, std::uint32_t sector) {
  if (sector >= kSectors) return core::Status::kStorageFault;
  for (std::uint32_t k = 0; k < kSector_bytes; ++k) nor_begin[sector * kSector_bytes + k] = 0xFF;
  return core::Status::kOk;
}

}  // namespace

hardware::Storage PsramStorage() { return {nullptr, kSectors, kSector_bytes, kUnit_bytes, 0xFF, Read, Program, Erase}; }

}  // namespace armcal::port::mps2
