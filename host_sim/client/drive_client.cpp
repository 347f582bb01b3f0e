// client - calls libmodbus with time-outs and retries, and gives the reason of a failure.
#include "host_sim/client/drive_client.hpp"

#include <fmt/core.h>
#include <modbus.h>

#include <algorithm>
#include <cerrno>

#include "armcal/core/words.hpp"
#include "host_sim/client/register_text.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {

constexpr int kChunk = 120;  // below the protocol's 123, and even, so that no request splits a 32-bit value
constexpr int kAttempts = 3;
constexpr std::uint32_t kResponse_s = 2;

void CloseAndFree(_modbus* connection) {
  modbus_close(connection);
  modbus_free(connection);
}

// 1 to 11 if `error` is a Modbus exception, else 0.
int ExceptionCode(int error) {
  const int code = error - MODBUS_ENOBASE;
  return code >= 1 && code < MODBUS_EXCEPTION_MAX ? code : 0;
}

}  // namespace

DriveClient::DriveClient(std::string name, int unit, std::function<_modbus*()> open)
    : name_(std::move(name)), unit_(unit), open_(std::move(open)), connection_(nullptr, CloseAndFree) {
  Connect();
}

DriveClient::DriveClient(const std::string& host, int port, int unit)
    : DriveClient(fmt::format("{}:{}", host, port), unit,
                  [=] { return modbus_new_tcp_pi(host.c_str(), std::to_string(port).c_str()); }) {}

DriveClient::DriveClient(const SerialLine& line, int unit)
    : DriveClient(line.device, unit,
                  [=] { return modbus_new_rtu(line.device.c_str(), line.baud, line.parity, 8, 1); }) {}

DriveClient::~DriveClient() = default;
DriveClient::DriveClient(DriveClient&&) noexcept = default;
DriveClient& DriveClient::operator=(DriveClient&&) noexcept = default;

void DriveClient::Connect() {
  connection_.reset();
  Connection fresh(open_(), CloseAndFree);
  if (!fresh) throw LinkError(fmt::format("{}: {}", name_, modbus_strerror(errno)));
  modbus_set_slave(fresh.get(), unit_);
  modbus_set_response_timeout(fresh.get(), kResponse_s, 0);
  if (modbus_connect(fresh.get()) != 0)
    throw LinkError(fmt::format("{}: cannot connect: {}", name_, modbus_strerror(errno)));
  modbus_flush(fresh.get());  // a serial line may still hold the late answer to an earlier request
  connection_ = std::move(fresh);
}

void DriveClient::Request(const std::string& what, const std::function<int(_modbus*)>& call) {
  std::string failure;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (!connection_) Connect();
    if (call(connection_.get()) >= 0) return;
    if (const int exception = ExceptionCode(errno)) Refused(what, exception);
    failure = modbus_strerror(errno);
    connection_.reset();
  }
  throw LinkError(fmt::format("{}: {}: {} (tried {} times)", name_, what, failure, kAttempts));
}

// Asks the drive for its own reason. If it does not answer, there is only the exception.
void DriveClient::Refused(const std::string& what, int exception) {
  link::Words<reg::kErrorBlock> w;
  const bool told =
      modbus_read_input_registers(connection_.get(), reg::kErrorBlock.first, w.size(), w.data()) == w.size() &&
      w.Get<reg::kErrorException>() == exception;
  const auto status = static_cast<core::Status>(told ? w.Get<reg::kErrorStatus>() : 0);
  const std::string reason = told ? StatusName(status) : "no reason given";
  throw RefusedError(fmt::format("{}: {} refused: {} (exception {:02})", name_, what, reason, exception), exception,
                     status);
}

std::vector<std::uint16_t> DriveClient::ReadWords(bool input, int first, int count) {
  std::vector<std::uint16_t> words(static_cast<std::size_t>(count));
  for (int done = 0; done < count; done += kChunk) {
    const int part = std::min(kChunk, count - done);
    const std::string what =
        fmt::format("reading {} registers from {} 0x{:04X}", part, input ? "input" : "holding", first + done);
    Request(what, [&](modbus_t* c) {
      return input ? modbus_read_input_registers(c, first + done, part, words.data() + done)
                   : modbus_read_registers(c, first + done, part, words.data() + done);
    });
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
    throw LinkError(fmt::format("{}: not an armcal drive (magic 0x{:08X})", name_, magic));
  if (const auto major = w.Get<reg::kMapMajor>(); major != reg::kMapMajorValue)
    throw LinkError(fmt::format("{}: register map version {}, this tool speaks {}", name_, major, reg::kMapMajorValue));
  if (const auto probe = w.Get<reg::kProbeU32>();
      probe != reg::kProbeU32Value || w.Get<reg::kProbeFloat>() != reg::kProbeFloatValue)
    throw LinkError(
        fmt::format("{}: word-order probe reads 0x{:08X}, expected 0x{:08X}", name_, probe, reg::kProbeU32Value));
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
