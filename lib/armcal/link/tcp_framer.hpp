// link - Modbus TCP frames out of a byte stream; knows no socket and no function code.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/link/pdu_engine.hpp"

namespace armcal::link {

inline constexpr std::size_t kMbapBytes = 7;
inline constexpr std::size_t kMaxTcpFrame = kMbapBytes + kMaxPdu;

// One connection's receiver: a frame ends where its header says, whatever its function code would suggest.
// A header that cannot be one (protocol not 0, length outside 2..254) makes the stream unreadable from there on; only
// closing the connection finds a frame's beginning again.
class TcpFramer {
 public:
  enum class Result : std::uint8_t { kNeedMore, kFrame, kBroken };

  // Takes bytes up to the end of one frame; `used` says how many. Call again with the rest. Context: background.
  Result OnBytes(const std::uint8_t* bytes, std::size_t count, std::size_t& used);

  // After kFrame, until the next OnBytes: function code and data.
  const std::uint8_t* pdu() const { return frame_ + kMbapBytes; }
  std::size_t pdu_bytes() const { return filled_ - kMbapBytes; }

  // Puts the header of the answer before a reply PDU of `pdu_bytes` bytes: `header` [kMbapBytes].
  void PutReplyHeader(std::size_t pdu_bytes, std::uint8_t* header) const;

  bool mid_frame() const { return filled_ != 0 && !complete_; }
  void Reset() { *this = TcpFramer(); }

 private:
  std::uint8_t frame_[kMaxTcpFrame] = {};
  std::size_t filled_ = 0;
  bool complete_ = false;
};

}  // namespace armcal::link
