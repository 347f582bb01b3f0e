// link - every block of the map and the values in it; knows no transport.
#include "armcal/link/device.hpp"

#include <cstring>

#include "armcal/core/words.hpp"

namespace armcal::link {

namespace {

using core::PutF32;
using core::PutU32;
using core::Status;
using Words = std::uint16_t;

Status ReadFloats(void* context, Words offset, Words count, Words* words) {
  const float* values = *static_cast<const float**>(context);
  for (unsigned i = 0; i < count; ++i) {
    Words pair[2];
    PutF32(pair, values[(offset + i) / 2]);
    words[i] = pair[(offset + i) % 2];
  }
  return Status::kOk;
}

Status ReadScratch(void* context, Words offset, Words count, Words* words) {
  return CopyWords(static_cast<const Words*>(context), offset, count, words);
}

Status WriteScratch(void* context, Words offset, Words count, const Words* words) {
  std::memcpy(static_cast<Words*>(context) + offset, words, 2u * count);
  return Status::kOk;
}

}  // namespace

Device::Device(const Identity& identity, const LiveStatus& live, TableTransaction& transaction)
    : identity_(identity), live_(live), transaction_(transaction), engine_(map_, identity.texts) {
  constexpr auto kIn = RegisterKind::kInput, kHold = RegisterKind::kHolding;
  constexpr auto kAny = WriteRule::kWords, kWhole = WriteRule::kWhole;
  const Words table = transaction.words();
  const Block blocks[] = {
      {kIn, reg::kIdentity, reg::kIdentityCount, this, Read<&Device::ReadIdentity>, nullptr, kAny},
      {kIn, reg::kStatus, reg::kStatusCount, this, Read<&Device::ReadStatus>, nullptr, kAny},
      {kHold, reg::kCommand, reg::kCommandCount, this, Read<&Device::ReadCommand>, Write<&Device::WriteCommand>,
       kWhole},
      {kHold, reg::kUnlock, 2, this, Read<&Device::ReadUnlock>, Write<&Device::WriteUnlock>, kWhole},
      {kHold, reg::kStaged, table, this, Read<&Device::ReadStaged>, Write<&Device::WriteStaged>, kAny},
      {kHold, reg::kActive, table, this, Read<&Device::ReadActive>, nullptr, kAny},
      {kHold, reg::kScratch, reg::kScratchCount, scratch_, ReadScratch, WriteScratch, kAny},
      {kHold, reg::kScratchFloat, 2 * reg::kScratchPairs, scratch_float_, ReadScratch, WriteScratch,
       WriteRule::kFloats},
      {kHold, reg::kScratchU32, 2 * reg::kScratchPairs, scratch_u32_, ReadScratch, WriteScratch, WriteRule::kPairs},
  };
  // An empty map has room for them and registers.hpp keeps them apart; a test reads every one.
  for (const Block& block : blocks) static_cast<void>(map_.Add(block));
}

Status Device::AddFloats(Words first, const float* values, Words count) {
  if (float_lists_ == kMaxFloatLists) return Status::kFull;
  floats_[float_lists_] = values;
  const Status added = map_.Add({RegisterKind::kInput, first, static_cast<Words>(2 * count), &floats_[float_lists_],
                                 ReadFloats, nullptr, WriteRule::kWords});
  if (core::IsOk(added)) ++float_lists_;
  return added;
}

void Device::Step(std::uint32_t now_ms) {
  now_ms_ = now_ms;
  if (unlocked_ && now_ms - touched_ms_ >= kUnlock_ms) unlocked_ = false;
  transaction_.Step(now_ms);
}

// kLocked, or the lock stays open for another while.
Status Device::Unlocked() {
  if (!unlocked_) return Status::kLocked;
  touched_ms_ = now_ms_;
  return Status::kOk;
}

Status Device::ReadIdentity(Words offset, Words count, Words* words) {
  Words w[reg::kIdentityCount];
  PutU32(w, reg::kMagic);
  w[2] = reg::kMapMajor;
  w[3] = reg::kMapMinor;
  PutU32(w + 4, kLayoutCrc);
  PutU32(w + 6, identity_.schema);
  PutU32(w + 8, identity_.firmware_version);
  PutU32(w + 10, identity_.serial_number);
  PutF32(w + 12, reg::kProbeFloat);
  PutU32(w + 14, reg::kProbeU32);
  w[16] = identity_.axes;
  w[17] = identity_.parameters;
  w[18] = identity_.columns;
  w[19] = transaction_.words();
  PutU32(w + 20, identity_.capabilities);
  PutU32(w + 22, identity_.tick_rate_Hz);
  w[24] = identity_.sample_ticks;
  w[25] = reg::kPageDataCount;
  return CopyWords(w, offset, count, words);
}

Status Device::ReadStatus(Words offset, Words count, Words* words) {
  const LastError& error = map_.last_error();
  const table::TableStore& store = transaction_.store();
  Words w[reg::kStatusCount];
  w[0] = static_cast<Words>(transaction_.state());
  w[1] = static_cast<Words>(transaction_.status());
  w[2] = static_cast<Words>(transaction_.table_status());
  w[3] = live_.feedforward_state;
  PutU32(w + 4, live_.generation);
  PutU32(w + 6, live_.tick);
  PutU32(w + 8, transaction_.active_crc());
  PutU32(w + 10, transaction_.last_command().sequence);
  PutU32(w + 12, store.sequence());
  w[14] = static_cast<Words>(store.slot_state(0));
  w[15] = static_cast<Words>(store.slot_state(1));
  PutU32(w + 16, live_.enabled_axes);
  PutU32(w + 18, live_.clamp_count);
  PutU32(w + 20, live_.sample_gaps);
  PutU32(w + 22, map_.requests());
  w[24] = error.exception;
  w[25] = error.function;
  w[26] = error.address;
  w[27] = static_cast<Words>(error.status);
  PutU32(w + 28, error.request);
  w[30] = unlocked_ ? 1 : 0;
  w[31] = live_.health;
  for (int filter = 0; filter < 2; ++filter) {
    PutU32(w + 32 + 4 * filter, live_.rows_used[filter]);
    PutU32(w + 34 + 4 * filter, live_.rows_gated[filter]);
  }
  return CopyWords(w, offset, count, words);
}

Status Device::ReadCommand(Words offset, Words count, Words* words) {
  const TableCommand& c = transaction_.last_command();
  Words w[reg::kCommandCount] = {};
  PutU32(w, c.sequence);
  PutU32(w + 2, c.command);
  PutU32(w + 4, c.schema);
  w[6] = c.words;
  PutU32(w + 8, c.crc);
  return CopyWords(w, offset, count, words);
}

Status Device::WriteCommand(Words, Words, const Words* w) {
  const Status unlocked = Unlocked();
  if (!core::IsOk(unlocked)) return unlocked;
  if (w[7] != 0) return Status::kOutOfRange;
  return transaction_.Command({core::GetU32(w), core::GetU32(w + 2), core::GetU32(w + 4), w[6], core::GetU32(w + 8)});
}

Status Device::ReadUnlock(Words offset, Words count, Words* words) {
  const Words w[2] = {0, static_cast<Words>(unlocked_ ? 1 : 0)};
  return CopyWords(w, offset, count, words);
}

Status Device::WriteUnlock(Words, Words, const Words* words) {
  unlocked_ = core::GetU32(words) == reg::kUnlockKey;
  touched_ms_ = now_ms_;
  return unlocked_ ? Status::kOk : Status::kLocked;
}

Status Device::ReadStaged(Words offset, Words count, Words* words) {
  return CopyWords(transaction_.staged(), offset, count, words);
}

Status Device::WriteStaged(Words offset, Words count, const Words* words) {
  const Status unlocked = Unlocked();
  return core::IsOk(unlocked) ? transaction_.WriteStaged(offset, count, words) : unlocked;
}

Status Device::ReadActive(Words offset, Words count, Words* words) {
  return CopyWords(transaction_.active(), offset, count, words);
}

}  // namespace armcal::link
