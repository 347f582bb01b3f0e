// table - keeps one table in two slots of the storage, so that a power cut leaves the old table or the new one.
//
// A slot holds one record. Bytes, high byte first:
//    0 magic u32 "ARMT"      4 format u16      6 reserved u16, 0      8 schema u32     12 payload length in words u32
//   16 sequence u32         20 payload, 2 bytes a word               then CRC-32 over all bytes before it
// The commit word follows at the next multiple of the program unit, in a unit of its own. Bytes between keep the erased
// value. The frame is the same in every format version, so a firmware can check and keep a record that it cannot read.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/hardware/storage.hpp"

namespace armcal::table {

inline constexpr std::uint32_t kRecordMagic = 0x41524D54;  // "ARMT"
inline constexpr std::uint32_t kCommitWord =
    0x434D4954;  // "CMIT"; it differs in many bits from erased bytes, 0x00 or 0xFF
inline constexpr std::uint16_t kFormat = 1;
inline constexpr std::uint32_t kHeaderBytes = 20;
inline constexpr std::uint32_t kCrcBytes = 4;
// The longest piece of one storage operation, and therefore the largest program unit. A power of two.
inline constexpr std::uint32_t kChunkBytes = 64;
inline constexpr std::uint32_t kMaxPayloadWords = 0x10000;  // so that no size comes near 2^32

constexpr std::uint32_t BodyBytes(std::uint32_t words) { return kHeaderBytes + 2 * words + kCrcBytes; }

constexpr std::uint32_t RoundUp(std::uint32_t bytes, std::uint32_t unit) { return (bytes + unit - 1) / unit * unit; }

constexpr std::uint32_t CommitOffset(std::uint32_t words, std::uint32_t unit) {
  return RoundUp(BodyBytes(words), unit);
}

// The whole record with its commit word.
constexpr std::uint32_t RecordBytes(std::uint32_t words, std::uint32_t unit) {
  return CommitOffset(words, unit) + RoundUp(4, unit);
}

// What lies in a slot. A client can read the numbers (register slot_state).
enum class SlotState : std::uint8_t {
  kBlank = 0,
  kGood = 1,
  kOtherSchema = 2,  // whole, but of another schema, length or format; it is kept as long as the other slot is free
  kCorrupt = 3,
  kRefused = 4,  // whole, but its content was refused at boot
};

// The steps of a save: it reads the record in force eight times and checks it, because a weak cell may read well only
// sometimes. It erases the other slot, programs it, reads it back, programs the commit word and reads that back. Each
// Step erases one sector, programs one piece of at most kChunkBytes, reads up to three such pieces, or asks once more a
// driver that has answered kBusy.
// If the record in force can no longer be read and the other slot holds a good record, the new record replaces the bad
// one, and the good one is not touched. So a save never erases the only good record. Context of every call: background.
class TableStore {
 public:
  static constexpr int kSlots = 2;

  // `words`, `shorter`: the lengths that a table of this schema may have, the longer one first; 0: there is only one. A
  // record of another length is none of this firmware's.
  TableStore(const hardware::Storage& storage, std::uint32_t schema, std::uint32_t words, std::uint32_t shorter = 0);

  // Reads both slots and copies the good record with the highest sequence to `out` [words]; words_in_force() says how
  // many of them the record has. It reads everything at once, so call it at power-up only. If no record is good but one
  // is damaged, it reads up to 64 times, because a weak cell may read well the next time. kOk. Without a good record:
  // kWrongSchema (another one is kept), kCorrupt or kBlank. kWrongSize: a record does not fit this storage. kBusy: a
  // save is running. Unless kOk, `out` may hold words of a record that was rejected.
  core::Status Load(std::uint16_t* out);

  // Call it if the application refused the record that Load or LoadOlder copied last. Marks that record as kRefused,
  // and copies the good record with the next lower sequence to `out` [words]. Answers as Load, but never kWrongSize.
  // Call it at power-up only.
  core::Status LoadOlder(std::uint16_t* out);

  // Starts a save. `words` [count] must not change until Step no longer answers kBusy. kOk: it has begun. kBusy: a save
  // is running. kWrongSize: no table has this length, or a record does not fit this storage.
  core::Status Save(const std::uint16_t* words, std::uint32_t count);
  core::Status Save(const std::uint16_t* words) { return Save(words, words_); }

  // Asks a save to end without its commit word. Go on to call Step: it answers kEmpty when the save has ended so, and
  // the table before is in force. If the commit word is already being written, the save is completed: kOk.
  void Cancel() { cancelled_ = true; }

  // Takes the last completed save back: erases its slot, so that the table before it is in force again. Call Step until
  // it no longer answers kBusy. kOk: it has begun. kWrongOrder: no completed save to take back. kBusy: a save is
  // running.
  core::Status Revoke();

  // Begins to copy the good record that is not in force to `out` [words]. Call Step until it no longer answers kBusy;
  // words_copied() is then its length. kOk: it has begun. kEmpty: there is no such record. kBusy: a save is running.
  core::Status Copy(std::uint16_t* out);
  // Reads words [first, first + count) of the whole record in `slot` to `out`; count: at most kChunkBytes / 2. kEmpty:
  // there is no whole record. kOutOfRange: it has no such words. kStorageFault.
  core::Status Read(int slot, std::uint32_t first, std::uint32_t count, std::uint16_t* out) const;
  std::uint32_t words_in(int slot) const { return IsWhole(slot) ? length_[slot] : 0; }

  // Ends a Copy that is not finished; `out` may hold a part of the record.
  void StopCopy() {
    if (stage_ == Stage::kCopy) stage_ = Stage::kIdle;
  }

  // One piece of a save, of Revoke or of Copy. kBusy: call again. kOk: nothing is left to do. kEmpty: see Cancel.
  // kCorrupt: the record that Copy reads has changed. kStorageFault: the storage failed; the table before a save or a
  // Revoke is in force. If the driver has also refused to erase the new record (slot_state: kCorrupt), the next
  // power-up may load that record.
  core::Status Step();

  bool busy() const { return stage_ != Stage::kIdle; }
  bool Takes(std::uint32_t count) const { return count != 0 && (count == words_ || count == shorter_); }
  std::uint32_t shortest() const { return shorter_ != 0 ? shorter_ : words_; }  // length of a table
  std::uint32_t words_copied() const { return length_[checking_]; }
  std::uint32_t words_in_force() const { return current_ < 0 ? 0 : length_[current_]; }
  SlotState slot_state(int slot) const { return state_[slot]; }
  std::uint32_t sequence() const { return current_ < 0 ? 0 : sequence_[current_]; }  // of the table in force, 0: none
  int slot() const { return current_; }                                              // -1: none
  std::uint32_t fallbacks() const { return fallbacks_; }  // records passed over since power-up

 private:
  enum class Stage : std::uint8_t {
    kIdle,
    kRecheck,
    kErase,
    kProgram,
    kVerify,
    kCommit,
    kVerifyCommit,
    kRevoke,
    kCopy
  };

  bool IsWhole(int slot) const {
    return state_[slot] == SlotState::kGood || state_[slot] == SlotState::kOtherSchema ||
           state_[slot] == SlotState::kRefused;
  }
  bool Fits() const;
  std::uint32_t BaseOf(int slot) const { return static_cast<std::uint32_t>(slot) * (storage_.sector_count / 2); }
  std::uint32_t AddressOf(int slot) const { return BaseOf(slot) * storage_.sector_bytes; }
  SlotState Inspect(int slot);
  core::Status CopyOut(int slot, std::uint16_t* out) const;
  int Newest(SlotState wanted) const;
  std::uint32_t CommitAt() const { return CommitOffset(source_words_, storage_.program_unit); }
  void FillBody(std::uint32_t first, std::uint8_t* bytes, std::uint32_t count) const;
  void FillCommit(std::uint8_t* bytes) const;
  core::Status TakeBest(std::uint16_t* out);
  core::Status RecheckNext();
  void BeginRecheck(int slot);
  core::Status CopyNext();
  core::Status EraseNext();
  core::Status ProgramNext();
  core::Status VerifyNext();
  core::Status Commit();
  core::Status VerifyCommit();
  core::Status EraseTarget();
  core::Status Undo(core::Status why);

  hardware::Storage storage_;
  std::uint32_t schema_;
  std::uint32_t words_, shorter_;
  SlotState state_[kSlots] = {SlotState::kBlank, SlotState::kBlank};
  std::uint32_t sequence_[kSlots] = {0, 0};
  std::uint32_t length_[kSlots] = {0, 0};  // words of the record
  int current_ = -1;                       // slot of the table in force
  int previous_ = -1;                      // the slot that Revoke puts in force again

  Stage stage_ = Stage::kIdle;
  bool revocable_ = false, cancelled_ = false, committing_ = false;
  int target_ = 0;
  int checking_ = 0;         // slot that is read once more before the erase, or copied
  int passes_ = 0;           // how often it was read well
  std::uint32_t check_ = 0;  // checksum of it so far
  std::uint32_t at_ = 0;     // sector or byte offset inside the running stage
  const std::uint16_t* source_ = nullptr;
  std::uint32_t source_words_ = 0;
  std::uint16_t* copy_ = nullptr;
  std::uint8_t header_[kHeaderBytes] = {};
  std::uint32_t crc_ = 0;
  std::uint32_t fallbacks_ = 0;              // see register table_fallbacks
  core::Status result_ = core::Status::kOk;  // what Step answers when kRevoke has ended
};

}  // namespace armcal::table
