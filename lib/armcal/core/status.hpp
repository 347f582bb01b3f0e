// core - the answer of each call that can be refused.
// A client can read the numbers (SPEC.md), so a number never changes its meaning.
#pragma once

#include <cstdint>

namespace armcal::core {

// 0: ok. 1-31: the call was refused, because of its arguments or because of the present state. 32-63: a device or a
// partner failed, or has no data. 64-95: the call was carried out with a limit: a value was cut, or a row did not
// update an estimate. 96: only inside the firmware. A refused call changes nothing, unless the comment of the function
// says what it changes.
enum class [[nodiscard]] Status : std::uint8_t {
  kOk = 0,
  kNotFinite = 1,       // a number is NaN or infinite
  kOutOfRange = 2,      // a number lies outside its documented range
  kWrongSize = 3,       // a count or length does not fit
  kWrongOrder = 4,      // not allowed in the present state, for example of a table transaction
  kWrongSchema = 5,     // made for another model
  kUnphysical = 6,      // a link that cannot exist: its pseudo-inertia or its rotor inertia
  kAxisEnabled = 7,     // refused while an axis is enabled
  kLocked = 8,          // the session is not unlocked
  kFull = 9,            // no room; the new item was refused whole
  kEmpty = 10,          // nothing there to take
  kBadCrc = 11,         // content and checksum differ
  kBadAddress = 12,     // no such register
  kBadFunction = 13,    // no such function code
  kReadOnly = 14,       // this register cannot be written
  kBusy = 15,           // an earlier command is still running
  kBeyondCeiling = 16,  // a number lies beyond the hardest value that the firmware allows
  kFeedsEnergy = 17,    // a joint's friction would push instead of brake
  kForbidden = 18,      // the board does not allow it
  kSeatTaken = 19,      // another connection is writing
  kTooSoon = 20,        // the board allows no further save yet
  kBadSignature = 21,   // a table is not signed, or its signature does not fit
  kReplayed = 22,       // a signed table has a counter that is not above the highest one
  kOtherDrive = 23,     // a table is signed for another drive
  kContracted = 24,     // the firmware was compiled without -ffp-contract=off: see math::Contracts
  kStorageFault = 32,   // the storage refused or returned what was not written
  kBlank = 33,          // storage holds no record at all
  kCorrupt = 34,        // storage holds a record that fails its checks
  kTimeout = 35,        // a partner did not answer in time
  kInconsistent = 36,   // what is measured does not fit the table
  kTrackingError = 37,  // the axes did not follow the set-point
  kGated = 64,          // accepted, but no row of the sample may update an estimate
  kClamped = 65,        // a value was cut to its limit; the limit's counter went up
  kHeld = 66,           // the last good value is kept
  kUnfinished = 96,     // never sent: the same call again gives the answer
};

// Why a table was refused, and by which of its words. `value`: the number in that word; for friction, the braking
// torque of the joint in N m at one point of the grid. `bound`: the limit that it must keep; for a word of bits, the
// bits that may be set. Without a word both are 0.
struct Refusal {
  static constexpr std::uint16_t kNoWord = 0xFFFF;

  Status status = Status::kOk;
  std::uint16_t word = kNoWord;  // the first word of the refused number, counted from 0
  float value = 0.0f, bound = 0.0f;
};

constexpr bool IsOk(Status s) { return s == Status::kOk; }
constexpr bool IsRefused(Status s) { return static_cast<std::uint8_t>(s) >= 1 && static_cast<std::uint8_t>(s) < 32; }
constexpr bool IsLimited(Status s) { return static_cast<std::uint8_t>(s) >= 64 && static_cast<std::uint8_t>(s) < 96; }

}  // namespace armcal::core
