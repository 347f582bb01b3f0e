// link - finds the block of a request, and checks what needs no meaning: gaps, halves of values, not-a-number.
#include "armcal/link/register_map.hpp"

namespace armcal::link {

using core::Status;

std::uint8_t ExceptionOf(Status status) {
  if (core::IsOk(status) || core::IsLimited(status)) return 0;
  switch (status) {
    case Status::kBadFunction:
      return 1;
    case Status::kBadAddress:
      return 2;
    case Status::kNotFinite:
    case Status::kOutOfRange:
    case Status::kWrongSize:
      return 3;
    case Status::kBusy:
      return 6;
    default:
      return 4;
  }
}

Status RegisterMap::Add(const Block& block) {
  if (count_ == kMaxBlocks) return Status::kFull;
  const std::uint32_t end = static_cast<std::uint32_t>(block.first) + block.count;
  if (block.count == 0 || end > 0x10000u) return Status::kOutOfRange;
  for (int i = 0; i < count_; ++i) {
    const std::uint32_t other_end = static_cast<std::uint32_t>(blocks_[i].first) + blocks_[i].count;
    if (blocks_[i].kind == block.kind && block.first < other_end && blocks_[i].first < end) return Status::kBadAddress;
  }
  blocks_[count_++] = block;
  return Status::kOk;
}

const Block* RegisterMap::Find(RegisterKind kind, std::uint32_t address) const {
  for (int i = 0; i < count_; ++i)
    if (blocks_[i].kind == kind && address >= blocks_[i].first && address - blocks_[i].first < blocks_[i].count)
      return &blocks_[i];
  return nullptr;
}

bool RegisterMap::Has(RegisterKind kind, std::uint16_t first, std::uint16_t count) const {
  const std::uint32_t end = static_cast<std::uint32_t>(first) + count;
  for (std::uint32_t at = first; at < end;) {
    const Block* block = Find(kind, at);
    if (block == nullptr) return false;
    at = static_cast<std::uint32_t>(block->first) + block->count;
  }
  return true;
}

// A read may have a side effect, so it looks first whether all of the range is there.
Status RegisterMap::Read(RegisterKind kind, std::uint16_t first, std::uint16_t count, std::uint16_t* words) const {
  const std::uint32_t end = static_cast<std::uint32_t>(first) + count;
  if (!Has(kind, first, count)) return Status::kBadAddress;
  for (std::uint32_t at = first; at < end;) {
    const Block* block = Find(kind, at);
    const std::uint32_t block_end = static_cast<std::uint32_t>(block->first) + block->count;
    const std::uint32_t part = (block_end < end ? block_end : end) - at;
    const Status status = block->read(block->context, static_cast<std::uint16_t>(at - block->first),
                                      static_cast<std::uint16_t>(part), words + (at - first));
    if (!core::IsOk(status)) return status;
    at += part;
  }
  return Status::kOk;
}

Status RegisterMap::Write(std::uint16_t first, std::uint16_t count, const std::uint16_t* words) const {
  const Block* block = Find(RegisterKind::kHolding, first);
  if (block == nullptr) return Status::kBadAddress;
  const std::uint32_t offset = static_cast<std::uint32_t>(first) - block->first;
  if (count == 0 || offset + count > block->count) return Status::kBadAddress;
  if (block->write == nullptr) return Status::kReadOnly;
  if (block->rule == WriteRule::kWhole && count != block->count) return Status::kWrongSize;
  if (block->rule == WriteRule::kPairs || block->rule == WriteRule::kFloats) {
    if (offset % 2 != 0 || count % 2 != 0) return Status::kWrongSize;
  }
  if (block->rule == WriteRule::kFloats) {
    for (std::uint16_t i = 0; i < count; i = static_cast<std::uint16_t>(i + 2))
      if ((words[i] & 0x7F80u) == 0x7F80u) return Status::kNotFinite;  // exponent all ones
  }
  return block->write(block->context, static_cast<std::uint16_t>(offset), count, words);
}

}  // namespace armcal::link
