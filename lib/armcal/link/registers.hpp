// link - the register map as numbers, the one source of SPEC.md's tables; knows no value behind a register.
//
// Addresses are zero-based PDU addresses. A 32-bit item takes two registers, high word first ("ABCD"). An address never
// changes meaning inside a major version. 0x8000-0xFFFF of both kinds belongs to the integrator.
#pragma once

#include <cstdint>

#include "armcal/core/crc.hpp"

namespace armcal::link {

enum class RegisterKind : std::uint8_t { kInput = 4, kHolding = 3 };  // the numbers are the reading function codes
enum class RegisterType : std::uint8_t { kU16 = 1, kU32 = 2, kF32 = 3 };
enum class Access : std::uint8_t { kRead, kWrite, kWriteBlock };  // kWriteBlock: only the whole block in one request

constexpr std::uint16_t WordsOf(RegisterType type) { return type == RegisterType::kU16 ? 1 : 2; }

// One named item: `count` elements of `type` from `address` on. Elements beyond what a device has are not served.
struct Item {
  const char* name;
  RegisterKind kind;
  std::uint16_t address;
  std::uint16_t count;
  RegisterType type;
  Access access;
  const char* unit;
  const char* meaning;
};

namespace reg {

inline constexpr std::uint16_t kMapMajor = 1;
inline constexpr std::uint16_t kMapMinor = 2;
inline constexpr std::uint32_t kMagic = 0x41524D43;  // "ARMC"
inline constexpr float kProbeFloat = 123456.789f;    // reads 123456.79 only with the right word order
inline constexpr std::uint32_t kProbeU32 = 0x12345678;

// Input registers: blocks.
inline constexpr std::uint16_t kIdentity = 0x0000, kIdentityCount = 26;
inline constexpr std::uint16_t kStatus = 0x0040, kStatusCount = 40;
inline constexpr std::uint16_t kMaxJoints = 16;
inline constexpr std::uint16_t kResidualRms = 0x0080, kConsistency = 0x00A0;
inline constexpr std::uint16_t kMaxColumns = 256;
inline constexpr std::uint16_t kEstimateA = 0x0100, kDeviationA = 0x0300, kEstimateB = 0x0500, kDeviationB = 0x0700;
// Residual statistics of one joint: header, then f32 values, without a gap.
inline constexpr std::uint16_t kResidualPage = 0x1000, kResidualHeaderCount = 8, kResidualValues = 0x1008;
inline constexpr std::uint16_t kResidualSignals = 4, kResidualQuarters = 4, kResidualSums = 8;
inline constexpr std::uint16_t kResidualBinValues = kResidualSignals * 2 * kResidualQuarters * kResidualSums;
inline constexpr std::uint16_t kResidualSlices = 32, kResidualSliceValues = 3 * kResidualSlices;
inline constexpr std::uint16_t kResidualValueCount = 2 * kResidualBinValues + kResidualSliceValues;
inline constexpr int kTraces = 2;  // 0 raw samples, 1 processed samples
inline constexpr std::uint16_t kTracePage[kTraces] = {0x4000, 0x6000};
inline constexpr std::uint16_t kPageHeaderCount = 16, kPageData = 0x0010, kPageDataCount = 0x1F00;

// Holding registers: blocks.
inline constexpr std::uint16_t kCommand = 0x0000, kCommandCount = 10;
inline constexpr std::uint16_t kScratch = 0x0020, kScratchCount = 32;
inline constexpr std::uint16_t kUnlock = 0x0040;
inline constexpr std::uint16_t kScratchFloat = 0x0050, kScratchU32 = 0x0058, kScratchPairs = 4;
inline constexpr std::uint16_t kTraceArm[kTraces] = {0x0100, 0x0110};
inline constexpr std::uint16_t kTraceArmCount = 10, kTraceAcknowledge = 0x000C;  // the latter from the arm block on
inline constexpr std::uint16_t kResidualSelect = 0x0140;
inline constexpr std::uint16_t kLearningHold = 0x0150, kLearningReset = 0x0151;
inline constexpr std::uint16_t kStaged = 0x1000, kActive = 0x2000, kMaxTableWords = 0x1000;
inline constexpr std::uint16_t kVendor = 0x8000;

// Command words, ASCII with the first letter in the lowest byte, as CiA 301 writes "save".
inline constexpr std::uint32_t kOpen = 0x6E65706F;       // "open"
inline constexpr std::uint32_t kCheck = 0x6B656863;      // "chek"
inline constexpr std::uint32_t kSave = 0x65766173;       // "save"
inline constexpr std::uint32_t kUnlockKey = 0x6B6C6E75;  // "unlk"

// Capability bits.
inline constexpr std::uint32_t kHasFilterA = 1, kHasFilterB = 2, kHasRawTrace = 4, kHasSampleTrace = 8;
inline constexpr std::uint32_t kHasFeedForward = 16, kHasMonitor = 32, kHasResiduals = 64, kHasLearning = 128;

}  // namespace reg

namespace items {
inline constexpr RegisterType kU16 = RegisterType::kU16, kU32 = RegisterType::kU32, kF32 = RegisterType::kF32;
inline constexpr Access kRead = Access::kRead, kWrite = Access::kWrite, kBlock = Access::kWriteBlock;

constexpr Item In(int address, int count, RegisterType type, const char* name, const char* unit, const char* meaning) {
  return {name,
          RegisterKind::kInput,
          static_cast<std::uint16_t>(address),
          static_cast<std::uint16_t>(count),
          type,
          kRead,
          unit,
          meaning};
}
constexpr Item Hold(int address, int count, RegisterType type, Access access, const char* name, const char* unit,
                    const char* meaning) {
  return {name,
          RegisterKind::kHolding,
          static_cast<std::uint16_t>(address),
          static_cast<std::uint16_t>(count),
          type,
          access,
          unit,
          meaning};
}

// clang-format off
inline constexpr Item kAll[] = {
  In(0x0000, 1, kU32, "magic", "", "0x41524D43, \"ARMC\""),
  In(0x0002, 1, kU16, "map_major", "", "meaning of addresses; a client refuses another one"),
  In(0x0003, 1, kU16, "map_minor", "", "additions since the major version"),
  In(0x0004, 1, kU32, "layout_crc", "", "CRC-32 over this list (kind, address, count, type, access)"),
  In(0x0006, 1, kU32, "schema", "", "of the parameter table compiled in"),
  In(0x0008, 1, kU32, "firmware_version", "", "integrator's number"),
  In(0x000A, 1, kU32, "serial_number", "", "integrator's number"),
  In(0x000C, 1, kF32, "probe_float", "", "123456.789: word-order probe"),
  In(0x000E, 1, kU32, "probe_u32", "", "0x12345678: word-order probe"),
  In(0x0010, 1, kU16, "axes", "", "joints of the model"),
  In(0x0011, 1, kU16, "parameters", "", "entries of the parameter table"),
  In(0x0012, 1, kU16, "columns", "", "filter coordinates: estimates served"),
  In(0x0013, 1, kU16, "table_words", "", "registers of the staged and the active table"),
  In(0x0014, 1, kU32, "capabilities", "", "bits: 1 filter A, 2 filter B, 4 raw trace, 8 sample trace, 16 feed-forward, 32 monitor, 64 residual statistics, 128 learning"),
  In(0x0016, 1, kU32, "tick_rate", "Hz", "control ticks a second"),
  In(0x0018, 1, kU16, "sample_ticks", "", "control ticks of one estimator sample"),
  In(0x0019, 1, kU16, "page_data_words", "", "most registers of one trace page's data"),

  In(0x0040, 1, kU16, "transaction_state", "", "0 idle, 1 open, 2 loading, 3 checked, 4 committing, 5 active, 6 failed"),
  In(0x0041, 1, kU16, "transaction_status", "", "Status of the last command, or why it failed later"),
  In(0x0042, 1, kU16, "table_status", "", "Status: 0 a valid table is active, else why not"),
  In(0x0043, 1, kU16, "feedforward_state", "", "0 off: no valid table, 1 on, 2 cross-fading"),
  In(0x0044, 1, kU32, "generation", "", "adoptions since power-up"),
  In(0x0046, 1, kU32, "tick", "", "control ticks since power-up, wraps"),
  In(0x0048, 1, kU32, "active_crc", "", "CRC-32 over the active table's registers"),
  In(0x004A, 1, kU32, "command_sequence", "", "of the last command accepted"),
  In(0x004C, 1, kU32, "store_sequence", "", "of the stored table in force, 0: none"),
  In(0x004E, 2, kU16, "slot_state", "", "storage slots: 0 blank, 1 good, 2 other schema, 3 corrupt"),
  In(0x0050, 1, kU32, "enabled_axes", "", "bit i: axis i is enabled"),
  In(0x0052, 1, kU32, "clamp_count", "", "feed-forward values cut to their limit"),
  In(0x0054, 1, kU32, "sample_gaps", "", "samples refused because the estimator was behind"),
  In(0x0056, 1, kU32, "request_count", "", "requests handled, wraps"),
  In(0x0058, 1, kU16, "error_exception", "", "last exception code sent"),
  In(0x0059, 1, kU16, "error_function", "", "its function code"),
  In(0x005A, 1, kU16, "error_address", "", "its first register"),
  In(0x005B, 1, kU16, "error_status", "", "its Status"),
  In(0x005C, 1, kU32, "error_request", "", "request_count of that request"),
  In(0x005E, 1, kU16, "unlocked", "", "1: table commands are accepted"),
  In(0x005F, 1, kU16, "health", "", "verdict of the monitor, 0 ok; bits: 1 filter A, 2 filter B: its deviations are smaller than its innovations"),
  In(0x0060, 1, kU32, "rows_used_a", "", "rows that updated filter A since the adoption"),
  In(0x0062, 1, kU32, "rows_gated_a", "", "rows that were not admitted to filter A"),
  In(0x0064, 1, kU32, "rows_used_b", "", "as above, filter B"),
  In(0x0066, 1, kU32, "rows_gated_b", "", "as above, filter B"),

  In(0x0080, reg::kMaxJoints, kF32, "residual_rms", "N*m", "per joint: measured torque minus committed model"),
  In(0x00A0, reg::kMaxJoints, kF32, "consistency", "", "per joint: mean normalised innovation squared, 1 expected"),
  In(0x0100, reg::kMaxColumns, kF32, "estimate_a", "SI", "filter A, per column; NaN: no estimate yet"),
  In(0x0300, reg::kMaxColumns, kF32, "deviation_a", "SI", "its standard deviation"),
  In(0x0500, reg::kMaxColumns, kF32, "estimate_b", "SI", "filter B, per column; NaN: no estimate yet"),
  In(0x0700, reg::kMaxColumns, kF32, "deviation_b", "SI", "its standard deviation"),

  In(0x1000, 1, kU16, "residual_joint", "", "joint of this page, from 1; 0: none selected yet"),
  In(0x1001, 1, kU16, "residual_snapshot", "", "number of this snapshot, wraps"),
  In(0x1002, 1, kU32, "residual_generation", "", "adoption that the statistics began with"),
  In(0x1004, 1, kU32, "residual_elapsed", "s", "since that adoption"),
  In(0x1006, 1, kF32, "residual_sigma", "N*m", "torque noise of one row by the table"),
  In(0x1008, reg::kResidualBinValues, kF32, "residual_reference", "SI", "bins of the first rows, eight sums each"),
  In(0x1208, reg::kResidualBinValues, kF32, "residual_recent", "SI", "bins of the latest rows, fading"),
  In(0x1408, reg::kResidualSliceValues, kF32, "residual_history", "SI", "slices: start in s, rows, sum of squares; NaN: unused"),

#define ARMCAL_TRACE_PAGE(base, n) \
  In(base + 0x00, 1, kU32, "trace" n "_first_record", "", "number of the page's first record, counted from the arm"), \
  In(base + 0x02, 1, kU32, "trace" n "_first_tick", "", "its tick (first tick of its window)"), \
  In(base + 0x04, 1, kU32, "trace" n "_tick_step", "", "ticks from record to record inside the page"), \
  In(base + 0x06, 1, kU16, "trace" n "_count", "", "records in the page"), \
  In(base + 0x07, 1, kU16, "trace" n "_record_words", "", "registers of one record"), \
  In(base + 0x08, 1, kU32, "trace" n "_lost", "", "records refused since the arm because the ring was full"), \
  In(base + 0x0A, 1, kU16, "trace" n "_arm_number", "", "of the arm that recorded this"), \
  In(base + 0x0B, 1, kU16, "trace" n "_generation", "", "low word of the table generation of these records"), \
  In(base + 0x0C, 1, kU16, "trace" n "_state", "", "0 off, 1 waiting, 2 recording, 3 done"), \
  In(base + 0x0D, 1, kU16, "trace" n "_waiting", "", "records behind this page"), \
  In(base + 0x0E, 1, kU32, "trace" n "_channels", "", "channel mask of the arm"), \
  In(base + 0x10, reg::kPageDataCount, kU16, "trace" n "_data", "", "the page's records, one after the other")
  ARMCAL_TRACE_PAGE(0x4000, "0"),
  ARMCAL_TRACE_PAGE(0x6000, "1"),
#undef ARMCAL_TRACE_PAGE

  Hold(0x0000, 1, kU32, kBlock, "sequence", "", "client's number of this command, not 0"),
  Hold(0x0002, 1, kU32, kBlock, "command", "", "open 0x6E65706F, check 0x6B656863, save 0x65766173"),
  Hold(0x0004, 1, kU32, kBlock, "command_schema", "", "schema of the table"),
  Hold(0x0006, 1, kU16, kBlock, "command_words", "", "registers of the table"),
  Hold(0x0007, 1, kU16, kBlock, "command_reserved", "", "0"),
  Hold(0x0008, 1, kU32, kBlock, "command_crc", "", "CRC-32 over the table's registers; open: ignored"),
  Hold(0x0020, 32, kU16, kWrite, "scratch", "", "does nothing: for trying the connection"),
  Hold(0x0040, 1, kU32, kWrite, "unlock", "", "write 0x6B6C6E75; reads 1 while unlocked, else 0"),
  Hold(0x0050, 4, kF32, kWrite, "scratch_float", "", "does nothing; NaN and infinity are refused"),
  Hold(0x0058, 4, kU32, kWrite, "scratch_u32", "", "does nothing; half a value is refused"),

#define ARMCAL_TRACE_ARM(base, n) \
  Hold(base + 0x00, 1, kU16, kBlock, "trace" n "_arm", "", "client's number of this arm"), \
  Hold(base + 0x01, 1, kU16, kBlock, "trace" n "_mode", "", "0 off, 1 one-shot, 2 streaming"), \
  Hold(base + 0x02, 1, kU16, kBlock, "trace" n "_decimation", "", "samples averaged into one record, at least 1"), \
  Hold(base + 0x03, 1, kU16, kBlock, "trace" n "_reserved", "", "0"), \
  Hold(base + 0x04, 1, kU32, kBlock, "trace" n "_start_tick", "", "first tick; one that has passed starts at once"), \
  Hold(base + 0x06, 1, kU32, kBlock, "trace" n "_limit", "", "records to take, 0: until full or switched off"), \
  Hold(base + 0x08, 1, kU32, kBlock, "trace" n "_channel_mask", "", "which channels a record holds"), \
  Hold(base + 0x0C, 1, kU32, kWrite, "trace" n "_acknowledge", "", "number of the next record wanted")
  ARMCAL_TRACE_ARM(0x0100, "0"),
  ARMCAL_TRACE_ARM(0x0110, "1"),
#undef ARMCAL_TRACE_ARM

  Hold(0x0140, 1, kU16, kWrite, "residual_select", "", "joint from 1: takes a snapshot of its statistics"),

  Hold(0x0150, 1, kU16, kWrite, "learning_hold", "", "1: rows no longer change the estimates, 0: they do; needs unlock"),
  Hold(0x0151, 1, kU16, kWrite, "learning_reset", "", "joint from 1, or axes + 1 (links and what else joints share): what was known of it no longer counts; reads 0; needs unlock"),

  Hold(0x1000, reg::kMaxTableWords, kU16, kWrite, "staged_table", "", "the table being loaded"),
  Hold(0x2000, reg::kMaxTableWords, kU16, kRead, "active_table", "", "the table in force"),
};
// clang-format on
}  // namespace items

inline constexpr const auto& kItems = items::kAll;
inline constexpr int kItemCount = static_cast<int>(sizeof kItems / sizeof kItems[0]);

constexpr std::uint32_t LayoutCrc() {
  std::uint32_t crc = 0;
  for (const Item& item : kItems) {
    const std::uint8_t bytes[] = {
        static_cast<std::uint8_t>(item.kind),           static_cast<std::uint8_t>(item.address >> 8),
        static_cast<std::uint8_t>(item.address & 0xFF), static_cast<std::uint8_t>(item.count >> 8),
        static_cast<std::uint8_t>(item.count & 0xFF),   static_cast<std::uint8_t>(item.type),
        static_cast<std::uint8_t>(item.access)};
    crc = core::Crc32(bytes, sizeof bytes, crc);
  }
  return crc;
}

inline constexpr std::uint32_t kLayoutCrc = LayoutCrc();

}  // namespace armcal::link
