// link - Modbus TCP: frames out of a byte stream, and the service that answers them for a few connections.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/link/pdu_engine.hpp"

namespace armcal::link {

inline constexpr std::size_t kMbapBytes = 7;
inline constexpr std::size_t kMaxTcpFrame = kMbapBytes + kMaxPdu;

// The receiver of one connection. A frame ends where its header says, whatever its function code is. After a header
// with another protocol than 0 or a length outside 2..254 the beginning of the next frame is unknown, so the connection
// has to be closed. Context of every call: background.
class TcpFramer {
 public:
  enum class Result : std::uint8_t { kNeedMore, kFrame, kBroken };

  // Takes bytes up to the end of one frame; `used` says how many. Call it again with the rest.
  Result OnBytes(const std::uint8_t* bytes, std::size_t count, std::size_t& used);

  // Function code and data. Valid after kFrame, until the next OnBytes.
  const std::uint8_t* pdu() const { return frame_ + kMbapBytes; }
  std::size_t pdu_bytes() const { return filled_ - kMbapBytes; }

  // Fills the header of an answer whose PDU has `pdu_bytes` bytes. header: [kMbapBytes].
  void PutReplyHeader(std::size_t pdu_bytes, std::uint8_t* header) const;

  bool mid_frame() const { return filled_ != 0 && !complete_; }
  void Reset() { *this = TcpFramer(); }

 private:
  std::uint8_t frame_[kMaxTcpFrame] = {};
  std::size_t filled_ = 0;
  bool complete_ = false;
};

// One framer and one session for each connection slot. A byte server calls these functions; `context` is the
// TcpService. Context of every call: background.
template <int kSlots>
class TcpService {
 public:
  static constexpr std::size_t kMaxReply = kMaxTcpFrame;

  explicit TcpService(PduEngine& engine, Rights rights = Rights::kReadWrite) : engine_(engine), rights_(rights) {}

  // A new connection has taken the slot. A connection that may only read owns nothing, so it needs no session. If all
  // sessions are in use, it is served as session 0 (see Sessions::Begin).
  static void Open(void* context, int slot) {
    Self(context).framers_[slot].Reset();
    const bool writes = Self(context).rights_ == Rights::kReadWrite;
    Self(context).Restart(slot, writes ? Self(context).engine_.sessions().Begin() : 0);
  }
  // The slot's connection is gone.
  static void Close(void* context, int slot) { Self(context).Restart(slot, 0); }
  // Returns true if the slot's connection should not make room for another one, because it has the seat.
  static bool Keep(void* context, int slot) {
    const std::uint32_t session = Self(context).session_[slot];
    return session != 0 && Self(context).engine_.sessions().writer() == session;
  }

  // Takes at most one request out of `bytes` [count] and puts its reply into `reply` [kMaxReply]. `used` says how many
  // bytes it took; call it again with the rest. Returns false if the stream cannot be understood any more; then close
  // the connection.
  static bool Receive(void* context, int slot, const std::uint8_t* bytes, std::size_t count, std::size_t* used,
                      std::uint8_t* reply, std::size_t* reply_bytes) {
    TcpFramer& framer = Self(context).framers_[slot];
    bool& asked = Self(context).asked_[slot];
    *reply_bytes = *used = 0;
    if (!asked) {
      const TcpFramer::Result result = framer.OnBytes(bytes, count, *used);
      if (result == TcpFramer::Result::kBroken) return false;
      if (result == TcpFramer::Result::kNeedMore) return true;
    }
    const std::size_t pdu = Self(context).engine_.Handle(framer.pdu(), framer.pdu_bytes(), reply + kMbapBytes,
                                                         Self(context).session_[slot], Self(context).rights_);
    asked = pdu == kReplyLater;
    if (asked) return true;
    framer.PutReplyHeader(pdu, reply);
    *reply_bytes = kMbapBytes + pdu;
    return true;
  }

  // Returns true if the reply to the slot's request is not ready. Then call Receive again in the next turn of the
  // background, with or without bytes, until Asked returns false. Receive takes no bytes meanwhile.
  static bool Asked(void* context, int slot) { return Self(context).asked_[slot]; }

  // Returns true if a part of a frame is there. The rest should follow soon.
  static bool MidFrame(void* context, int slot) { return Self(context).framers_[slot].mid_frame(); }

 private:
  static TcpService& Self(void* context) { return *static_cast<TcpService*>(context); }
  void Restart(int slot, std::uint32_t session) {
    if (session_[slot] != 0) engine_.sessions().End(session_[slot]);
    asked_[slot] = false;
    session_[slot] = session;
  }

  PduEngine& engine_;
  Rights rights_;
  TcpFramer framers_[kSlots];
  std::uint32_t session_[kSlots] = {};
  bool asked_[kSlots] = {};  // a request whose answer is not ready
};

}  // namespace armcal::link
