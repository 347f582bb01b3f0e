// client - a TCP proxy that cuts one connection after a given number of reply bytes.
#pragma once

#include <algorithm>
#include <limits>

#include "tests/unit/client/loopback_proxy.hpp"

namespace armcal::test {

class CuttingProxy {
 public:
  explicit CuttingProxy(int server_port)
      : proxy_(server_port, [this](int from, int to, bool replies) { return Pass(from, to, replies); }) {}

  int port() const { return proxy_.port(); }
  std::size_t forwarded() const { return forwarded_; }  // reply bytes so far, of all connections
  // After this many more reply bytes the connection ends. Later connections pass.
  void CutAfter(std::size_t bytes) { cut_at_ = forwarded_ + bytes; }

 private:
  bool Pass(int from, int to, bool replies) {
    char bytes[512];
    const ssize_t count = ::recv(from, bytes, sizeof bytes, 0);
    if (count <= 0) return false;
    auto part = static_cast<std::size_t>(count);
    if (replies) part = std::min(part, cut_at_ - forwarded_);
    if (::send(to, bytes, part, MSG_NOSIGNAL) != static_cast<ssize_t>(part)) return false;
    if (replies) forwarded_ += part;
    if (!replies || forwarded_ < cut_at_) return true;
    cut_at_ = std::numeric_limits<std::size_t>::max();
    return false;
  }

  std::atomic<std::size_t> forwarded_{0}, cut_at_{std::numeric_limits<std::size_t>::max()};
  LoopbackProxy proxy_;  // last: its thread uses the others
};

}  // namespace armcal::test
