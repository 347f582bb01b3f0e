// template - an array that keeps the rules of flash.
#include "port/template/storage.hpp"

namespace armcal::port::target {
namespace {

// Your flash: two or more sectors of equal size. The program unit is what one write command takes.
constexpr std::uint32_t kSectors = 2, kSector_bytes = 4096, kUnit_bytes = 8;
constexpr std::uint8_t kErased = 0xFF;

std::uint8_t memory[kSectors * kSector_bytes];

bool Inside(std::uint32_t address, std::uint32_t count) {
  return address <= sizeof memory && count <= sizeof memory - address;
}

core::Status Read(void*, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count) {
  if (!Inside(address, count)) return core::Status::kStorageFault;
  for (std::uint32_t k = 0; k < count; ++k) bytes[k] = memory[address + k];
  return core::Status::kOk;
}

core::Status Program(void*, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count) {
  if (!Inside(address, count) || address % kUnit_bytes != 0 || count % kUnit_bytes != 0) {
    return core::Status::kStorageFault;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    if (memory[address + k] != kErased) return core::Status::kStorageFault;
  }
  for (std::uint32_t k = 0; k < count; ++k) memory[address + k] = bytes[k];
  return core::Status::kOk;
}

core::Status Erase(void*, std::uint32_t sector) {
  if (sector >= kSectors) return core::Status::kStorageFault;
  for (std::uint32_t k = 0; k < kSector_bytes; ++k) memory[sector * kSector_bytes + k] = kErased;
  return core::Status::kOk;
}

}  // namespace

hardware::Storage TargetStorage() {
  return {nullptr, kSectors, kSector_bytes, kUnit_bytes, kErased, Read, Program, Erase};
}

}  // namespace armcal::port::target
