// link - the register map: finds the block that serves a register, and makes blocks from member functions of a class.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "armcal/core/status.hpp"
#include "armcal/link/register_words.hpp"
#include "armcal/link/registers.hpp"
#include "armcal/link/sessions.hpp"

namespace armcal::link {

// What the map checks before it calls a block's write function.
enum class WriteRule : std::uint8_t {
  kWords,   // any registers
  kPairs,   // 32-bit values: never half of one
  kFloats,  // float32: never half of one, finite
  kWhole,   // only the whole block in one request
};

// A run of registers and the functions that serve them. `offset` counts from `first`; offset + count never exceeds the
// block.
struct Block {
  RegisterKind kind;
  std::uint16_t first;
  std::uint16_t count;
  void* context;
  core::Status (*read)(void* context, std::uint16_t offset, std::uint16_t count, std::uint16_t* words);
  // nullptr: read-only. It applies all words and answers kOk, or it applies none of them.
  core::Status (*write)(void* context, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);
  WriteRule rule;
};

// The last refusal, served as registers (reg::kErrorBlock and reg::kErrorRequest).
struct LastError {
  std::uint8_t exception = 0;
  std::uint8_t function = 0;
  std::uint16_t address = 0;
  core::Status status = core::Status::kOk;
  std::uint32_t request = 0;
};

// The Modbus exception for a Status; 0 if the status is ok or limited.
std::uint8_t ExceptionOf(core::Status status);

// The blocks of a device, its sessions and its last refusal. Context of every call: background.
class RegisterMap {
 public:
  static constexpr int kMaxBlocks = 48;  // at least eight of them are left to an integrator

  // kFull; kOutOfRange: empty or beyond 0xFFFF; kBadAddress: overlaps another block of its kind.
  core::Status Add(const Block& block);
  // Adds them one after the other and stops at the first that is refused.
  template <std::size_t kCount>
  core::Status Add(const Block (&blocks)[kCount]) {
    for (const Block& block : blocks)
      if (const core::Status added = Add(block); !core::IsOk(added)) return added;
    return core::Status::kOk;
  }

  // A read may run over adjacent blocks. kBadAddress: a register in the range does not exist. Else what a block
  // answers.
  core::Status Read(RegisterKind kind, std::uint16_t first, std::uint16_t count, std::uint16_t* words) const;

  // Whether all registers of the range exist.
  bool Has(RegisterKind kind, std::uint16_t first, std::uint16_t count) const;

  // One request writes one block. kBadAddress: the range leaves the block; kReadOnly; kWrongSize: half a 32-bit value
  // or part of a block that is written whole; kNotFinite; else what the block answers. Nothing is applied unless kOk.
  core::Status Write(std::uint16_t first, std::uint16_t count, const std::uint16_t* words) const;

  void CountRequest() { ++requests_; }
  void UncountRequest() { --requests_; }  // it comes again
  void Refused(std::uint8_t function, std::uint16_t address, core::Status status) {
    last_error_ = {ExceptionOf(status), function, address, status, requests_};
  }
  std::uint32_t requests() const { return requests_; }
  Sessions& sessions() { return sessions_; }
  const LastError& last_error() const { return last_error_; }

 private:
  const Block* Find(RegisterKind kind, std::uint32_t address) const;

  Block blocks_[kMaxBlocks] = {};
  int count_ = 0;
  std::uint32_t requests_ = 0;
  Sessions sessions_;
  LastError last_error_;
};

// How registers are served -------------------------------------------------------------------------------------------
// The owner of values adds blocks to the map. One of these two functions makes each block out of member functions of
// the owner. The owner outlives the map.

constexpr WriteRule RuleOf(const Span& span) {
  if (span.access == Access::kWriteBlock) return WriteRule::kWhole;
  return span.type == RegisterType::kF32   ? WriteRule::kFloats
         : span.type == RegisterType::kU32 ? WriteRule::kPairs
                                           : WriteRule::kWords;
}

// Answers a read with a part of words that lie ready.
inline core::Status CopyWords(const std::uint16_t* from, std::uint16_t offset, std::uint16_t count,
                              std::uint16_t* words) {
  std::memcpy(words, from + offset, 2u * count);
  return core::Status::kOk;
}

namespace internal {
template <const auto& kBlock, auto kFill, class Owner>
core::Status ReadFilled(void* owner, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  Words<kBlock> filled;
  (static_cast<Owner*>(owner)->*kFill)(filled);
  return CopyWords(filled.data(), offset, count, words);
}
template <const auto& kBlock, auto kTake, class Owner>
core::Status WriteWhole(void* owner, std::uint16_t, std::uint16_t, const std::uint16_t* words) {
  return (static_cast<Owner*>(owner)->*kTake)(Words<kBlock>(words));
}
template <auto kRead, class Owner>
core::Status ReadPart(void* owner, std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  return (static_cast<Owner*>(owner)->*kRead)(offset, count, words);
}
template <auto kWrite, class Owner>
core::Status WritePart(void* owner, std::uint16_t offset, std::uint16_t count, const std::uint16_t* words) {
  return (static_cast<Owner*>(owner)->*kWrite)(offset, count, words);
}
}  // namespace internal

// A small block. Each read calls void kFill(Words<kBlock>&), which fills all of it. A write calls
// Status kTake(const Words<kBlock>&), which gets all of it. `trace`: 0 or 1, for registers that exist twice.
template <const auto& kBlock, auto kFill, auto kTake = nullptr, class Owner>
Block FilledBlock(Owner* owner, int trace = 0) {
  constexpr Span kSpan = SpanOf(kBlock);
  constexpr bool kTaken = !std::is_same_v<decltype(kTake), std::nullptr_t>;
  static_assert(kTaken == (kSpan.access != Access::kRead), "a block is written if, and only if, it is declared so");
  static_assert(!kTaken || kSpan.access == Access::kWriteBlock || kSpan.count == WordsOf(kSpan.type),
                "a block that may be written in parts cannot be taken whole");
  const Span span = kSpan.Of(trace);
  Block block = {span.kind, span.first,  span.count, owner, internal::ReadFilled<kBlock, kFill, Owner>,
                 nullptr,   RuleOf(span)};
  if constexpr (kTaken) block.write = internal::WriteWhole<kBlock, kTake, Owner>;
  return block;
}

// A large block. Its owner answers each part that is asked for: Status kRead(offset, count, words), and kWrite alike.
template <auto kRead, auto kWrite = nullptr, class Owner>
Block DirectBlock(const Span& span, Owner* owner) {
  Block block = {span.kind, span.first, span.count, owner, internal::ReadPart<kRead, Owner>, nullptr, RuleOf(span)};
  if constexpr (!std::is_same_v<decltype(kWrite), std::nullptr_t>) block.write = internal::WritePart<kWrite, Owner>;
  return block;
}

// A list of float32. A read looks at the values as they are at that moment.
struct FloatList {
  const float* values;

  core::Status Read(std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
    for (unsigned i = 0; i < count; ++i) {
      std::uint16_t pair[2];
      core::PutF32(pair, values[(offset + i) / 2]);
      words[i] = pair[(offset + i) % 2];
    }
    return core::Status::kOk;
  }
};

}  // namespace armcal::link
