// client - reads and writes the registers of a drive over Modbus TCP or RTU.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "armcal/core/status.hpp"
#include "armcal/link/register_words.hpp"
#include "host_sim/client/errors.hpp"
#include "host_sim/client/serial_line.hpp"

struct _modbus;  // libmodbus' connection

namespace armcal::client {

struct Identity {
  std::uint16_t map_major, map_minor;
  std::uint32_t layout_crc, schema, firmware_version, serial_number;
  std::uint16_t axes, parameters, columns, table_words;
  std::uint32_t capabilities, tick_rate_Hz;
  std::uint16_t sample_ticks;
};

// One consistent reading of the status block (SPEC.md).
struct DriveStatus {
  link::TransactionState transaction_state;
  core::Status transaction_status, table_status;
  std::uint16_t feedforward_state;
  std::uint32_t generation, tick, active_crc, command_sequence, store_sequence;
  std::uint16_t slot_state[2];
  std::uint32_t enabled_axes, clamp_count, sample_gaps, request_count;
  std::uint16_t error_exception, error_function, error_address;
  core::Status error_status;
  std::uint32_t error_request;
  bool unlocked;
  std::uint16_t health;
  std::uint32_t rows_used[2], rows_gated[2];
};

// How long a call waits for a reply at its first attempt; later attempts wait longer, up to two seconds.
enum class Patience {
  kNormal,  // 2 s
  kShort,   // a serial line: a few times what the line needs. For replies that tell whether they are late.
};

// Every call throws LinkError after three attempts over TCP, two seconds each, or after six seconds on a serial line,
// without a sensible answer. Over TCP it connects anew between attempts; on a serial line it waits for silence first.
// So a late answer is not taken for the next one. A serial adapter that was pulled out or a drive that restarts may
// come back meanwhile: a connection that was once up is tried for six seconds. The first connection is tried once. It
// throws RefusedError, with the drive's own reason, if the drive answers with an exception. An attempt may be repeated
// because every armcal write may come twice.
class DriveClient {
 public:
  DriveClient(const std::string& host, int port, int unit = 1);
  explicit DriveClient(const SerialLine& line, int unit = 1);
  ~DriveClient();
  DriveClient(DriveClient&&) noexcept;
  DriveClient& operator=(DriveClient&&) noexcept;

  // Any number of registers. They are split into requests of at most 120.
  std::vector<std::uint16_t> ReadInput(int first, int count);
  std::vector<std::uint16_t> ReadHolding(int first, int count);
  // The same for writing. A block that must be written whole has at most 120 registers.
  void Write(int first, std::span<const std::uint16_t> words);
  void WriteSingle(int address, std::uint16_t word);  // function 6

  // Function 23, which a drive of map version 1.4 serves: writes, then reads holding registers. One request for both,
  // so at most 121 and 125 registers.
  std::vector<std::uint16_t> WriteThenRead(int write_first, std::span<const std::uint16_t> words, int read_first,
                                           int count, Patience patience);

  // The last answer belonged to an earlier request. Drops what else comes late, until a serial line is silent.
  void DropLateReplies();

  // A block or a register by its declaration (registers.hpp). `trace`: 0 or 1, for registers that exist twice.
  template <const auto& kBlock>
  link::Words<kBlock> Read(int trace = 0) {
    return link::Words<kBlock>(Read(link::SpanOf(kBlock).Of(trace)).data());
  }
  template <const link::Register& kRegister>
  link::ValueOf<kRegister> ReadValue(int trace = 0) {
    return Read<kRegister>(trace).template Get<kRegister>();
  }
  template <const auto& kBlock>
  void Write(const link::Words<kBlock>& words, int trace = 0) {
    Write(link::SpanOf(kBlock).Of(trace).first, {words.data(), words.size()});
  }
  // A value of one register is written with function 6, a 32-bit value with function 16.
  template <const link::Register& kRegister>
  void WriteValue(link::ValueOf<kRegister> value, int trace = 0) {
    link::Words<kRegister> words;
    words.template Set<kRegister>(value);
    if (words.size() == 1) return WriteSingle(link::SpanOf(kRegister).Of(trace).first, *words.data());
    Write(words, trace);
  }
  std::vector<std::uint16_t> Read(const link::Span& span);
  std::vector<float> ReadFloats(const link::Register& list, int count);

  // Throws LinkError if it is not an armcal drive, of another major map version, or its word order is not ours.
  Identity ReadIdentity();
  DriveStatus ReadStatus();

  // The serial line, if it is one.
  const std::optional<SerialLine>& line() const { return line_; }
  // Attempts that had no sensible answer, since the beginning.
  int failed_attempts() const { return failed_attempts_; }
  const std::string& name() const { return name_; }  // "host:port" or the device, for messages

 private:
  using Connection = std::unique_ptr<_modbus, void (*)(_modbus*)>;

  DriveClient(const std::string& line, int unit, std::function<_modbus*()> open);
  void Connect();
  void Request(const std::string& what, const std::function<int(_modbus*)>& call, Patience patience = Patience::kNormal,
               bool reads = false);
  void SetTimeout(Patience patience, int attempt);
  void AfterFailure(bool late);
  int QuietMs() const;
  [[noreturn]] void Refused(const std::string& what, int exception);
  std::vector<std::uint16_t> ReadWords(bool input, int first, int count);

  std::string name_;
  int unit_;
  std::function<_modbus*()> open_;
  std::optional<SerialLine> line_;
  int failed_attempts_ = 0;
  Connection connection_;
};

}  // namespace armcal::client
