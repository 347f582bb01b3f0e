// client - a TCP proxy that cuts one connection after a given number of reply bytes.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <thread>

namespace armcal::test {

class CuttingProxy {
 public:
  explicit CuttingProxy(int server_port) : server_port_(server_port) {
    listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in where = Loopback(0);
    socklen_t size = sizeof where;
    ::bind(listener_, reinterpret_cast<sockaddr*>(&where), size);
    ::listen(listener_, 8);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&where), &size);
    port_ = ntohs(where.sin_port);
    thread_ = std::thread([this] { Run(); });
  }
  ~CuttingProxy() {
    stop_ = true;
    thread_.join();
    ::close(listener_);
  }

  int port() const { return port_; }
  std::size_t forwarded() const { return forwarded_; }  // reply bytes so far, of all connections
  // After this many more reply bytes the connection ends. Later connections pass.
  void CutAfter(std::size_t bytes) { cut_at_ = forwarded_ + bytes; }

 private:
  static sockaddr_in Loopback(int port) {
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<std::uint16_t>(port));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return where;
  }

  bool Wait(int a, int b) {
    pollfd watched[2] = {{a, POLLIN, 0}, {b, POLLIN, 0}};
    while (!stop_)
      if (::poll(watched, b < 0 ? 1 : 2, 20) > 0) return true;
    return false;
  }

  void Run() {
    while (Wait(listener_, -1)) {
      const int client = ::accept(listener_, nullptr, nullptr);
      const int server = ::socket(AF_INET, SOCK_STREAM, 0);
      const int on = 1;
      ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      ::setsockopt(server, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      const sockaddr_in where = Loopback(server_port_);
      if (::connect(server, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0) Carry(client, server);
      ::close(client);
      ::close(server);
    }
  }

  void Carry(int client, int server) {
    while (Wait(client, server)) {
      if (!Pass(client, server, false) || !Pass(server, client, true)) return;
    }
  }

  // Moves the bytes that are there. False: the stream has ended or was cut.
  bool Pass(int from, int to, bool replies) {
    char bytes[512];
    const ssize_t count = ::recv(from, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count == 0) return false;
    if (count < 0) return true;
    auto part = static_cast<std::size_t>(count);
    if (replies) part = std::min(part, cut_at_ - forwarded_);
    if (::send(to, bytes, part, MSG_NOSIGNAL) != static_cast<ssize_t>(part)) return false;
    if (replies) forwarded_ += part;
    if (!replies || forwarded_ < cut_at_) return true;
    cut_at_ = std::numeric_limits<std::size_t>::max();
    return false;
  }

  int server_port_, listener_ = -1, port_ = 0;
  std::atomic<std::size_t> forwarded_{0}, cut_at_{std::numeric_limits<std::size_t>::max()};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace armcal::test
