// link - open connections: which one sent the present request, and which one may write.
#pragma once

#include <cstdint>

namespace armcal::link {

// A session is a TCP connection, or a serial line for as long as the power is on. Session numbers repeat only after
// some 2^27 sessions. Session 0 is the firmware itself, which asks without a connection. Another session may take over
// what a session owns (the seat, a recording) when that session has ended, or when it has sent no request during the
// last kPatience_ms. Context of every call: background.
class Sessions {
 public:
  static constexpr int kMost = 20;
  static constexpr std::uint32_t kPatience_ms = 10000;
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;

  // Begins a session and returns its number. 0: there are kMost sessions already; the new connection then shares what
  // the firmware itself may do.
  std::uint32_t Begin() {
    for (std::uint32_t slot = 0; slot < kMost; ++slot) {
      if (open_[slot] != 0) continue;
      begun_ = begun_ % 0x07FFFFFEu + 1;
      open_[slot] = begun_ * kRoom + slot;
      seen_ms_[slot] = now_ms_;
      return open_[slot];
    }
    return 0;
  }
  // The session's connection is gone. A session that is not open is ignored.
  void End(std::uint32_t session) {
    if (IsOpen(session) && session != 0) open_[session % kRoom] = 0;
  }
  // From now on until the next call, requests are this session's.
  void Ask(std::uint32_t session) {
    asking_ = session;
    if (IsOpen(session) && session != 0) seen_ms_[session % kRoom] = now_ms_;
  }
  // The present time. Call it in every turn of the background.
  void Tell(std::uint32_t now_ms) { now_ms_ = now_ms; }

  std::uint32_t asking() const { return asking_; }
  bool IsOpen(std::uint32_t session) const {
    return session == 0 || (session % kRoom < kMost && open_[session % kRoom] == session);
  }
  // Open, and it has asked a short while ago. The firmware itself never keeps others from anything.
  bool IsPresent(std::uint32_t session) const {
    return session != 0 && IsOpen(session) && now_ms_ - seen_ms_[session % kRoom] < kPatience_ms;
  }

  // The seat: the one session that has unlocked, or kNobody.
  std::uint32_t writer() const { return writer_; }
  // Gives the seat to a session, or to kNobody.
  void SetWriter(std::uint32_t session) { writer_ = session; }

 private:
  static constexpr std::uint32_t kRoom = 32;  // a session's number modulo kRoom is its place in the lists
  std::uint32_t open_[kMost] = {}, seen_ms_[kMost] = {};
  std::uint32_t begun_ = 0, asking_ = 0, writer_ = kNobody, now_ms_ = 0;
};

}  // namespace armcal::link
