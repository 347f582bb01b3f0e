// hardware - the non-volatile memory that a target supplies.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"

namespace armcal::hardware {

// Erasable memory of equal sectors. Every function takes a bounded time and answers kOk or kStorageFault. A driver may
// report errors of its error correction as kStorageFault. Program and erase may return when the operation is complete,
// or start it and answer kBusy. Then they are called again, with the same arguments and nothing else in between, until
// they answer how it ended. The driver must end it in bounded time. Context: background.
struct Storage {
  void* context;
  std::uint32_t sector_count;  // at least 2; the lower half is slot 0, the upper half slot 1
  std::uint32_t sector_bytes;
  std::uint32_t program_unit;  // bytes of one write, a power of two up to 64; a unit is written once after each erase
  std::uint8_t erased_value;   // what an erased byte reads as

  // `address` counts bytes from the start of sector 0.
  core::Status (*read)(void* context, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count);
  // `address` and `count` are multiples of program_unit; `count` is at most 64 bytes.
  core::Status (*program)(void* context, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count);
  core::Status (*erase)(void* context, std::uint32_t sector);

  core::Status Read(std::uint32_t address, std::uint8_t* bytes, std::uint32_t count) const {
    return read(context, address, bytes, count);
  }
  core::Status Program(std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count) const {
    return program(context, address, bytes, count);
  }
  core::Status Erase(std::uint32_t sector) const { return erase(context, sector); }
};

}  // namespace armcal::hardware
