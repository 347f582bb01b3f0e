// port_linux - poll() over a listener and the sockets of its connections.
#include "port/linux/tcp_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace armcal::port_linux {

using core::Status;

namespace {

constexpr std::size_t kReceive = 1024;

bool WouldWait() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

TcpServer::TcpServer(const ByteService& service, const hardware::Clock& clock, const TcpLimits& limits)
    : service_(service), clock_(clock), limits_(limits) {}

TcpServer::~TcpServer() {
  for (const Slot& slot : slots_)
    if (slot.socket >= 0) ::close(slot.socket);
  if (listener_ >= 0) ::close(listener_);
}

Status TcpServer::Fail(Status status, const std::string& what) {
  error_ = what + ": " + std::strerror(errno);
  if (listener_ >= 0) ::close(listener_);
  listener_ = -1;
  return status;
}

Status TcpServer::Listen(const std::string& address, std::uint16_t port) {
  if (listener_ >= 0) return Status::kWrongOrder;
  const std::string name = address + ":" + std::to_string(port);
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &where.sin_addr) != 1) {
    errno = EINVAL;
    return Fail(Status::kOutOfRange, name);
  }
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener_ < 0) return Fail(Status::kBadAddress, name);
  const int on = 1;
  ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&where), sizeof where) != 0 || ::listen(listener_, SOMAXCONN) != 0)
    return Fail(errno == EADDRINUSE ? Status::kBusy : Status::kBadAddress, name);
  socklen_t size = sizeof where;
  if (::getsockname(listener_, reinterpret_cast<sockaddr*>(&where), &size) != 0) return Fail(Status::kBadAddress, name);
  port_ = ntohs(where.sin_port);
  return Status::kOk;
}

int TcpServer::connections() const {
  int open = 0;
  for (const Slot& slot : slots_) open += slot.socket >= 0;
  return open;
}

Status TcpServer::Poll(int timeout_ms) {
  if (listener_ < 0) return Status::kWrongOrder;
  pollfd watched[1 + kSlots];
  watched[0] = {listener_, POLLIN, 0};
  for (int i = 0; i < kSlots; ++i) {
    // A socket with an unsent reply is only written to, so a client that does not read cannot pile up requests here.
    const short wanted = slots_[i].out.empty() ? POLLIN : POLLOUT;
    watched[1 + i] = {slots_[i].socket, wanted, 0};
    if (Waits(i)) timeout_ms = 0;
  }
  const bool some = ::poll(watched, 1 + kSlots, timeout_ms) > 0;
  for (int i = 0; i < kSlots; ++i)
    if (slots_[i].socket >= 0 && ((some && watched[1 + i].revents != 0) || Waits(i))) Serve(i);
  if (some && watched[0].revents != 0)
    for (int k = 0; k < limits_.slots && Accept(); ++k) {
    }
  for (Slot& slot : slots_) CloseLate(slot);
  return Status::kOk;
}

// False: nobody is waiting to be accepted.
bool TcpServer::Accept() {
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const int socket = ::accept4(listener_, reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (socket < 0) return false;
  const std::uint32_t address = from.sin_addr.s_addr;
  const int i = FreeSlot(address);
  if (i < 0) {
    ::close(socket);
    return true;
  }
  const int on = 1;
  ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  slots_[i] = Slot{};
  slots_[i].socket = socket;
  slots_[i].address = address;
  slots_[i].active_ms = clock_.Ms();
  service_.open(service_.context, i);
  return true;
}

// -1: there is none for this address.
int TcpServer::FreeSlot(std::uint32_t address) {
  for (int i = 0; i < limits_.slots; ++i)
    if (slots_[i].socket < 0) return i;
  return MakeRoom(address);
}

// All slots are taken. Closes the connection that has to go, and returns its slot.
int TcpServer::MakeRoom(std::uint32_t address) {
  const auto held = [&](std::uint32_t by) {
    int count = 0;
    for (const Slot& slot : slots_) count += slot.socket >= 0 && slot.address == by;
    return count;
  };
  const bool has_some = held(address) > 0;
  int most = 2;  // an address with one connection keeps it
  for (const Slot& slot : slots_) most = held(slot.address) > most ? held(slot.address) : most;
  const std::uint32_t now = clock_.Ms();
  int goes = -1;
  for (int i = 0; i < limits_.slots; ++i) {
    const Slot& slot = slots_[i];
    const bool may_go =
        has_some ? slot.address == address && now - slot.active_ms >= limits_.unused_ms : held(slot.address) >= most;
    if (!may_go || (service_.keep != nullptr && service_.keep(service_.context, i))) continue;
    if (goes < 0 || now - slot.active_ms > now - slots_[goes].active_ms) goes = i;
  }
  if (goes >= 0) Close(slots_[goes]);
  return goes;
}

// Sends what waits. Then answers one request, of those that are there or have just come.
void TcpServer::Serve(int index) {
  Slot& slot = slots_[index];
  if (!Send(slot)) return Close(slot);
  if (slot.out.empty() && slot.in.empty()) Receive(slot);
  if (!Answer(index)) return Close(slot);
  if (slot.leaving && slot.in.empty() && slot.out.empty() && !Asked(index)) Close(slot);
}

void TcpServer::Receive(Slot& slot) {
  std::uint8_t bytes[kReceive];
  const ssize_t count = ::recv(slot.socket, bytes, sizeof bytes, 0);
  if (count > 0) {
    slot.in.assign(bytes, bytes + count);
    slot.active_ms = clock_.Ms();
  } else if (count == 0 || !WouldWait()) {
    slot.leaving = true;
  }
}

// Takes at most one request, and only while the last reply has found room in the socket. False: the connection is gone.
bool TcpServer::Answer(int index) {
  Slot& slot = slots_[index];
  if (!slot.out.empty() || (slot.in.empty() && !Asked(index))) return true;
  std::size_t used = 0;
  std::size_t reply_bytes = 0;
  slot.out.resize(service_.max_reply);
  const bool sound =
      service_.receive(service_.context, index, slot.in.data(), slot.in.size(), &used, slot.out.data(), &reply_bytes);
  slot.out.resize(reply_bytes);
  slot.in.erase(slot.in.begin(), slot.in.begin() + static_cast<std::ptrdiff_t>(used));
  const bool mid_frame = service_.mid_frame(service_.context, index);
  if (mid_frame && !(slot.mid_frame && reply_bytes == 0)) slot.frame_ms = clock_.Ms();
  slot.mid_frame = mid_frame;
  return sound && Send(slot);
}

// False: the connection is gone.
bool TcpServer::Send(Slot& slot) {
  while (!slot.out.empty()) {
    const ssize_t count = ::send(slot.socket, slot.out.data(), slot.out.size(), MSG_NOSIGNAL);
    if (count < 0) return WouldWait();
    slot.out.erase(slot.out.begin(), slot.out.begin() + count);
    slot.active_ms = clock_.Ms();
  }
  return true;
}

void TcpServer::CloseLate(Slot& slot) {
  if (slot.socket < 0) return;
  const std::uint32_t now = clock_.Ms();
  const bool idle = limits_.idle_ms != 0 && now - slot.active_ms >= limits_.idle_ms;
  const bool partial = slot.mid_frame && now - slot.frame_ms >= limits_.partial_frame_ms;
  if (idle || partial) Close(slot);
}

void TcpServer::Close(Slot& slot) {
  if (slot.socket >= 0) {
    ::close(slot.socket);
    if (service_.close != nullptr) service_.close(service_.context, static_cast<int>(&slot - slots_));
  }
  slot = Slot{};
}

}  // namespace armcal::port_linux
