// client - a TCP proxy on this machine that carries one connection after the other.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>

namespace armcal::test {

class LoopbackProxy {
 public:
  // Moves the bytes that have come. False: the connection ends.
  using Move = std::function<bool(int from, int to, bool replies)>;

  LoopbackProxy(int server_port, Move move)
      : server_port_(server_port), move_(std::move(move)), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in where = Loopback(0);
    socklen_t size = sizeof where;
    ::bind(listener_, reinterpret_cast<sockaddr*>(&where), size);
    ::listen(listener_, 8);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&where), &size);
    port_ = ntohs(where.sin_port);
    thread_ = std::thread([this] { Run(); });
  }
  ~LoopbackProxy() {
    stop_ = true;
    thread_.join();
    ::close(listener_);
  }
  LoopbackProxy(const LoopbackProxy&) = delete;

  int port() const { return port_; }

 private:
  static sockaddr_in Loopback(int port) {
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<std::uint16_t>(port));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return where;
  }

  void Run() {
    while (!stop_) {
      pollfd watched = {listener_, POLLIN, 0};
      if (::poll(&watched, 1, 20) <= 0) continue;
      const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      const int on = 1;
      ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      ::setsockopt(server, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      const sockaddr_in where = Loopback(server_port_);
      if (::connect(server, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0)
        while (!stop_ && Pass(client, server)) {
        }
      ::close(client), ::close(server);
    }
  }

  bool Pass(int client, int server) {
    pollfd watched[2] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
    if (::poll(watched, 2, 20) <= 0) return true;
    return (watched[0].revents == 0 || move_(client, server, false)) &&
           (watched[1].revents == 0 || move_(server, client, true));
  }

  const int server_port_;
  const Move move_;
  int listener_, port_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace armcal::test
