// client - libmodbus with time-outs, retries and reasons; its float helpers are not used, their word order varies.
#include "host_sim/client/drive_client.hpp"

#include <fmt/core.h>
#include <modbus.h>

#include <algorithm>
#include <cerrno>

#include "armcal/core/words.hpp"
#include "armcal/link/registers.hpp"
#include "host_sim/client/register_text.hpp"

namespace armcal::client {

namespace reg = link::reg;
using core::GetU32;

namespace {

constexpr int kChunk = 120;  // even, so that no request splits a 32-bit value, and below the protocol's 123
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
  modbus_flush(fresh.get());  // a line keeps what came late for the request before
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

// Asks the drive for its own reason; without an answer to that the exception alone has to do.
void DriveClient::Refused(const std::string& what, int exception) {
  std::uint16_t w[4] = {};
  const bool told = modbus_read_input_registers(connection_.get(), reg::kStatus + 24, 4, w) == 4 && w[0] == exception;
  const auto status = static_cast<core::Status>(told ? w[3] : 0);
  const std::string reason = told ? StatusName(status) : "no reason given";
  throw RefusedError(fmt::format("{}: {} refused: {} (exception {:02})", name_, what, reason, exception), exception,
                     status);
}

std::vector<std::uint16_t> DriveClient::Read(bool input, int first, int count) {
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

std::vector<std::uint16_t> DriveClient::ReadInput(int first, int count) { return Read(true, first, count); }
std::vector<std::uint16_t> DriveClient::ReadHolding(int first, int count) { return Read(false, first, count); }

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

std::uint32_t DriveClient::ReadInputU32(int first) { return GetU32(ReadInput(first, 2).data()); }

std::vector<float> DriveClient::ReadInputFloats(int first, int count) {
  const std::vector<std::uint16_t> words = ReadInput(first, 2 * count);
  std::vector<float> values(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = core::GetF32(words.data() + 2 * i);
  return values;
}

void DriveClient::WriteU32(int first, std::uint32_t value) {
  std::uint16_t words[2];
  core::PutU32(words, value);
  Write(first, words);
}

Identity DriveClient::ReadIdentity() {
  const std::vector<std::uint16_t> w = ReadInput(reg::kIdentity, reg::kIdentityCount);
  const auto u32 = [&](int at) { return GetU32(w.data() + at); };
  if (u32(0) != reg::kMagic) throw LinkError(fmt::format("{}: not an armcal drive (magic 0x{:08X})", name_, u32(0)));
  if (w[2] != reg::kMapMajor)
    throw LinkError(fmt::format("{}: register map version {}, this tool speaks {}", name_, w[2], reg::kMapMajor));
  if (u32(14) != reg::kProbeU32 || core::GetF32(w.data() + 12) != reg::kProbeFloat)
    throw LinkError(
        fmt::format("{}: word-order probe reads 0x{:08X}, expected 0x{:08X}", name_, u32(14), reg::kProbeU32));
  return {w[2], w[3], u32(4), u32(6), u32(8), u32(10), w[16], w[17], w[18], w[19], u32(20), u32(22), w[24]};
}

DriveStatus DriveClient::ReadStatus() {
  const std::vector<std::uint16_t> w = ReadInput(reg::kStatus, reg::kStatusCount);
  const auto u32 = [&](int at) { return GetU32(w.data() + at); };
  const auto status = [&](int at) { return static_cast<core::Status>(w[at]); };
  DriveStatus s{};
  s.transaction_state = w[0];
  s.transaction_status = status(1);
  s.table_status = status(2);
  s.feedforward_state = w[3];
  s.generation = u32(4);
  s.tick = u32(6);
  s.active_crc = u32(8);
  s.command_sequence = u32(10);
  s.store_sequence = u32(12);
  s.slot_state[0] = w[14];
  s.slot_state[1] = w[15];
  s.enabled_axes = u32(16);
  s.clamp_count = u32(18);
  s.sample_gaps = u32(20);
  s.request_count = u32(22);
  s.error_exception = w[24];
  s.error_function = w[25];
  s.error_address = w[26];
  s.error_status = status(27);
  s.error_request = u32(28);
  s.unlocked = w[30] != 0;
  s.health = w[31];
  for (int filter = 0; filter < 2; ++filter) {
    s.rows_used[filter] = u32(32 + 4 * filter);
    s.rows_gated[filter] = u32(34 + 4 * filter);
  }
  return s;
}

}  // namespace armcal::client
