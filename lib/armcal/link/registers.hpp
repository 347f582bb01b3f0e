// link - the register map: each register is declared here once, and everything else about it follows from that.
//
// The declarations make the tables of SPEC.md, the JSON for tools, the offset at which a drive puts a value and the
// offset at which a client finds it. Addresses are zero-based PDU addresses. A 32-bit value takes two registers, high
// word first ("ABCD"). Values are in SI units; there are no scaling factors. An address never changes its meaning
// inside a major version. Addresses 0x8000-0xFFFF of both kinds belong to the integrator.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "armcal/core/crc.hpp"

namespace armcal::link {

enum class RegisterKind : std::uint8_t { kInput = 4, kHolding = 3 };  // the numbers are the reading function codes
enum class RegisterType : std::uint8_t { kU16 = 1, kU32 = 2, kF32 = 3 };
enum class Access : std::uint8_t { kRead, kWrite, kWriteBlock };  // kWriteBlock: only the whole block in one request

constexpr std::uint16_t WordsOf(RegisterType type) { return type == RegisterType::kU16 ? 1 : 2; }

// The values that a client may write. If no range is given, any value of the type, and of floats any finite one.
struct Range {
  bool given = false;
  double low = 0.0, high = 0.0;
};

// One declaration: `count` elements of `type` from `address` on. A device serves as many elements as it has. A register
// with a second name exists twice: the first is for trace 0, and the one for trace 1 lies `stride` registers further
// on.
struct Register {
  const char* name = "";
  RegisterKind kind = RegisterKind::kInput;
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  RegisterType type = RegisterType::kU16;
  Access access = Access::kRead;
  const char* unit = "";
  const char* meaning = "";
  Range range = {};
  const char* second_name = nullptr;
  std::uint16_t stride = 0;
};

// A run of words: one register, or a block of registers that follow each other without a gap.
struct Span {
  RegisterKind kind;
  std::uint16_t first;
  std::uint16_t count;
  RegisterType type;  // of the first register
  Access access;
  std::uint16_t stride;

  constexpr std::uint16_t end() const { return static_cast<std::uint16_t>(first + count); }
  // The same run of trace 0 or 1.
  constexpr Span Of(int trace) const {
    return {kind, static_cast<std::uint16_t>(first + trace * stride), count, type, access, stride};
  }
};

constexpr Span SpanOf(const Span& span) { return span; }
constexpr Span SpanOf(const Register& r, int elements) {
  return {r.kind, r.address, static_cast<std::uint16_t>(elements * WordsOf(r.type)), r.type, r.access, r.stride};
}
constexpr Span SpanOf(const Register& r) { return SpanOf(r, r.count); }
constexpr Span Between(const Register& first, const Register& last) {
  return {first.kind, first.address, static_cast<std::uint16_t>(SpanOf(last).end() - first.address),
          first.type, first.access,  first.stride};
}
// The address of a later word of a register that has several, for example of one element of a list.
constexpr std::uint16_t operator+(const Register& r, int words) {
  return static_cast<std::uint16_t>(r.address + words);
}

namespace declare {
inline constexpr RegisterType kU16 = RegisterType::kU16, kU32 = RegisterType::kU32, kF32 = RegisterType::kF32;
inline constexpr Access kRead = Access::kRead, kWrite = Access::kWrite, kBlock = Access::kWriteBlock;

constexpr Register Make(RegisterKind kind, int address, int count, RegisterType type, Access access, const char* name,
                        const char* unit, const char* meaning) {
  Register r;
  r.name = name, r.unit = unit, r.meaning = meaning;
  r.kind = kind, r.type = type, r.access = access;
  r.address = static_cast<std::uint16_t>(address), r.count = static_cast<std::uint16_t>(count);
  return r;
}
constexpr Register In(int address, int count, RegisterType type, const char* name, const char* unit,
                      const char* meaning) {
  return Make(RegisterKind::kInput, address, count, type, kRead, name, unit, meaning);
}
constexpr Register Hold(int address, int count, RegisterType type, Access access, const char* name, const char* unit,
                        const char* meaning) {
  return Make(RegisterKind::kHolding, address, count, type, access, name, unit, meaning);
}
constexpr Register Twice(Register r, const char* second_name, std::uint16_t stride) {
  r.second_name = second_name, r.stride = stride;
  return r;
}
constexpr Register Within(double low, double high, Register r) {
  r.range = {true, low, high};
  return r;
}
constexpr std::uint16_t kPageStride = 0x2000, kStartStride = 0x0010;  // from trace 0 to trace 1
}  // namespace declare

namespace reg {

// The most that there can be.
inline constexpr std::uint16_t kMaxJoints = 16, kMaxColumns = 256, kMaxTableWords = 0x1000, kMaxPageWords = 0x1F00;
inline constexpr std::uint16_t kScratchWords = 32, kScratchValues = 4;
inline constexpr std::uint16_t kResidualSignals = 4, kResidualQuarters = 4, kResidualSums = 8, kResidualSlices = 32;
inline constexpr std::uint16_t kResidualBinValues = kResidualSignals * 2 * kResidualQuarters * kResidualSums;
inline constexpr std::uint16_t kResidualSliceValues = 3 * kResidualSlices;
inline constexpr std::uint16_t kResidualValues = 2 * kResidualBinValues + kResidualSliceValues;
inline constexpr std::uint16_t kWindowWords = 114;  // with its header they fill one reply
inline constexpr std::uint16_t kLogEvents = 32, kLongestTrial_s = 3600, kUsualTrial_s = 600;
inline constexpr int kTraces = 2;  // 0 raw samples, 1 processed samples
inline constexpr std::uint16_t kVendor = 0x8000;

// Values that never change.
inline constexpr std::uint32_t kMagicValue = 0x41524D43;  // "ARMC"
inline constexpr std::uint16_t kMapMajorValue = 1, kMapMinorValue = 6;
inline constexpr float kProbeFloatValue = 123456.789f;  // reads 123456.79 only with the right word order
inline constexpr std::uint32_t kProbeU32Value = 0x12345678;

// Command words: ASCII with the first letter in the lowest byte, as CiA 301 writes "save".
inline constexpr std::uint32_t kOpen = 0x6E65706F;       // "open"
inline constexpr std::uint32_t kCheck = 0x6B656863;      // "chek"
inline constexpr std::uint32_t kSave = 0x65766173;       // "save"
inline constexpr std::uint32_t kTrial = 0x61697274;      // "tria"
inline constexpr std::uint32_t kConfirm = 0x666E6F63;    // "conf"
inline constexpr std::uint32_t kBack = 0x6B636162;       // "back"
inline constexpr std::uint32_t kLoad = 0x64616F6C;       // "load"
inline constexpr std::uint32_t kUnlockKey = 0x6B6C6E75;  // "unlk"

// Bits of `capabilities`.
inline constexpr std::uint32_t kHasFilterA = 1, kHasFilterB = 2, kHasRawTrace = 4, kHasSampleTrace = 8;
inline constexpr std::uint32_t kHasFeedForward = 16, kHasMonitor = 32, kHasResiduals = 64, kHasLearning = 128,
                               kHasPacked = 256;

// clang-format off
using namespace declare;

// Identity: what the device is.
inline constexpr Register kMagic = In(0x0000, 1, kU32, "magic", "", "0x41524D43, \"ARMC\"");
inline constexpr Register kMapMajor = In(0x0002, 1, kU16, "map_major", "", "meaning of addresses; a client refuses another one");
inline constexpr Register kMapMinor = In(0x0003, 1, kU16, "map_minor", "", "additions since the major version");
inline constexpr Register kLayoutCrc = In(0x0004, 1, kU32, "layout_crc", "", "CRC-32 over this list (kind, address, count, type, access)");
inline constexpr Register kSchema = In(0x0006, 1, kU32, "schema", "", "of the parameter table compiled in");
inline constexpr Register kFirmwareVersion = In(0x0008, 1, kU32, "firmware_version", "", "integrator's number");
inline constexpr Register kSerialNumber = In(0x000A, 1, kU32, "serial_number", "", "integrator's number");
inline constexpr Register kProbeFloat = In(0x000C, 1, kF32, "probe_float", "", "123456.789: word-order probe");
inline constexpr Register kProbeU32 = In(0x000E, 1, kU32, "probe_u32", "", "0x12345678: word-order probe");
inline constexpr Register kAxes = In(0x0010, 1, kU16, "axes", "", "joints of the model");
inline constexpr Register kParameters = In(0x0011, 1, kU16, "parameters", "", "entries of the parameter table");
inline constexpr Register kColumns = In(0x0012, 1, kU16, "columns", "", "filter coordinates: estimates served");
inline constexpr Register kTableWords = In(0x0013, 1, kU16, "table_words", "", "registers of a table of layout version 1");
inline constexpr Register kCapabilities = In(0x0014, 1, kU32, "capabilities", "", "bits: 1 filter A, 2 filter B, 4 raw trace, 8 sample trace, 16 feed-forward, 32 monitor, 64 residual statistics, 128 learning, 256 packed raw records");
inline constexpr Register kTickRate = In(0x0016, 1, kU32, "tick_rate", "Hz", "control ticks a second");
inline constexpr Register kSampleTicks = In(0x0018, 1, kU16, "sample_ticks", "", "control ticks of one estimator sample");
inline constexpr Register kPageDataWords = In(0x0019, 1, kU16, "page_data_words", "", "most registers of one trace page's data");
inline constexpr Span kIdentityBlock = Between(kMagic, kPageDataWords);
// Outside of the block, so that what `overview` copies keeps its places.
inline constexpr Register kLibraryVersion = In(0x001A, 1, kU32, "library_version", "", "of armcal in the firmware, a byte each for major, minor and patch: 0x010203 is 1.2.3");

// Status: what the device does now, and the last request that it refused.
inline constexpr Register kTransactionState = In(0x0040, 1, kU16, "transaction_state", "", "0 idle, 1 open, 2 loading, 3 checked, 4 committing, 5 active, 6 failed, 7 on trial");
inline constexpr Register kTransactionStatus = In(0x0041, 1, kU16, "transaction_status", "", "Status of the last command, or why it failed later");
inline constexpr Register kTableStatus = In(0x0042, 1, kU16, "table_status", "", "Status: 0 a valid table is active, else why not");
inline constexpr Register kFeedForwardState = In(0x0043, 1, kU16, "feedforward_state", "", "0 off: no valid table, 1 on, 2 cross-fading");
inline constexpr Register kGeneration = In(0x0044, 1, kU32, "generation", "", "adoptions since power-up");
inline constexpr Register kTick = In(0x0046, 1, kU32, "tick", "", "control ticks since power-up, wraps");
inline constexpr Register kActiveCrc = In(0x0048, 1, kU32, "active_crc", "", "CRC-32 over the active table's registers");
inline constexpr Register kCommandSequence = In(0x004A, 1, kU32, "command_sequence", "", "of the last command accepted");
inline constexpr Register kStoreSequence = In(0x004C, 1, kU32, "store_sequence", "", "of the stored table in force, 0: none");
inline constexpr Register kSlotState = In(0x004E, 2, kU16, "slot_state", "", "storage slots: 0 blank, 1 good, 2 other schema, 3 corrupt, 4 refused at boot");
inline constexpr Register kEnabledAxes = In(0x0050, 1, kU32, "enabled_axes", "", "bit i: axis i is enabled");
inline constexpr Register kClampCount = In(0x0052, 1, kU32, "clamp_count", "", "feed-forward values cut to their limit");
inline constexpr Register kSampleGaps = In(0x0054, 1, kU32, "sample_gaps", "", "samples refused because the estimator was behind");
inline constexpr Register kRequestCount = In(0x0056, 1, kU32, "request_count", "", "requests handled, wraps");
inline constexpr Register kErrorException = In(0x0058, 1, kU16, "error_exception", "", "last exception code sent");
inline constexpr Register kErrorFunction = In(0x0059, 1, kU16, "error_function", "", "its function code");
inline constexpr Register kErrorAddress = In(0x005A, 1, kU16, "error_address", "", "its first register");
inline constexpr Register kErrorStatus = In(0x005B, 1, kU16, "error_status", "", "its Status");
inline constexpr Register kErrorRequest = In(0x005C, 1, kU32, "error_request", "", "request_count of that request");
inline constexpr Register kUnlocked = In(0x005E, 1, kU16, "unlocked", "", "1: table commands are accepted from this connection");
inline constexpr Register kHealth = In(0x005F, 1, kU16, "health", "", "result of the monitor, 0 ok; bits: 1 filter A, 2 filter B: its deviations are smaller than its innovations");
inline constexpr Register kRowsUsedA = In(0x0060, 1, kU32, "rows_used_a", "", "rows that updated filter A since the adoption");
inline constexpr Register kRowsGatedA = In(0x0062, 1, kU32, "rows_gated_a", "", "rows that were not admitted to filter A");
inline constexpr Register kRowsUsedB = In(0x0064, 1, kU32, "rows_used_b", "", "as above, filter B");
inline constexpr Register kRowsGatedB = In(0x0066, 1, kU32, "rows_gated_b", "", "as above, filter B");
inline constexpr Span kStatusBlock = Between(kTransactionState, kRowsGatedB);
inline constexpr Register kRowsOutsideA = In(0x0068, 1, kU32, "rows_outside_a", "", "rows in motion that the row gate kept from filter A since the adoption");
inline constexpr Register kRowsOutsideB = In(0x006A, 1, kU32, "rows_outside_b", "", "as above, filter B");
inline constexpr Register kImplausibleTicks = In(0x006C, 1, kU32, "implausible_ticks", "", "ticks with a count, current or time stamp that cannot be right");
inline constexpr Register kTableFallbacks = In(0x006E, 1, kU32, "table_fallbacks", "", "stored tables passed over since power-up: not readable any more, or refused at boot");
inline constexpr Span kDoubtBlock = Between(kRowsOutsideA, kTableFallbacks);
// Writing: why the last table was refused, who may write, and how long the board wants to wait.
inline constexpr Register kRefusedStatus = In(0x0070, 1, kU16, "refused_status", "", "Status of the last check, 0: the table was accepted");
inline constexpr Register kRefusedWord = In(0x0071, 1, kU16, "refused_word", "", "word of the table that it refused, from 0; 0xFFFF: no single one");
inline constexpr Register kRefusedValue = In(0x0072, 1, kF32, "refused_value", "SI", "the number in that word; for friction the braking torque of the joint, N*m");
inline constexpr Register kRefusedBound = In(0x0074, 1, kF32, "refused_bound", "SI", "the limit that it must keep; for a word of bits the bits that may be set");
inline constexpr Register kWriterSeat = In(0x0076, 1, kU16, "writer_seat", "", "0 free, 1 this connection writes, 2 another one does");
inline constexpr Register kSaveWait = In(0x0077, 1, kU16, "save_wait", "s", "until the board allows the next save, 0: now");
inline constexpr Span kWritingBlock = Between(kRefusedStatus, kSaveWait);
inline constexpr Register kTableRoom = In(0x0078, 1, kU16, "table_room", "", "registers of the longest table that the drive takes, of layout version 2");
inline constexpr Register kActiveWords = In(0x0079, 1, kU16, "active_words", "", "registers of the table in force");
inline constexpr Register kWritingAllowed = In(0x007A, 1, kU16, "writing_allowed", "", "1: the board lets clients write, 0: it refuses, for example by a key switch");
inline constexpr Register kTrialLeft = In(0x007B, 1, kU16, "trial_left", "s", "until the trial of a table ends, 0: there is none");
inline constexpr Register kSigningCounter = In(0x007C, 1, kU32, "signing_counter", "", "highest counter of a signed table; the next one needs a higher one");
inline constexpr Register kSigning = In(0x007E, 1, kU16, "signing", "", "how a table must be signed: 0 it need not, 1 HMAC-SHA256, 2 in the board's own way");
inline constexpr Span kTableBlock = Between(kTableRoom, kSigning);
inline constexpr Span kErrorBlock = Between(kErrorException, kErrorStatus);

// Estimates: lists of floats, one a joint or one a column.
inline constexpr Register kResidualRms = In(0x0080, kMaxJoints, kF32, "residual_rms", "N*m", "per joint: measured torque minus committed model");
inline constexpr Register kConsistency = In(0x00A0, kMaxJoints, kF32, "consistency", "", "per joint: mean normalised innovation squared, 1 expected");
inline constexpr Register kEstimateA = In(0x0100, kMaxColumns, kF32, "estimate_a", "SI", "filter A, per column; 0 before the first read-out");
inline constexpr Register kDeviationA = In(0x0300, kMaxColumns, kF32, "deviation_a", "SI", "its standard deviation");
inline constexpr Register kEstimateB = In(0x0500, kMaxColumns, kF32, "estimate_b", "SI", "filter B, per column; 0 before the first read-out");
inline constexpr Register kDeviationB = In(0x0700, kMaxColumns, kF32, "deviation_b", "SI", "its standard deviation");

// Residual statistics of one joint: a header, then values, without a gap.
inline constexpr Register kResidualJoint = In(0x1000, 1, kU16, "residual_joint", "", "joint of this page, from 1; 0: none selected yet");
inline constexpr Register kResidualSnapshot = In(0x1001, 1, kU16, "residual_snapshot", "", "number of this snapshot, wraps");
inline constexpr Register kResidualGeneration = In(0x1002, 1, kU32, "residual_generation", "", "adoption that the statistics began with");
inline constexpr Register kResidualElapsed = In(0x1004, 1, kU32, "residual_elapsed", "s", "since that adoption");
inline constexpr Register kResidualSigma = In(0x1006, 1, kF32, "residual_sigma", "N*m", "torque noise of one row by the table");
inline constexpr Register kResidualReference = In(0x1008, kResidualBinValues, kF32, "residual_reference", "SI", "bins of the first rows, eight sums each");
inline constexpr Register kResidualRecent = In(0x1208, kResidualBinValues, kF32, "residual_recent", "SI", "bins of the latest rows, fading");
inline constexpr Register kResidualHistory = In(0x1408, kResidualSliceValues, kF32, "residual_history", "SI", "slices: start in s, rows, sum of squares; NaN: unused");
inline constexpr Span kResidualHeaderBlock = Between(kResidualJoint, kResidualSigma);
inline constexpr Span kResidualValuesBlock = Between(kResidualReference, kResidualHistory);

// The identity and everything about the state, for one request.
inline constexpr Register kOverview = In(0x0C00, kIdentityBlock.count + kWritingBlock.end() - kStatusBlock.first, kU16, "overview", "", "copy of 0x0000-0x0019, and behind it of 0x0040-0x0077");

// The last events of the table. Event number k, from 0, lies in element k modulo 32.
inline constexpr Register kLogCount = In(0x0D00, 1, kU32, "log_count", "", "table events since power-up");
inline constexpr Register kLogTick = In(0x0D02, kLogEvents, kU32, "log_tick", "", "tick of each event; event number k, from 0, lies in element k modulo 32");
inline constexpr Register kLogConnection = In(0x0D42, kLogEvents, kU32, "log_connection", "", "connection that asked, 0: the drive itself");
inline constexpr Register kLogCommand = In(0x0D82, kLogEvents, kU32, "log_command", "", "command word; also boot 0x746F6F62, drop 0x706F7264");
inline constexpr Register kLogStatus = In(0x0DC2, kLogEvents, kU16, "log_status", "", "Status of its answer or end");
inline constexpr Span kLogBlock = Between(kLogCount, kLogStatus);

// A page of a trace: a header, then records. The names trace0_arm and trace0_arm_number mean the recording. Programs use them, so they stay.
inline constexpr Register kTraceFirstRecord = Twice(In(0x4000, 1, kU32, "trace0_first_record", "", "number of the page's first record, counted from the start of the recording"), "trace1_first_record", kPageStride);
inline constexpr Register kTraceFirstTick = Twice(In(0x4002, 1, kU32, "trace0_first_tick", "", "its tick (first tick of its window)"), "trace1_first_tick", kPageStride);
inline constexpr Register kTraceTickStep = Twice(In(0x4004, 1, kU32, "trace0_tick_step", "", "ticks from record to record inside the page"), "trace1_tick_step", kPageStride);
inline constexpr Register kTraceCount = Twice(In(0x4006, 1, kU16, "trace0_count", "", "records in the page"), "trace1_count", kPageStride);
inline constexpr Register kTraceRecordWords = Twice(In(0x4007, 1, kU16, "trace0_record_words", "", "registers of one record"), "trace1_record_words", kPageStride);
inline constexpr Register kTraceLost = Twice(In(0x4008, 1, kU32, "trace0_lost", "", "records of this recording that were refused because the ring was full"), "trace1_lost", kPageStride);
inline constexpr Register kTracePageRecording = Twice(In(0x400A, 1, kU16, "trace0_arm_number", "", "number of the recording that this page belongs to"), "trace1_arm_number", kPageStride);
inline constexpr Register kTraceGeneration = Twice(In(0x400B, 1, kU16, "trace0_generation", "", "low word of the table generation of these records"), "trace1_generation", kPageStride);
inline constexpr Register kTraceState = Twice(In(0x400C, 1, kU16, "trace0_state", "", "0 off, 1 waiting, 2 recording, 3 done"), "trace1_state", kPageStride);
inline constexpr Register kTraceWaiting = Twice(In(0x400D, 1, kU16, "trace0_waiting", "", "records behind this page"), "trace1_waiting", kPageStride);
inline constexpr Register kTraceChannels = Twice(In(0x400E, 1, kU32, "trace0_channels", "", "channel mask of the recording"), "trace1_channels", kPageStride);
inline constexpr Register kTraceData = Twice(In(0x4010, kMaxPageWords, kU16, "trace0_data", "", "the page's records, one after the other"), "trace1_data", kPageStride);
inline constexpr Span kTracePageBlock = Between(kTraceFirstRecord, kTraceChannels);

// The same page for a slow line: a short header and the first records, which one request of function 23 acknowledges and reads.
inline constexpr Register kWindowFirstRecord = Twice(Hold(0x4000, 1, kU32, kRead, "trace0_window_first_record", "", "as trace0_first_record"), "trace1_window_first_record", kPageStride);
inline constexpr Register kWindowFirstTick = Twice(Hold(0x4002, 1, kU32, kRead, "trace0_window_first_tick", "", "as trace0_first_tick"), "trace1_window_first_tick", kPageStride);
inline constexpr Register kWindowLost = Twice(Hold(0x4004, 1, kU32, kRead, "trace0_window_lost", "", "as trace0_lost"), "trace1_window_lost", kPageStride);
inline constexpr Register kWindowCount = Twice(Hold(0x4006, 1, kU16, kRead, "trace0_window_count", "", "records of the page that lie whole in the window"), "trace1_window_count", kPageStride);
inline constexpr Register kWindowRecording = Twice(Hold(0x4007, 1, kU16, kRead, "trace0_window_arm_number", "", "as trace0_arm_number"), "trace1_window_arm_number", kPageStride);
inline constexpr Register kWindowGeneration = Twice(Hold(0x4008, 1, kU16, kRead, "trace0_window_generation", "", "as trace0_generation"), "trace1_window_generation", kPageStride);
inline constexpr Register kWindowState = Twice(Hold(0x4009, 1, kU16, kRead, "trace0_window_state", "", "as trace0_state"), "trace1_window_state", kPageStride);
inline constexpr Register kWindowWaiting = Twice(Hold(0x400A, 1, kU16, kRead, "trace0_window_waiting", "", "records behind these"), "trace1_window_waiting", kPageStride);
inline constexpr Register kWindowData = Twice(Hold(0x400B, kWindowWords, kU16, kRead, "trace0_window_data", "", "the page's first records; 0 behind the page's end"), "trace1_window_data", kPageStride);
inline constexpr Span kWindowHeader = Between(kWindowFirstRecord, kWindowWaiting);
inline constexpr Span kWindowBlock = Between(kWindowFirstRecord, kWindowData);

// A command of a table transaction.
inline constexpr Register kSequence = Within(1, 4294967295.0, Hold(0x0000, 1, kU32, kBlock, "sequence", "", "client's number of this command, not 0"));
inline constexpr Register kCommand = Hold(0x0002, 1, kU32, kBlock, "command", "", "open 0x6E65706F, check 0x6B656863, save 0x65766173, trial 0x61697274, confirm 0x666E6F63, back 0x6B636162, load 0x64616F6C");
inline constexpr Register kCommandSchema = Hold(0x0004, 1, kU32, kBlock, "command_schema", "", "schema of the table");
inline constexpr Register kCommandWords = Within(1, kMaxTableWords, Hold(0x0006, 1, kU16, kBlock, "command_words", "", "registers of the table"));
inline constexpr Register kCommandReserved = Within(0, 0, Hold(0x0007, 1, kU16, kBlock, "command_reserved", "", "0"));
inline constexpr Register kCommandCrc = Hold(0x0008, 1, kU32, kBlock, "command_crc", "", "CRC-32 over the table's registers; open, back, load: ignored");
inline constexpr Span kCommandBlock = Between(kSequence, kCommandCrc);

// The session's lock, and registers for trying the connection.
inline constexpr Register kScratch = Hold(0x0020, kScratchWords, kU16, kWrite, "scratch", "", "does nothing: for trying the connection");
inline constexpr Register kUnlock = Hold(0x0040, 1, kU32, kWrite, "unlock", "", "write 0x6B6C6E75, or 0 to give the seat up; reads 1 while this connection has unlocked, else 0");
inline constexpr Register kTrialLimit = Within(1, kLongestTrial_s, Hold(0x0048, 1, kU16, kWrite, "trial_limit", "s", "how long the next trial may last; open sets 600; needs unlock"));
inline constexpr Register kScratchFloat = Hold(0x0050, kScratchValues, kF32, kWrite, "scratch_float", "", "does nothing; NaN and infinity are refused");
inline constexpr Register kScratchU32 = Hold(0x0058, kScratchValues, kU32, kWrite, "scratch_u32", "", "does nothing; half a value is refused");

// These start a recording and release its pages.
inline constexpr Register kTraceRecording = Twice(Hold(0x0100, 1, kU16, kBlock, "trace0_arm", "", "client's number of this recording"), "trace1_arm", kStartStride);
inline constexpr Register kTraceMode = Twice(Within(0, 2, Hold(0x0101, 1, kU16, kBlock, "trace0_mode", "", "0 off, 1 one-shot, 2 streaming")), "trace1_mode", kStartStride);
inline constexpr Register kTraceDecimation = Twice(Within(1, 65535, Hold(0x0102, 1, kU16, kBlock, "trace0_decimation", "", "samples for one record, at least 1: averaged in trace 0, the last one in trace 1")), "trace1_decimation", kStartStride);
inline constexpr Register kTraceReserved = Twice(Within(0, 0, Hold(0x0103, 1, kU16, kBlock, "trace0_reserved", "", "0")), "trace1_reserved", kStartStride);
inline constexpr Register kTraceStartTick = Twice(Hold(0x0104, 1, kU32, kBlock, "trace0_start_tick", "", "first tick; one that has passed starts at once"), "trace1_start_tick", kStartStride);
inline constexpr Register kTraceLimit = Twice(Hold(0x0106, 1, kU32, kBlock, "trace0_limit", "", "records to take, 0: until full or switched off"), "trace1_limit", kStartStride);
inline constexpr Register kTraceChannelMask = Twice(Hold(0x0108, 1, kU32, kBlock, "trace0_channel_mask", "", "which channels a record holds"), "trace1_channel_mask", kStartStride);
inline constexpr Register kTraceAcknowledge = Twice(Hold(0x010C, 1, kU32, kWrite, "trace0_acknowledge", "", "number of the next record wanted"), "trace1_acknowledge", kStartStride);
inline constexpr Span kTraceStartBlock = Between(kTraceRecording, kTraceChannelMask);

// Residual statistics, learning, and the two tables.
inline constexpr Register kResidualSelect = Within(1, kMaxJoints, Hold(0x0140, 1, kU16, kWrite, "residual_select", "", "joint, 1 to axes: takes a snapshot of its statistics"));
inline constexpr Register kLearningHold = Within(0, 1, Hold(0x0150, 1, kU16, kWrite, "learning_hold", "", "1: rows no longer change the estimates, 0: they do; needs unlock"));
inline constexpr Register kLearningReset = Within(1, kMaxJoints + 1, Hold(0x0151, 1, kU16, kWrite, "learning_reset", "", "joint from 1, or axes + 1 (links and what else joints share): what was known of it no longer counts; reads 0; needs unlock"));
inline constexpr Register kStagedTable = Hold(0x1000, kMaxTableWords, kU16, kWrite, "staged_table", "", "the table being loaded");
inline constexpr Register kActiveTable = Hold(0x2000, kMaxTableWords, kU16, kRead, "active_table", "", "the table in force");

// Every register above must be in this list. For a register inside a block that the static_assert below names, the
// compiler finds an omission. For all others a test finds it.
inline constexpr const Register* kDeclared[] = {
  &kMagic, &kMapMajor, &kMapMinor, &kLayoutCrc, &kSchema, &kFirmwareVersion, &kSerialNumber, &kProbeFloat, &kProbeU32, &kAxes,
  &kParameters, &kColumns, &kTableWords, &kCapabilities, &kTickRate, &kSampleTicks, &kPageDataWords, &kLibraryVersion,
  &kTransactionState, &kTransactionStatus, &kTableStatus, &kFeedForwardState, &kGeneration, &kTick, &kActiveCrc, &kCommandSequence,
  &kStoreSequence, &kSlotState, &kEnabledAxes, &kClampCount, &kSampleGaps, &kRequestCount, &kErrorException, &kErrorFunction,
  &kErrorAddress, &kErrorStatus, &kErrorRequest, &kUnlocked, &kHealth, &kRowsUsedA, &kRowsGatedA, &kRowsUsedB, &kRowsGatedB,
  &kRowsOutsideA, &kRowsOutsideB, &kImplausibleTicks, &kTableFallbacks,
  &kRefusedStatus, &kRefusedWord, &kRefusedValue, &kRefusedBound, &kWriterSeat, &kSaveWait,
  &kTableRoom, &kActiveWords, &kWritingAllowed, &kTrialLeft, &kTrialLimit, &kSigningCounter, &kSigning,
  &kLogCount, &kLogTick, &kLogConnection, &kLogCommand, &kLogStatus,
  &kResidualRms, &kConsistency, &kEstimateA, &kDeviationA, &kEstimateB, &kDeviationB,
  &kResidualJoint, &kResidualSnapshot, &kResidualGeneration, &kResidualElapsed, &kResidualSigma, &kResidualReference, &kResidualRecent,
  &kResidualHistory,
  &kTraceFirstRecord, &kTraceFirstTick, &kTraceTickStep, &kTraceCount, &kTraceRecordWords, &kTraceLost, &kTracePageRecording,
  &kTraceGeneration, &kTraceState, &kTraceWaiting, &kTraceChannels, &kTraceData, &kOverview,
  &kWindowFirstRecord, &kWindowFirstTick, &kWindowLost, &kWindowCount, &kWindowRecording, &kWindowGeneration, &kWindowState,
  &kWindowWaiting, &kWindowData,
  &kSequence, &kCommand, &kCommandSchema, &kCommandWords, &kCommandReserved, &kCommandCrc,
  &kScratch, &kUnlock, &kScratchFloat, &kScratchU32,
  &kTraceRecording, &kTraceMode, &kTraceDecimation, &kTraceReserved, &kTraceStartTick, &kTraceLimit, &kTraceChannelMask,
  &kTraceAcknowledge, &kResidualSelect, &kLearningHold, &kLearningReset, &kStagedTable, &kActiveTable,
};
// clang-format on

}  // namespace reg

// The values of `transaction_state`, `trace0_mode` and `trace0_state`.
enum class TransactionState : std::uint16_t {
  kIdle = 0,
  kOpen = 1,        // nothing staged yet
  kLoading = 2,     // something staged
  kChecked = 3,     // checksum and content accepted
  kCommitting = 4,  // being stored, then adopted
  kActive = 5,      // the staged table is stored and in force
  kFailed = 6,      // the table before the staged one is stored and in force
  kOnTrial = 7,     // the staged table is in force; the table before it is stored
};
enum class TraceMode : std::uint16_t { kOff = 0, kOneShot = 1, kStreaming = 2 };
enum class TraceState : std::uint16_t { kOff = 0, kWaiting = 1, kRecording = 2, kDone = 3 };

namespace internal {

constexpr int CountWithSecond() {
  int count = 0;
  for (const Register* r : reg::kDeclared) count += r->second_name == nullptr ? 1 : 2;
  return count;
}

constexpr bool Before(const Register& a, const Register& b) {
  return a.kind == b.kind ? a.address < b.address : a.kind == RegisterKind::kInput;
}

// In the order of the wire: input registers first, and each kind by address.
constexpr std::array<Register, CountWithSecond()> EveryRegister() {
  std::array<Register, CountWithSecond()> all{};
  std::size_t count = 0;
  const auto insert = [&](const Register& r) {
    std::size_t at = count++;
    for (; at > 0 && Before(r, all[at - 1]); --at) all[at] = all[at - 1];
    all[at] = r;
  };
  for (const Register* declared : reg::kDeclared) {
    Register r = *declared;
    insert(r);
    if (r.second_name == nullptr) continue;
    r.name = r.second_name;
    r.address = static_cast<std::uint16_t>(r.address + r.stride);
    insert(r);
  }
  return all;
}

}  // namespace internal

// The whole map, with one entry for each name.
inline constexpr auto kRegisters = internal::EveryRegister();

namespace internal {

constexpr bool NoneOverlap() {
  for (std::size_t i = 1; i < kRegisters.size(); ++i)
    if (kRegisters[i - 1].kind == kRegisters[i].kind && SpanOf(kRegisters[i - 1]).end() > kRegisters[i].address)
      return false;
  return true;
}
static_assert(NoneOverlap(), "two registers share an address");

// True if every word of the block belongs to a register of the map that has the block's kind and access.
constexpr bool IsWhole(const Span& block) {
  std::uint32_t at = block.first;
  for (const Register& r : kRegisters)
    if (r.kind == block.kind && r.access == block.access && r.address == at && at < block.end()) at = SpanOf(r).end();
  return at == block.end();
}
static_assert(IsWhole(reg::kIdentityBlock) && IsWhole(reg::kStatusBlock) && IsWhole(reg::kDoubtBlock) &&
                  IsWhole(reg::kWritingBlock) && IsWhole(reg::kTableBlock) && IsWhole(reg::kLogBlock) &&
                  IsWhole(reg::kErrorBlock) && IsWhole(reg::kResidualHeaderBlock) &&
                  IsWhole(reg::kResidualValuesBlock) && IsWhole(reg::kTracePageBlock) && IsWhole(reg::kCommandBlock) &&
                  IsWhole(reg::kWindowHeader) && IsWhole(reg::kWindowBlock) && IsWhole(reg::kTraceStartBlock),
              "a block has a gap, or a register of it is not listed in kDeclared");

constexpr std::uint32_t LayoutCrc() {
  std::uint32_t crc = 0;
  for (const Register& r : kRegisters) {
    const std::uint8_t bytes[] = {
        static_cast<std::uint8_t>(r.kind),           static_cast<std::uint8_t>(r.address >> 8),
        static_cast<std::uint8_t>(r.address & 0xFF), static_cast<std::uint8_t>(r.count >> 8),
        static_cast<std::uint8_t>(r.count & 0xFF),   static_cast<std::uint8_t>(r.type),
        static_cast<std::uint8_t>(r.access)};
    crc = core::Crc32(bytes, sizeof bytes, crc);
  }
  return crc;
}

}  // namespace internal

inline constexpr std::uint32_t kLayoutCrc = internal::LayoutCrc();

}  // namespace armcal::link
