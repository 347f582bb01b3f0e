// link - who asks: the connections that are open, the one whose request is carried out, and the one that may write.
#pragma once

#include <cstdint>

namespace armcal::link {

// A session is a TCP connection, or a serial line for as long as the power is on. Its number is never used again for
// another one (they wrap after 2^28). Session 0 is the firmware itself, which asks without a connection. What a session
// owns is free for others when it has ended, or when it has not asked for kPatience_ms. Context: background.
class Sessions {
 public:
  static constexpr int kMost = 12;
  static constexpr std::uint32_t kPatience_ms = 10000;
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;

  // 0: there are kMost sessions already; the new one then shares what the firmware itself may do.
  std::uint32_t Begin() {
    for (std::uint32_t slot = 0; slot < kMost; ++slot) {
      if (open_[slot] != 0) continue;
      begun_ = begun_ % 0x0FFFFFFEu + 1;
      open_[slot] = begun_ * 16 + slot;
      seen_ms_[slot] = now_ms_;
      return open_[slot];
    }
    return 0;
  }
  void End(std::uint32_t session) {
    if (IsOpen(session) && session != 0) open_[session % 16] = 0;
  }
  // From now on until the next call, requests are this session's.
  void Ask(std::uint32_t session) {
    asking_ = session;
    if (IsOpen(session) && session != 0) seen_ms_[session % 16] = now_ms_;
  }
  void Tell(std::uint32_t now_ms) { now_ms_ = now_ms; }

  std::uint32_t asking() const { return asking_; }
  bool IsOpen(std::uint32_t session) const {
    return session == 0 || (session % 16 < kMost && open_[session % 16] == session);
  }
  // Open, and it has asked a short while ago. The firmware itself never keeps others from anything.
  bool IsPresent(std::uint32_t session) const {
    return session != 0 && IsOpen(session) && now_ms_ - seen_ms_[session % 16] < kPatience_ms;
  }

  // The seat: the one session that has unlocked, or kNobody.
  std::uint32_t writer() const { return writer_; }
  void SetWriter(std::uint32_t session) { writer_ = session; }

 private:
  std::uint32_t open_[kMost] = {}, seen_ms_[kMost] = {};
  std::uint32_t begun_ = 0, asking_ = 0, writer_ = kNobody, now_ms_ = 0;
};

}  // namespace armcal::link
