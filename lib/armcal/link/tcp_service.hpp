// link - joins TCP framers and the PDU engine for a server with a few connections; knows no socket.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/link/pdu_engine.hpp"
#include "armcal/link/tcp_framer.hpp"

namespace armcal::link {

// One framer a connection slot. The three functions fit a byte server's hooks; `context` is the TcpService.
template <int kSlots>
class TcpService {
 public:
  static constexpr std::size_t kMaxReply = kMaxTcpFrame;

  explicit TcpService(PduEngine& engine) : engine_(engine) {}

  // A new connection uses the slot.
  static void Open(void* context, int slot) { Self(context).framers_[slot].Reset(); }

  // Takes at most one request out of `bytes` and puts its reply into `reply` [kMaxReply]. `used`: bytes taken; call
  // again with the rest. False: the stream makes no sense any more, close it.
  static bool Receive(void* context, int slot, const std::uint8_t* bytes, std::size_t count, std::size_t* used,
                      std::uint8_t* reply, std::size_t* reply_bytes) {
    TcpFramer& framer = Self(context).framers_[slot];
    *reply_bytes = 0;
    const TcpFramer::Result result = framer.OnBytes(bytes, count, *used);
    if (result == TcpFramer::Result::kBroken) return false;
    if (result == TcpFramer::Result::kNeedMore) return true;
    const std::size_t pdu = Self(context).engine_.Handle(framer.pdu(), framer.pdu_bytes(), reply + kMbapBytes);
    framer.PutReplyHeader(pdu, reply);
    *reply_bytes = kMbapBytes + pdu;
    return true;
  }

  // Part of a frame is there: the rest should follow soon.
  static bool MidFrame(void* context, int slot) { return Self(context).framers_[slot].mid_frame(); }

 private:
  static TcpService& Self(void* context) { return *static_cast<TcpService*>(context); }

  PduEngine& engine_;
  TcpFramer framers_[kSlots];
};

}  // namespace armcal::link
