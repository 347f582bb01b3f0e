// end-to-end tests - a TCP proxy that damages what it carries.
#pragma once

#include <chrono>
#include <random>

#include "tests/unit/client/loopback_proxy.hpp"

namespace armcal::tests {

// What happens to one byte. kDelay holds it, and what follows it, for longer than a client waits for a reply.
enum class Damage { kNone, kFlip, kInsert, kCut, kDrop, kDuplicate, kDelay };

// Carries one connection after the other. It counts the bytes of both directions and damages the one with number `at`,
// and after that each portion with probability `further`.
class LossyProxy {
 public:
  LossyProxy(int server_port, Damage damage, int at, double further, unsigned seed)
      : damage_(damage), at_(at), further_(further), random_(seed), proxy_(server_port, [this](int from, int to, bool) {
          return Carry(from, to);
        }) {}

  int port() const { return proxy_.port(); }
  int carried() const { return carried_; }

 private:
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

  const Damage damage_;
  const int at_;
  const double further_;
  std::mt19937 random_;
  std::atomic<int> carried_{0};
  test::LoopbackProxy proxy_;  // last: its thread uses the others
};

}  // namespace armcal::tests
