// end-to-end tests - a TCP proxy that damages what it carries.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <random>
#include <thread>

namespace armcal::tests {

// What happens to one byte. kDelay holds it, and what follows it, for longer than a client waits for a reply.
enum class Damage { kNone, kFlip, kInsert, kCut, kDrop, kDuplicate, kDelay };

// Carries one connection after the other. It counts the bytes of both directions and damages the one with number `at`,
// and after that each portion with probability `further`.
class LossyProxy {
 public:
  LossyProxy(int server_port, Damage damage, int at, double further, unsigned seed)
      : server_port_(server_port),
        damage_(damage),
        at_(at),
        further_(further),
        random_(seed),
        listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in where = Loopback(0);
    socklen_t size = sizeof where;
    ::bind(listener_, reinterpret_cast<sockaddr*>(&where), size);
    ::listen(listener_, 8);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&where), &size);
    port_ = ntohs(where.sin_port);
    thread_ = std::thread([this] { Run(); });
  }
  ~LossyProxy() {
    stop_ = true;
    thread_.join();
    ::close(listener_);
  }
  LossyProxy(const LossyProxy&) = delete;

  int port() const { return port_; }
  int carried() const { return carried_; }

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

  // False: the connection has ended.
  bool Pass(int client, int server) {
    pollfd watched[2] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
    if (::poll(watched, 2, 20) <= 0) return true;
    for (int k = 0; k < 2; ++k)
      if (watched[k].revents != 0 && !Carry(k == 0 ? client : server, k == 0 ? server : client)) return false;
    return true;
  }

  bool Carry(int from, int to) {
    std::uint8_t bytes[512];
    const ssize_t count = ::recv(from, bytes, sizeof bytes, 0);
    if (count <= 0) return false;
    const int begin = carried_, end = begin + static_cast<int>(count);
    carried_ = end;
    Damage damage = Damage::kNone;
    int at = 0;
    if (damage_ != Damage::kNone && at_ >= begin && at_ < end) {
      damage = damage_, at = at_ - begin;
    } else if (begin > at_ && std::uniform_real_distribution<>(0, 1)(random_) < further_) {
      damage = static_cast<Damage>(1 + random_() % 6), at = static_cast<int>(random_() % static_cast<unsigned>(count));
    }
    return Send(to, bytes, at) && Damaged(to, damage, bytes[at]) &&
           Send(to, bytes + at + 1, static_cast<int>(count) - at - 1);
  }

  bool Damaged(int to, Damage damage, std::uint8_t byte) {
    const std::uint8_t flipped = byte ^ static_cast<std::uint8_t>(1u << random_() % 8), twice[2] = {byte, byte},
                       inserted[2] = {static_cast<std::uint8_t>(random_()), byte};
    switch (damage) {
      case Damage::kFlip:
        return Send(to, &flipped, 1);
      case Damage::kInsert:
        return Send(to, inserted, 2);
      case Damage::kCut:
        return false;
      case Damage::kDrop:
        return true;
      case Damage::kDuplicate:
        return Send(to, twice, 2);
      case Damage::kDelay:
        std::this_thread::sleep_for(std::chrono::milliseconds(2500));
        break;
      case Damage::kNone:
        break;
    }
    return Send(to, &byte, 1);
  }

  static bool Send(int to, const std::uint8_t* bytes, int count) {
    return count == 0 || ::send(to, bytes, static_cast<std::size_t>(count), MSG_NOSIGNAL) == count;
  }

  const int server_port_;
  const Damage damage_;
  const int at_;
  const double further_;
  std::mt19937 random_;
  int listener_, port_ = 0;
  std::atomic<int> carried_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace armcal::tests
