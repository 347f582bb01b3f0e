// link - which block serves which registers, and what went wrong last; knows no function code and no meaning of a
// value.
#pragma once

#include <cstdint>
#include <cstring>

#include "armcal/core/status.hpp"
#include "armcal/link/registers.hpp"

namespace armcal::link {

// What may be written to a block beyond what its own write function checks.
enum class WriteRule : std::uint8_t {
  kWords,   // any registers
  kPairs,   // 32-bit values: never half of one
  kFloats,  // float32: never half of one, finite
  kWhole,   // only the whole block in one request
};

// A run of registers. `offset` counts from `first`; offset + count never exceeds the block.
struct Block {
  RegisterKind kind;
  std::uint16_t first;
  std::uint16_t count;
  void* context;
  core::Status (*read)(void* context, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  // nullptr: read-only. Applies all of it or, answering anything else but kOk, nothing.
  core::Status (*write)(void* context, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  WriteRule rule;
};

// The last refusal, served as registers (reg::kStatus).
struct LastError {
  std::uint8_t exception = 0;
  std::uint8_t function = 0;
  std::uint16_t address = 0;
  core::Status status = core::Status::kOk;
  std::uint32_t request = 0;
};

// What a block's read answers from words that lie there.
inline core::Status CopyWords(const std::uint16_t* from, std::uint16_t offset, std::uint16_t count,
                              std::uint16_t* words) {
  std::memcpy(words, from + offset, 2u * count);
  return core::Status::kOk;
}

// The exception code of a Status: the one place where the two meet. 0 for ok and limited.
std::uint8_t ExceptionOf(core::Status status);

// Context: background.
class RegisterMap {
 public:
  static constexpr int kMaxBlocks = 32;

  // kFull; kOutOfRange: empty or beyond 0xFFFF; kBadAddress: overlaps another block of its kind.
  core::Status Add(const Block& block);

  // A read may run over adjacent blocks. kBadAddress: a register in the range is not there; else what a block answers.
  core::Status Read(RegisterKind kind, std::uint16_t first, std::uint16_t count, std::uint16_t* words) const;

  // One request writes one block. kBadAddress: the range leaves the block; kReadOnly; kWrongSize: half a 32-bit value
  // or part of a block that is written whole; kNotFinite; else what the block answers. Nothing is applied unless kOk.
  core::Status Write(std::uint16_t first, std::uint16_t count, const std::uint16_t* words) const;

  void CountRequest() { ++requests_; }
  void Refused(std::uint8_t function, std::uint16_t address, core::Status status) {
    last_error_ = {ExceptionOf(status), function, address, status, requests_};
  }
  std::uint32_t requests() const { return requests_; }
  const LastError& last_error() const { return last_error_; }

 private:
  const Block* Find(RegisterKind kind, std::uint32_t address) const;

  Block blocks_[kMaxBlocks] = {};
  int count_ = 0;
  std::uint32_t requests_ = 0;
  LastError last_error_;
};

}  // namespace armcal::link
