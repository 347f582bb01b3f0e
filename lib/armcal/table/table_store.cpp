// table - how the store looks at its two slots at power-up, and how it saves a table step by step.
#include "armcal/table/table_store.hpp"

#include <cstring>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"

namespace armcal::table {

using core::Status;

namespace {

// A weak cell reads well only sometimes. The more often a record is read before the other one is erased, and the more
// often it is tried at power-up, the less likely it is that a record passes here and fails there.
constexpr int kRechecks = 8;   // of the record in force before an erase
constexpr int kReadings = 64;  // of both slots at power-up, at most

struct Header {
  std::uint16_t format;
  std::uint32_t schema;
  std::uint32_t words;
  std::uint32_t sequence;
};

void PutHeader(std::uint8_t* b, const Header& h) {
  core::PutBytes32(b, kRecordMagic);
  core::PutBytes16(b + 4, h.format);
  core::PutBytes16(b + 6, 0);
  core::PutBytes32(b + 8, h.schema);
  core::PutBytes32(b + 12, h.words);
  core::PutBytes32(b + 16, h.sequence);
}

Header GetHeader(const std::uint8_t* b) {
  return {core::GetBytes16(b + 4), core::GetBytes32(b + 8), core::GetBytes32(b + 12), core::GetBytes32(b + 16)};
}

}  // namespace

TableStore::TableStore(const hardware::Storage& storage, std::uint32_t schema, std::uint32_t words,
                       std::uint32_t shorter)
    : storage_(storage), schema_(schema), words_(words), shorter_(shorter) {}

bool TableStore::Fits() const {
  const std::uint32_t unit = storage_.program_unit;
  if (unit == 0 || unit > kChunkBytes || (unit & (unit - 1)) != 0 || storage_.sector_bytes % unit != 0) return false;
  if (words_ == 0 || words_ > kMaxPayloadWords || storage_.sector_count < 2) return false;
  return RecordBytes(words_, unit) <= storage_.sector_count / 2 * storage_.sector_bytes;
}

SlotState TableStore::Inspect(int slot) {
  const std::uint32_t base = AddressOf(slot);
  const std::uint32_t slot_bytes = storage_.sector_count / 2 * storage_.sector_bytes;
  std::uint8_t bytes[kChunkBytes];
  if (slot_bytes < kHeaderBytes) return SlotState::kCorrupt;
  if (!IsOk(storage_.Read(base, bytes, kHeaderBytes))) return SlotState::kCorrupt;
  bool blank = true;
  for (std::uint32_t i = 0; i < kHeaderBytes; ++i) blank = blank && bytes[i] == storage_.erased_value;
  if (blank) return SlotState::kBlank;

  const Header header = GetHeader(bytes);
  if (core::GetBytes32(bytes) != kRecordMagic || header.words > kMaxPayloadWords) return SlotState::kCorrupt;
  if (RecordBytes(header.words, storage_.program_unit) > slot_bytes) return SlotState::kCorrupt;

  // The header is not read again: a weak cell could read differently, and the checksum would not be that of `header`.
  std::uint32_t crc = core::Crc32(bytes, kHeaderBytes, 0);
  const std::uint32_t covered = kHeaderBytes + 2 * header.words;
  for (std::uint32_t at = kHeaderBytes; at < covered;) {
    const std::uint32_t count = covered - at < sizeof bytes ? covered - at : static_cast<std::uint32_t>(sizeof bytes);
    if (!IsOk(storage_.Read(base + at, bytes, count))) return SlotState::kCorrupt;
    crc = core::Crc32(bytes, count, crc);
    at += count;
  }
  if (!IsOk(storage_.Read(base + covered, bytes, kCrcBytes)) || core::GetBytes32(bytes) != crc)
    return SlotState::kCorrupt;
  const std::uint32_t commit_at = base + CommitOffset(header.words, storage_.program_unit);
  if (!IsOk(storage_.Read(commit_at, bytes, 4)) || core::GetBytes32(bytes) != kCommitWord) return SlotState::kCorrupt;

  sequence_[slot] = header.sequence;
  length_[slot] = header.words;
  const bool ours = header.format == kFormat && header.schema == schema_ && Takes(header.words);
  return ours ? SlotState::kGood : SlotState::kOtherSchema;
}

// Reads the payload once more and checks it again, so that the words that are handed out are the words that were
// checked.
Status TableStore::CopyOut(int slot, std::uint16_t* out) const {
  const std::uint32_t base = AddressOf(slot);
  const std::uint32_t words = length_[slot];
  std::uint8_t bytes[kChunkBytes];
  if (!IsOk(storage_.Read(base, bytes, kHeaderBytes))) return Status::kStorageFault;
  const std::uint32_t header_crc = core::Crc32(bytes, kHeaderBytes);
  for (std::uint32_t done = 0; done < words;) {
    const std::uint32_t room = static_cast<std::uint32_t>(sizeof bytes) / 2;
    const std::uint32_t count = words - done < room ? words - done : room;
    if (!IsOk(storage_.Read(base + kHeaderBytes + 2 * done, bytes, 2 * count))) return Status::kStorageFault;
    for (std::uint32_t i = 0; i < count; ++i) out[done + i] = core::GetBytes16(bytes + 2 * i);
    done += count;
  }
  if (!IsOk(storage_.Read(base + kHeaderBytes + 2 * words, bytes, kCrcBytes))) return Status::kStorageFault;
  return core::Crc32Words(out, words, header_crc) == core::GetBytes32(bytes) ? Status::kOk : Status::kCorrupt;
}

// The slot in `wanted` state that has the highest sequence; -1: none. The sequence may wrap, so the sign of the
// difference decides.
int TableStore::Newest(SlotState wanted) const {
  if (state_[0] == wanted && state_[1] == wanted)
    return static_cast<std::int32_t>(sequence_[1] - sequence_[0]) > 0 ? 1 : 0;
  if (state_[0] == wanted) return 0;
  return state_[1] == wanted ? 1 : -1;
}

Status TableStore::Load(std::uint16_t* out) {
  if (!Fits()) return Status::kWrongSize;
  if (busy()) return Status::kBusy;
  revocable_ = false;
  const std::uint32_t before = fallbacks_;
  for (int reading = 1;; ++reading) {
    fallbacks_ = before;
    for (int slot = 0; slot < kSlots; ++slot) {
      state_[slot] = Inspect(slot);
      fallbacks_ += state_[slot] == SlotState::kCorrupt;
    }
    const Status status = TakeBest(out);
    if (IsOk(status) || Newest(SlotState::kCorrupt) < 0 || reading == kReadings) return status;
  }
}

Status TableStore::LoadOlder(std::uint16_t* out) {
  if (busy()) return Status::kBusy;
  if (current_ >= 0) {
    state_[current_] = SlotState::kRefused;
    fallbacks_ += 1u;
  }
  return TakeBest(out);
}

Status TableStore::TakeBest(std::uint16_t* out) {
  for (int attempt = 0; attempt < kSlots; ++attempt) {
    current_ = Newest(SlotState::kGood);
    if (current_ < 0) break;
    if (IsOk(CopyOut(current_, out))) return Status::kOk;
    state_[current_] = SlotState::kCorrupt;
    ++fallbacks_;
  }
  current_ = -1;
  if (Newest(SlotState::kOtherSchema) >= 0) return Status::kWrongSchema;
  return Newest(SlotState::kCorrupt) >= 0 ? Status::kCorrupt : Status::kBlank;
}

Status TableStore::Save(const std::uint16_t* words, std::uint32_t count) {
  if (busy()) return Status::kBusy;
  if (!Fits() || !Takes(count)) return Status::kWrongSize;
  // Keep the slot of the table in force. If there is none, keep the newest record of another schema.
  const int keep = current_ >= 0 ? current_ : Newest(SlotState::kOtherSchema);
  target_ = keep == 0 ? 1 : 0;
  const bool whole[kSlots] = {IsWhole(0), IsWhole(1)};
  std::uint32_t newest = 0;
  if (whole[0]) newest = sequence_[0];
  if (whole[1] && (!whole[0] || static_cast<std::int32_t>(sequence_[1] - newest) > 0)) newest = sequence_[1];

  PutHeader(header_, {kFormat, schema_, count, newest + 1});
  crc_ = core::Crc32Words(words, count, core::Crc32(header_, kHeaderBytes));
  source_ = words;
  source_words_ = count;
  previous_ = current_;
  revocable_ = cancelled_ = committing_ = false;
  at_ = 0;
  stage_ = Stage::kErase;
  if (current_ >= 0) BeginRecheck(current_);
  return Status::kOk;
}

void TableStore::BeginRecheck(int slot) {
  checking_ = slot;
  passes_ = 0;
  check_ = 0;
  at_ = 0;
  stage_ = Stage::kRecheck;
}

// First the record in force. If that no longer reads well, the other one, if it was good: then the two change places.
// Otherwise the record in force stays where it is, because another reading of it may still succeed.
Status TableStore::RecheckNext() {
  const std::uint32_t base = AddressOf(checking_), covered = kHeaderBytes + 2 * length_[checking_];
  std::uint8_t bytes[kChunkBytes];
  const std::uint32_t count = covered - at_ < kChunkBytes ? covered - at_ : kChunkBytes;
  bool good = IsOk(storage_.Read(base + at_, bytes, count));
  if (at_ == 0) {
    const Header header = GetHeader(bytes);
    good = good && core::GetBytes32(bytes) == kRecordMagic && header.sequence == sequence_[checking_];
  }
  check_ = core::Crc32(bytes, count, check_);
  at_ += count;
  if (good && at_ < covered) return Status::kBusy;
  good = good && IsOk(storage_.Read(base + covered, bytes, kCrcBytes)) && core::GetBytes32(bytes) == check_;
  const std::uint32_t commit_at = base + CommitOffset(length_[checking_], storage_.program_unit);
  good = good && IsOk(storage_.Read(commit_at, bytes, 4)) && core::GetBytes32(bytes) == kCommitWord;

  if (good && ++passes_ < kRechecks) {
    check_ = 0;
    at_ = 0;
    return Status::kBusy;
  }
  const int other = 1 - current_;
  if (!good && checking_ == current_) {
    ++fallbacks_;
    if (state_[other] == SlotState::kGood) {
      BeginRecheck(other);
      return Status::kBusy;
    }
  } else if (good && checking_ == other) {
    state_[current_] = SlotState::kCorrupt;
    target_ = current_;
    current_ = previous_ = other;
  }
  at_ = 0;
  stage_ = Stage::kErase;
  return Status::kBusy;
}

Status TableStore::Revoke() {
  if (busy()) return Status::kBusy;
  if (!revocable_) return Status::kWrongOrder;
  current_ = previous_;
  result_ = Status::kOk;
  stage_ = Stage::kRevoke;
  return Status::kOk;
}

Status TableStore::Read(int slot, std::uint32_t first, std::uint32_t count, std::uint16_t* out) const {
  if (!IsWhole(slot)) return Status::kEmpty;
  if (count > kChunkBytes / 2 || first > length_[slot] || count > length_[slot] - first) return Status::kOutOfRange;
  std::uint8_t bytes[kChunkBytes];
  if (!IsOk(storage_.Read(AddressOf(slot) + kHeaderBytes + 2 * first, bytes, 2 * count))) return Status::kStorageFault;
  for (std::uint32_t i = 0; i < count; ++i) out[i] = core::GetBytes16(bytes + 2 * i);
  return Status::kOk;
}

Status TableStore::Copy(std::uint16_t* out) {
  if (busy()) return Status::kBusy;
  checking_ = current_ == 0 ? 1 : 0;
  if (current_ < 0 || state_[checking_] != SlotState::kGood) return Status::kEmpty;
  copy_ = out;
  check_ = 0;
  at_ = 0;
  stage_ = Stage::kCopy;
  return Status::kOk;
}

// First the header, which only counts for the checksum, then the words.
Status TableStore::CopyNext() {
  const std::uint32_t base = AddressOf(checking_), end = kHeaderBytes + 2 * length_[checking_];
  std::uint8_t bytes[kChunkBytes];
  const std::uint32_t left = at_ == 0 ? kHeaderBytes : end - at_, count = left < kChunkBytes ? left : kChunkBytes;
  bool good = IsOk(storage_.Read(base + at_, bytes, count));
  check_ = core::Crc32(bytes, count, check_);
  if (at_ != 0)
    for (std::uint32_t i = 0; i < count; i += 2) copy_[(at_ + i - kHeaderBytes) / 2] = core::GetBytes16(bytes + i);
  at_ += count;
  if (good && at_ < end) return Status::kBusy;
  stage_ = Stage::kIdle;
  if (good) good = IsOk(storage_.Read(base + end, bytes, kCrcBytes));
  if (!good) return Status::kStorageFault;
  return check_ != core::GetBytes32(bytes) ? Status::kCorrupt : Status::kOk;
}

Status TableStore::Step() {
  switch (stage_) {
    case Stage::kIdle:
      return Status::kOk;
    case Stage::kRecheck:
      if (!cancelled_) return RecheckNext();
      stage_ = Stage::kIdle;  // nothing is erased yet
      return Status::kEmpty;
    case Stage::kErase:
      return EraseNext();
    case Stage::kProgram:
      return ProgramNext();
    case Stage::kVerify:
      return VerifyNext();
    case Stage::kCommit:
      return cancelled_ && !committing_ ? Undo(Status::kEmpty) : Commit();
    case Stage::kVerifyCommit:
      return VerifyCommit();
    case Stage::kRevoke:
      return EraseTarget();
    case Stage::kCopy:
      return CopyNext();
  }
  return Status::kOk;
}

// Bytes [first, first + count) of the record. Bytes beyond its end have the erased value.
void TableStore::FillBody(std::uint32_t first, std::uint8_t* bytes, std::uint32_t count) const {
  const std::uint32_t payload_end = kHeaderBytes + 2 * source_words_;
  std::uint8_t crc[kCrcBytes];
  core::PutBytes32(crc, crc_);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t at = first + i;
    if (at < kHeaderBytes) {
      bytes[i] = header_[at];
    } else if (at < payload_end) {
      const std::uint16_t word = source_[(at - kHeaderBytes) / 2];
      bytes[i] = static_cast<std::uint8_t>((at - kHeaderBytes) % 2 == 0 ? word >> 8 : word & 0xFF);
    } else {
      bytes[i] = at < payload_end + kCrcBytes ? crc[at - payload_end] : storage_.erased_value;
    }
  }
}

void TableStore::FillCommit(std::uint8_t* bytes) const {
  for (std::uint32_t i = 0; i < RoundUp(4, storage_.program_unit); ++i) bytes[i] = storage_.erased_value;
  core::PutBytes32(bytes, kCommitWord);
}

Status TableStore::EraseNext() {
  state_[target_] = SlotState::kCorrupt;  // until the new record is whole
  const Status erased = storage_.Erase(BaseOf(target_) + at_);
  if (erased == Status::kBusy) return erased;
  if (!IsOk(erased)) return Undo(Status::kStorageFault);
  ++at_;
  if (at_ * storage_.sector_bytes >= RecordBytes(source_words_, storage_.program_unit)) {
    stage_ = Stage::kProgram;
    at_ = 0;
  }
  return Status::kBusy;
}

Status TableStore::ProgramNext() {
  const std::uint32_t end = CommitAt();
  const std::uint32_t count = end - at_ < kChunkBytes ? end - at_ : kChunkBytes;
  std::uint8_t bytes[kChunkBytes];
  FillBody(at_, bytes, count);
  const Status programmed = storage_.Program(AddressOf(target_) + at_, bytes, count);
  if (programmed == Status::kBusy) return programmed;
  if (!IsOk(programmed)) return Undo(Status::kStorageFault);
  at_ += count;
  if (at_ == end) {
    stage_ = Stage::kVerify;
    at_ = 0;
  }
  return Status::kBusy;
}

Status TableStore::VerifyNext() {
  const std::uint32_t end = CommitAt();
  const std::uint32_t count = end - at_ < kChunkBytes ? end - at_ : kChunkBytes;
  std::uint8_t wanted[kChunkBytes];
  std::uint8_t found[kChunkBytes];
  FillBody(at_, wanted, count);
  if (!IsOk(storage_.Read(AddressOf(target_) + at_, found, count))) return Undo(Status::kStorageFault);
  if (std::memcmp(wanted, found, count) != 0) return Undo(Status::kStorageFault);
  at_ += count;
  if (at_ == end) stage_ = Stage::kCommit;
  return Status::kBusy;
}

Status TableStore::Commit() {
  std::uint8_t bytes[kChunkBytes];
  FillCommit(bytes);
  const std::uint32_t at = AddressOf(target_) + CommitAt();
  committing_ = true;
  const Status committed = storage_.Program(at, bytes, RoundUp(4, storage_.program_unit));
  if (committed == Status::kBusy) return committed;
  if (!IsOk(committed)) return Undo(Status::kStorageFault);
  stage_ = Stage::kVerifyCommit;
  return Status::kBusy;
}

Status TableStore::VerifyCommit() {
  std::uint8_t found[4];
  const std::uint32_t at = AddressOf(target_) + CommitAt();
  if (!IsOk(storage_.Read(at, found, sizeof found)) || core::GetBytes32(found) != kCommitWord)
    return Undo(Status::kStorageFault);
  state_[target_] = SlotState::kGood;
  sequence_[target_] = core::GetBytes32(header_ + 16);
  length_[target_] = source_words_;
  current_ = target_;
  revocable_ = true;
  stage_ = Stage::kIdle;
  return Status::kOk;
}

// Erases the new record. One that failed must not be taken at the next power-up, even if only its commit word could not
// be read back. why: what the save then answers.
Status TableStore::Undo(Status why) {
  result_ = why;
  stage_ = Stage::kRevoke;
  return Status::kBusy;
}

// It is enough to erase the sector of the header, because a record without a header is not taken.
Status TableStore::EraseTarget() {
  const Status undone = storage_.Erase(BaseOf(target_));
  if (undone == Status::kBusy) return undone;
  state_[target_] = IsOk(undone) ? SlotState::kBlank : SlotState::kCorrupt;
  revocable_ = false;
  stage_ = Stage::kIdle;
  return IsOk(undone) ? result_ : Status::kStorageFault;
}

}  // namespace armcal::table
