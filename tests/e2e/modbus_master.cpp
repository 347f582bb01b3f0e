// end-to-end tests - frames of Modbus TCP and RTU, sent and received byte by byte.
#include "tests/e2e/modbus_master.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <thread>

namespace armcal::tests::modbus {

namespace {

bool Ready(int file, int wait_ms) {
  pollfd watched = {file, POLLIN, 0};
  return ::poll(&watched, 1, wait_ms) > 0;
}

// CRC-16 of the serial line: polynomial 0xA001 reflected, start 0xFFFF.
std::uint16_t Crc(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1u ? crc >> 1 ^ 0xA001u : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

bool Whole(const Bytes& frame) {
  return frame.size() >= 4 && Crc({frame.begin(), frame.end() - 2}) == (frame.end()[-1] << 8 | frame.end()[-2]);
}

}  // namespace

std::string Hex(const Bytes& bytes) {
  std::string text;
  char two[4];
  for (const std::uint8_t byte : bytes) std::snprintf(two, sizeof two, "%02x ", byte), text += two;
  return text.empty() ? "nothing" : text;
}

Bytes Join(const Bytes& front, const std::vector<int>& words) {
  Bytes bytes = front;
  for (const int word : words) {
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes.push_back(static_cast<std::uint8_t>(word));
  }
  return bytes;
}

Bytes Joined(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::uint16_t WordAt(const Bytes& bytes, std::size_t at) {
  return at + 1 < bytes.size() ? static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]) : std::uint16_t{0};
}

Bytes ReadHolding(int first, int quantity) { return Join({3}, {first, quantity}); }
Bytes ReadInput(int first, int quantity) { return Join({4}, {first, quantity}); }
Bytes WriteOne(int address, int value) { return Join({6}, {address, value}); }
Bytes WriteMany(int first, const std::vector<int>& words) {
  const int quantity = static_cast<int>(words.size());
  Bytes pdu = Join({16}, {first, quantity});
  pdu.push_back(static_cast<std::uint8_t>(2 * quantity));
  return Join(pdu, words);
}
Bytes WriteThenRead(int read_first, int read_quantity, int write_first, const std::vector<int>& words) {
  const int quantity = static_cast<int>(words.size());
  Bytes pdu = Join({23}, {read_first, read_quantity, write_first, quantity});
  pdu.push_back(static_cast<std::uint8_t>(2 * quantity));
  return Join(pdu, words);
}
Bytes Identify(int code, int object) {
  return {43, 14, static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(object)};
}

TcpLine::TcpLine(int port, int from) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in own{}, drive{};
  own.sin_family = drive.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl((INADDR_LOOPBACK & 0xFFFFFF00u) | static_cast<std::uint32_t>(from));
  drive.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  drive.sin_port = htons(static_cast<std::uint16_t>(port));
  const int on = 1;
  const timeval longest = {0, 100000};
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
  connected_ = ::bind(socket_, reinterpret_cast<sockaddr*>(&own), sizeof own) == 0 &&
               ::connect(socket_, reinterpret_cast<sockaddr*>(&drive), sizeof drive) == 0;
}

TcpLine::~TcpLine() { ::close(socket_); }

Bytes TcpLine::Frame(int transaction, int unit, const Bytes& pdu, int protocol) {
  Bytes frame = Join({}, {transaction, protocol, static_cast<int>(pdu.size()) + 1});
  frame.push_back(static_cast<std::uint8_t>(unit));
  return Joined(frame, pdu);
}

bool TcpLine::Send(const Bytes& bytes) {
  return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

Bytes TcpLine::Receive(int wait_ms) {
  const auto whole = [&] { return there_.size() >= 6 && there_.size() >= 6u + WordAt(there_, 4); };
  while (!whole()) {
    std::uint8_t part[512];
    const ssize_t count = Ready(socket_, wait_ms) ? ::recv(socket_, part, sizeof part, 0) : -1;
    if (count == 0) connected_ = false;
    if (count <= 0) return {};
    there_.insert(there_.end(), part, part + count);
  }
  const auto end = there_.begin() + 6 + WordAt(there_, 4);
  const Bytes frame(there_.begin(), end);
  there_.erase(there_.begin(), end);
  return frame;
}

Bytes TcpLine::Ask(const Bytes& pdu) {
  Send(Frame(++transaction_ & 0xFFFF, 1, pdu));
  const Bytes frame = Receive();
  return frame.size() > 7 ? Bytes(frame.begin() + 7, frame.end()) : Bytes();
}

void TcpLine::EndSending() { ::shutdown(socket_, SHUT_WR); }

Bytes RtuLine::Frame(int address, const Bytes& pdu) {
  Bytes frame = Joined({static_cast<std::uint8_t>(address)}, pdu);
  const std::uint16_t crc = Crc(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

void RtuLine::Send(const Bytes& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::write(terminal_, bytes.data() + sent, bytes.size() - sent);
    if (count > 0) sent += static_cast<std::size_t>(count);
  }
}

// After a whole frame it waits a little longer, because bytes behind the frame would be a fault.
Bytes RtuLine::Receive(int wait_ms) {
  Bytes bytes;
  for (int wait = wait_ms; Ready(terminal_, wait);) {
    std::uint8_t part[512];
    const ssize_t count = ::read(terminal_, part, sizeof part);
    if (count <= 0) break;
    bytes.insert(bytes.end(), part, part + count);
    wait = Whole(bytes) ? 10 : 500;
  }
  return bytes;
}

void RtuLine::Rest() const { std::this_thread::sleep_for(std::chrono::milliseconds(2 * silence_ms_)); }

Bytes RtuLine::Ask(const Bytes& pdu) {
  Send(Frame(1, pdu));
  const Bytes frame = Receive();
  return Whole(frame) && frame[0] == 1 ? Bytes(frame.begin() + 1, frame.end() - 2) : Bytes();
}

}  // namespace armcal::tests::modbus
