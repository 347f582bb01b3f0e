// link - finds the end of a TCP frame by its header, byte by byte.
#include "armcal/link/tcp.hpp"

#include "armcal/core/words.hpp"

namespace armcal::link {

namespace {
constexpr std::size_t kProtocolAt = 2, kLengthAt = 4, kUnitAt = 6;
}

TcpFramer::Result TcpFramer::OnBytes(const std::uint8_t* bytes, std::size_t count, std::size_t& used) {
  if (complete_) {
    complete_ = false;
    filled_ = 0;
  }
  for (used = 0; used < count;) {
    frame_[filled_++] = bytes[used++];
    if (filled_ == kLengthAt && core::GetBytes16(frame_ + kProtocolAt) != 0) return Result::kBroken;
    if (filled_ < kMbapBytes) continue;
    const std::size_t length = core::GetBytes16(frame_ + kLengthAt);  // unit identifier and PDU
    if (length < 2 || length > 1 + kMaxPdu) return Result::kBroken;
    if (filled_ == kUnitAt + length) {
      complete_ = true;
      return Result::kFrame;
    }
  }
  return Result::kNeedMore;
}

void TcpFramer::PutReplyHeader(std::size_t pdu_bytes, std::uint8_t* header) const {
  for (std::size_t i = 0; i < kLengthAt; ++i) header[i] = frame_[i];
  core::PutBytes16(header + kLengthAt, static_cast<std::uint16_t>(pdu_bytes + 1));
  header[kUnitAt] = frame_[kUnitAt];
}

}  // namespace armcal::link
