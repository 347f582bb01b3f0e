// client - calls libmodbus with time-outs and retries, and gives the reason of a failure.
#include "host_sim/client/drive_client.hpp"

#include <fmt/core.h>
#include <modbus.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "armcal/core/words.hpp"
#include "host_sim/client/register_text.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {

constexpr int kChunk = 120;  // below the protocol's 123, and even, so that no request splits a 32-bit value
constexpr auto kBudget = std::chrono::seconds(6);        // for a request with all its attempts
constexpr auto kPause = std::chrono::milliseconds(200);  // before a connection that was refused is tried again
constexpr int kTcpAttempts = 3;
constexpr double kResponse_s = 2.0;
constexpr int kFrameBytes = 256;         // the longest
constexpr int kLongestPause_ms = 30;     // inside what comes from a serial line: adapters hand bytes on every 16 ms
constexpr int kByteTimeout_us = 100000;  // inside a reply, on a serial line

void CloseAndFree(_modbus* connection) {
  SetExclusive(modbus_get_socket(connection), false);  // nothing on a socket
  modbus_close(connection);
  modbus_free(connection);
}

// libmodbus calls a host that nobody knows "Connection refused", too.
_modbus* ToHost(const std::string& host, const std::string& port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0)
    throw LinkError(fmt::format("{}: cannot find this host: {}; check the name, or give its IP address", host,
                                gai_strerror(error)));
  freeaddrinfo(found);
  return modbus_new_tcp_pi(host.c_str(), port.c_str());
}

// 1 to 11 if `error` is a Modbus exception, else 0.
int ExceptionCode(int error) {
  const int code = error - MODBUS_ENOBASE;
  return code >= 1 && code < MODBUS_EXCEPTION_MAX ? code : 0;
}

// What a person can do about a refusal; empty where the reason says it.
const char* Remedy(core::Status status) {
  switch (status) {
    case core::Status::kAxisEnabled:
      return "; disable all axes, then repeat";
    case core::Status::kSeatTaken:
      return "; close it, or wait until it has asked for nothing for 10 s";
    case core::Status::kForbidden:
      return "; allow it at the board";
    case core::Status::kBusy:
    case core::Status::kTooSoon:
      return "; repeat later";
    default:
      return "";
  }
}

}  // namespace

DriveClient::DriveClient(const std::string& line, int unit, std::function<_modbus*()> open)
    : name_(unit == 1 ? line : fmt::format("{}, unit {}", line, unit)),
      unit_(unit),
      open_(std::move(open)),
      connection_(nullptr, CloseAndFree) {}

DriveClient::DriveClient(const std::string& host, int port, int unit)
    : DriveClient(fmt::format("{}:{}", host, port), unit, [=] { return ToHost(host, std::to_string(port)); }) {
  Connect();
}

DriveClient::DriveClient(const SerialLine& line, int unit)
    : DriveClient(line.device, unit, [=] { return modbus_new_rtu(line.device.c_str(), 115200, line.parity, 8, 1); }) {
  line_ = line;
  Connect();
}

DriveClient::~DriveClient() = default;
DriveClient::DriveClient(DriveClient&&) noexcept = default;
DriveClient& DriveClient::operator=(DriveClient&&) noexcept = default;

void DriveClient::Connect() {
  connection_.reset();
  Connection fresh(open_(), CloseAndFree);
  if (!fresh) throw LinkError(fmt::format("{}: {}", name_, modbus_strerror(errno)));
  modbus_set_slave(fresh.get(), unit_);
  if (modbus_connect(fresh.get()) != 0)
    throw LinkError(fmt::format("{}: cannot connect: {}; {}", name_, modbus_strerror(errno),
                                !line_           ? "is a drive running there, and is this its port?"
                                : errno == EBUSY ? "does another program use it?"
                                                 : "is the adapter plugged in, and is this its name?"));
  if (line_) {
    SetExclusive(modbus_get_socket(fresh.get()), true);
    if (const int got = SetSpeed(modbus_get_socket(fresh.get()), line_->baud);
        got == 0 || std::abs(got - line_->baud) > line_->baud / 50)
      throw LinkError(fmt::format("{}: the adapter cannot run at {} baud{}", name_, line_->baud,
                                  got == 0 ? "" : fmt::format(", it offers {}", got)));
    modbus_set_byte_timeout(fresh.get(), 0, kByteTimeout_us);
  }
  modbus_flush(fresh.get());  // a serial line may still hold the late answer to an earlier request
  connection_ = std::move(fresh);
}

// Longer than any pause inside a late reply, and than ten bytes.
int DriveClient::QuietMs() const {
  return std::max(kLongestPause_ms, static_cast<int>(1000 * 10 / line_->bytes_per_s()));
}

void DriveClient::SetTimeout(Patience patience, int attempt) {
  double wait_s = kResponse_s;
  if (line_ && patience == Patience::kShort)
    wait_s = std::min(kResponse_s, (2 * kFrameBytes / line_->bytes_per_s() + 0.05) * std::pow(2.0, attempt));
  const auto wait_us = static_cast<std::uint32_t>(1e6 * wait_s);
  modbus_set_response_timeout(connection_.get(), wait_us / 1000000, wait_us % 1000000);
}

// late: the reply may still come, perhaps after the line has been silent for a while.
void DriveClient::AfterFailure(bool late) {
  ++failed_attempts_;
  if (line_ && errno != EIO && errno != EBADF && errno != ENXIO && errno != ENODEV) {
    const int frame_ms = static_cast<int>(1000 * kFrameBytes / line_->bytes_per_s());
    if (DrainToSilence(modbus_get_socket(connection_.get()), late ? frame_ms + QuietMs() : QuietMs())) return;
  }
  connection_.reset();
}

void DriveClient::DropLateReplies() {
  errno = 0;
  AfterFailure(true);
}

// reads: it changes nothing. Modbus TCP has no checksum of its own, and a request that was damaged on the way is
// refused; so a refusal to read is believed when it comes twice.
void DriveClient::Request(const std::string& what, const std::function<int(_modbus*)>& call, Patience patience,
                          bool reads) {
  int refused = 0;     // the exception of the attempt before
  int unanswered = 0;  // attempts over a connection
  const auto start = std::chrono::steady_clock::now();
  for (int attempt = 0;; ++attempt) {
    const bool over = std::chrono::steady_clock::now() - start >= kBudget;
    std::string failure;
    try {
      if (!connection_) Connect();
      SetTimeout(patience, attempt);
      if (call(connection_.get()) >= 0) return;
      if (const int exception = ExceptionCode(errno)) {
        if (!reads || exception == refused || attempt + 1 >= kTcpAttempts) Refused(what, exception);
        refused = exception;
        continue;
      }
      failure = fmt::format("{}: {}: {}", name_, what, modbus_strerror(errno));
      AfterFailure(errno == ETIMEDOUT);
      ++unanswered;
    } catch (const LinkError& error) {  // it cannot connect anew: a drive may restart, a line may be plugged in again
      failure = error.what();
      std::this_thread::sleep_for(kPause);
    }
    if (over || (!line_ && unanswered == kTcpAttempts))
      throw LinkError(fmt::format("{} (tried {} times)", failure, attempt + 1));
  }
}

// Asks the drive for its own reason. If it does not answer, there is only the exception.
void DriveClient::Refused(const std::string& what, int exception) {
  link::Words<reg::kErrorBlock> w;
  const bool told =
      modbus_read_input_registers(connection_.get(), reg::kErrorBlock.first, w.size(), w.data()) == w.size() &&
      w.Get<reg::kErrorException>() == exception;
  const auto status = static_cast<core::Status>(told ? w.Get<reg::kErrorStatus>() : 0);
  const std::string reason = told ? StatusName(status) + Remedy(status) : "no reason given";
  throw RefusedError(fmt::format("{}: {} refused: {} (exception {:02})", name_, what, reason, exception), exception,
                     status);
}

std::vector<std::uint16_t> DriveClient::ReadWords(bool input, int first, int count) {
  std::vector<std::uint16_t> words(static_cast<std::size_t>(count));
  for (int done = 0; done < count; done += kChunk) {
    const int part = std::min(kChunk, count - done);
    const std::string what =
        fmt::format("reading {} registers from {} 0x{:04X}", part, input ? "input" : "holding", first + done);
    const auto read = [&](modbus_t* c) {
      return input ? modbus_read_input_registers(c, first + done, part, words.data() + done)
                   : modbus_read_registers(c, first + done, part, words.data() + done);
    };
    Request(what, read, Patience::kNormal, true);
  }
  return words;
}

std::vector<std::uint16_t> DriveClient::ReadInput(int first, int count) { return ReadWords(true, first, count); }
std::vector<std::uint16_t> DriveClient::ReadHolding(int first, int count) { return ReadWords(false, first, count); }

void DriveClient::Write(int first, std::span<const std::uint16_t> words) {
  const int count = static_cast<int>(words.size());
  for (int done = 0; done < count; done += kChunk) {
    const int part = std::min(kChunk, count - done);
    Request(fmt::format("writing {} registers from 0x{:04X}", part, first + done),
            [&](modbus_t* c) { return modbus_write_registers(c, first + done, part, words.data() + done); });
  }
}

void DriveClient::WriteSingle(int address, std::uint16_t word) {
  Request(fmt::format("writing register 0x{:04X}", address),
          [&](modbus_t* c) { return modbus_write_register(c, address, word); });
}

std::vector<std::uint16_t> DriveClient::WriteThenRead(int write_first, std::span<const std::uint16_t> words,
                                                      int read_first, int count, Patience patience) {
  std::vector<std::uint16_t> read(static_cast<std::size_t>(count));
  Request(
      fmt::format("writing {} registers from 0x{:04X} and reading {} from 0x{:04X}", words.size(), write_first, count,
                  read_first),
      [&](modbus_t* c) {
        return modbus_write_and_read_registers(c, write_first, static_cast<int>(words.size()), words.data(), read_first,
                                               count, read.data());
      },
      patience);
  return read;
}

std::vector<std::uint16_t> DriveClient::Read(const link::Span& span) {
  return ReadWords(span.kind == link::RegisterKind::kInput, span.first, span.count);
}

std::vector<float> DriveClient::ReadFloats(const link::Register& list, int count) {
  const std::vector<std::uint16_t> words = Read(link::SpanOf(list, count));
  std::vector<float> values(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = core::GetF32(words.data() + 2 * i);
  return values;
}

Identity DriveClient::ReadIdentity() {
  const auto w = Read<reg::kIdentityBlock>();
  if (const auto magic = w.Get<reg::kMagic>(); magic != reg::kMagicValue)
    throw LinkError(fmt::format("{}: not an armcal drive (magic 0x{:08X}); are port and unit right?", name_, magic));
  if (const auto major = w.Get<reg::kMapMajor>(); major != reg::kMapMajorValue)
    throw LinkError(
        fmt::format("{}: register map version {}, this tool speaks {}; use the armcal of the firmware's version", name_,
                    major, reg::kMapMajorValue));
  if (const auto probe = w.Get<reg::kProbeU32>();
      probe != reg::kProbeU32Value || w.Get<reg::kProbeFloat>() != reg::kProbeFloatValue)
    throw LinkError(fmt::format("{}: word-order probe reads 0x{:08X}, expected 0x{:08X}; does a gateway swap words?",
                                name_, probe, reg::kProbeU32Value));
  Identity id{};
  id.map_major = w.Get<reg::kMapMajor>();
  id.map_minor = w.Get<reg::kMapMinor>();
  id.layout_crc = w.Get<reg::kLayoutCrc>();
  id.schema = w.Get<reg::kSchema>();
  id.firmware_version = w.Get<reg::kFirmwareVersion>();
  id.serial_number = w.Get<reg::kSerialNumber>();
  id.axes = w.Get<reg::kAxes>();
  id.parameters = w.Get<reg::kParameters>();
  id.columns = w.Get<reg::kColumns>();
  id.table_words = w.Get<reg::kTableWords>();
  id.capabilities = w.Get<reg::kCapabilities>();
  id.tick_rate_Hz = w.Get<reg::kTickRate>();
  id.sample_ticks = w.Get<reg::kSampleTicks>();
  return id;
}

DriveStatus DriveClient::ReadStatus() {
  const auto w = Read<reg::kStatusBlock>();
  DriveStatus s{};
  s.transaction_state = static_cast<link::TransactionState>(w.Get<reg::kTransactionState>());
  s.transaction_status = static_cast<core::Status>(w.Get<reg::kTransactionStatus>());
  s.table_status = static_cast<core::Status>(w.Get<reg::kTableStatus>());
  s.feedforward_state = w.Get<reg::kFeedForwardState>();
  s.generation = w.Get<reg::kGeneration>();
  s.tick = w.Get<reg::kTick>();
  s.active_crc = w.Get<reg::kActiveCrc>();
  s.command_sequence = w.Get<reg::kCommandSequence>();
  s.store_sequence = w.Get<reg::kStoreSequence>();
  s.slot_state[0] = w.Get<reg::kSlotState, 0>();
  s.slot_state[1] = w.Get<reg::kSlotState, 1>();
  s.enabled_axes = w.Get<reg::kEnabledAxes>();
  s.clamp_count = w.Get<reg::kClampCount>();
  s.sample_gaps = w.Get<reg::kSampleGaps>();
  s.request_count = w.Get<reg::kRequestCount>();
  s.error_exception = w.Get<reg::kErrorException>();
  s.error_function = w.Get<reg::kErrorFunction>();
  s.error_address = w.Get<reg::kErrorAddress>();
  s.error_status = static_cast<core::Status>(w.Get<reg::kErrorStatus>());
  s.error_request = w.Get<reg::kErrorRequest>();
  s.unlocked = w.Get<reg::kUnlocked>() != 0;
  s.health = w.Get<reg::kHealth>();
  s.rows_used[0] = w.Get<reg::kRowsUsedA>();
  s.rows_gated[0] = w.Get<reg::kRowsGatedA>();
  s.rows_used[1] = w.Get<reg::kRowsUsedB>();
  s.rows_gated[1] = w.Get<reg::kRowsGatedB>();
  return s;
}

}  // namespace armcal::client
