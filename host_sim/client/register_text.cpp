// client - prints the registers of registers.hpp and the status numbers of status.hpp.
#include "host_sim/client/register_text.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "armcal/link/registers.hpp"
#include "codegen/src/io/json.hpp"

namespace armcal::client {

using core::Status;
using link::Register;
using link::RegisterKind;
using link::RegisterType;

namespace {

struct StatusText {
  const char* name;
  const char* meaning;
};

// There is no default case, so that the compiler names an enumerator that is missing here.
StatusText TextOf(Status status) {
  switch (status) {
    case Status::kOk:
      return {"Ok", "done"};
    case Status::kNotFinite:
      return {"NotFinite", "a number is NaN or infinite"};
    case Status::kOutOfRange:
      return {"OutOfRange", "a number lies outside its documented range"};
    case Status::kWrongSize:
      return {"WrongSize", "a count or length does not fit"};
    case Status::kWrongOrder:
      return {"WrongOrder", "not allowed in the present state of a transaction"};
    case Status::kWrongSchema:
      return {"WrongSchema", "made for another model"};
    case Status::kUnphysical:
      return {"Unphysical", "a body that no mass distribution can have"};
    case Status::kAxisEnabled:
      return {"AxisEnabled", "an axis is enabled"};
    case Status::kLocked:
      return {"Locked", "the session is not unlocked"};
    case Status::kFull:
      return {"Full", "no room; the new item was refused whole"};
    case Status::kEmpty:
      return {"Empty", "nothing there to take"};
    case Status::kBadCrc:
      return {"BadCrc", "content and checksum differ"};
    case Status::kBadAddress:
      return {"BadAddress", "no such register"};
    case Status::kBadFunction:
      return {"BadFunction", "no such function code"};
    case Status::kReadOnly:
      return {"ReadOnly", "this register cannot be written"};
    case Status::kBusy:
      return {"Busy", "an earlier command is still running"};
    case Status::kBeyondCeiling:
      return {"BeyondCeiling", "a number lies beyond the hardest value that the firmware allows"};
    case Status::kFeedsEnergy:
      return {"FeedsEnergy", "a joint's friction would push instead of brake"};
    case Status::kForbidden:
      return {"Forbidden", "the board does not allow it"};
    case Status::kSeatTaken:
      return {"SeatTaken", "another connection is writing"};
    case Status::kTooSoon:
      return {"TooSoon", "the board allows no further save yet"};
    case Status::kBadSignature:
      return {"BadSignature", "the table is not signed, or its signature does not fit"};
    case Status::kReplayed:
      return {"Replayed", "the counter of the signed table is not above the highest one"};
    case Status::kOtherDrive:
      return {"OtherDrive", "the table is signed for another drive"};
    case Status::kContracted:
      return {"Contracted", "the firmware was compiled without -ffp-contract=off"};
    case Status::kStorageFault:
      return {"StorageFault", "the storage refused, or returned what was not written"};
    case Status::kBlank:
      return {"Blank", "storage holds no record at all"};
    case Status::kCorrupt:
      return {"Corrupt", "storage holds a record that fails its checks"};
    case Status::kTimeout:
      return {"Timeout", "a partner did not answer in time"};
    case Status::kInconsistent:
      return {"Inconsistent", "what is measured does not fit the table"};
    case Status::kTrackingError:
      return {"TrackingError", "the axes did not follow the set-point"};
    case Status::kGated:
      return {"Gated", "accepted, but no row of the sample may update an estimate"};
    case Status::kClamped:
      return {"Clamped", "a value was cut to its limit"};
    case Status::kHeld:
      return {"Held", "the last good value is kept"};
    case Status::kUnfinished:  // it never leaves the firmware
      break;
  }
  return {nullptr, nullptr};
}

const char* TypeName(RegisterType type) {
  return type == RegisterType::kU16 ? "u16" : type == RegisterType::kU32 ? "u32" : "f32";
}

const char* AccessName(link::Access access) {
  return access == link::Access::kRead ? "r" : access == link::Access::kWrite ? "rw" : "rw block";
}

const char* KindName(RegisterKind kind) { return kind == RegisterKind::kInput ? "input" : "holding"; }

// What may be written; empty if nothing may.
std::string RangeText(const Register& r) {
  if (r.access == link::Access::kRead) return "";
  if (r.range.given) return fmt::format("{:.0f} to {:.0f}", r.range.low, r.range.high);
  return r.type == link::RegisterType::kF32 ? "finite" : "any";
}

std::string KindMarkdown(RegisterKind kind, int function, int base) {
  std::string text = fmt::format(
      "### {} registers (function {})\n\n| dec | hex | number | count | type | access | name | unit | meaning | range "
      "|\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      kind == RegisterKind::kInput ? "Input" : "Holding", function, base);
  for (const Register& r : link::kRegisters)
    if (r.kind == kind)
      text += fmt::format("| {} | 0x{:04X} | {} | {} | {} | {} | {} | {} | {} | {} |\n", r.address, r.address,
                          base + 1 + r.address, r.count, TypeName(r.type), AccessName(r.access), r.name, r.unit,
                          r.meaning, RangeText(r));
  return text;
}

}  // namespace

std::string StatusName(Status status) {
  const StatusText text = TextOf(status);
  if (text.name == nullptr) return fmt::format("status {}", static_cast<int>(status));
  return fmt::format("{}: {}", text.name, text.meaning);
}

std::string RegisterMarkdown() {
  return KindMarkdown(RegisterKind::kInput, 4, 300000) + "\n" + KindMarkdown(RegisterKind::kHolding, 3, 400000);
}

std::string StatusMarkdown() {
  std::string text = "| number | name | meaning |\n|---|---|---|\n";
  for (int number = 0; number < 256; ++number) {
    const StatusText t = TextOf(static_cast<Status>(number));
    if (t.name != nullptr) text += fmt::format("| {} | {} | {} |\n", number, t.name, t.meaning);
  }
  return text;
}

std::string RegisterCsv() {
  std::string text = "kind,address,count,type,access,name,unit,range\n";
  for (const Register& r : link::kRegisters)
    text += fmt::format("{},{},{},{},{},{},{},{}\n", KindName(r.kind), r.address, r.count, TypeName(r.type),
                        AccessName(r.access), r.name, r.unit, RangeText(r));
  return text;
}

std::string RegisterJson() {
  nlohmann::ordered_json json;
  json["map_major"] = link::reg::kMapMajorValue;
  json["map_minor"] = link::reg::kMapMinorValue;
  json["layout_crc"] = link::kLayoutCrc;
  json["word_order"] = "big";
  for (const Register& r : link::kRegisters) {
    json["items"].push_back({{"name", r.name},
                             {"kind", KindName(r.kind)},
                             {"address", r.address},
                             {"count", r.count},
                             {"type", TypeName(r.type)},
                             {"access", AccessName(r.access)},
                             {"unit", r.unit},
                             {"meaning", r.meaning},
                             {"range", RangeText(r)}});
    if (r.range.given) json["items"].back()["low"] = r.range.low, json["items"].back()["high"] = r.range.high;
  }
  return io::JsonText(json, 2) + "\n";
}

}  // namespace armcal::client
