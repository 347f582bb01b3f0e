// link - from the bytes of a serial line to a request and its reply. An RTU frame ends by its length or by silence.
#include "armcal/link/rtu.hpp"

#include "armcal/core/crc.hpp"

namespace armcal::link {

namespace {

constexpr std::size_t kNever = 0;

// The length of a whole request, by the part of it that is there. kNever: it cannot be told, now or at all.
std::size_t RequestBytes(const std::uint8_t* frame, std::size_t filled) {
  switch (frame[1]) {
    case 3:
    case 4:
    case 6:
      return 8;
    case 16:
      return filled > 6 ? 9u + frame[6] : kNever;
    case 23:
      return filled > 10 ? 13u + frame[10] : kNever;
    case 43:
      return 7;
    default:
      return kNever;
  }
}

// The same for another device's reply.
std::size_t ReplyBytes(const std::uint8_t* frame, std::size_t filled) {
  if (frame[1] & 0x80u) return 5;
  switch (frame[1]) {
    case 3:
    case 4:
    case 23:
      return filled > 2 ? 5u + frame[2] : kNever;
    case 6:
    case 16:
      return 8;
    default:
      return kNever;
  }
}

}  // namespace

bool RtuFramer::ChecksumHolds() const {
  if (filled_ < 4) return false;
  const std::uint16_t crc = core::Crc16(frame_, filled_ - 2);
  return frame_[filled_ - 2] == (crc & 0xFFu) && frame_[filled_ - 1] == (crc >> 8);
}

bool RtuFramer::EndsHere() const {
  if (filled_ < 4) return false;
  const bool foreign = frame_[0] != address_ && frame_[0] != 0;
  const bool may_end = filled_ == RequestBytes(frame_, filled_) || (foreign && filled_ == ReplyBytes(frame_, filled_));
  return may_end && ChecksumHolds();
}

RtuFramer::Result RtuFramer::Deliver() {
  const std::uint8_t to = frame_[0];
  if (to != address_ && to != 0) {
    filled_ = 0;
    return Result::kNothing;
  }
  complete_ = true;
  return to == 0 ? Result::kBroadcast : Result::kRequest;
}

RtuFramer::Result RtuFramer::OnBytes(const std::uint8_t* bytes, std::size_t count, std::uint32_t now_ms,
                                     std::size_t& used) {
  used = 0;
  if (complete_) {
    complete_ = false;
    filled_ = 0;
  }
  if ((filled_ != 0 || overrun_) && now_ms - last_byte_ms_ >= silence_ms_) {
    // A whole frame whose function or length was not expected gets an exception as its answer.
    const bool whole = !overrun_ && ChecksumHolds();
    overrun_ = false;
    if (whole) {
      const Result result = Deliver();
      if (result != Result::kNothing) return result;
    }
    filled_ = 0;
  }
  if (count != 0) last_byte_ms_ = now_ms;
  while (used < count) {
    if (filled_ == kMaxRtuFrame) {
      overrun_ = true;
      used = count;
      return Result::kNothing;
    }
    frame_[filled_++] = bytes[used++];
    if (!EndsHere()) continue;
    const Result result = Deliver();
    if (result != Result::kNothing) return result;
  }
  return Result::kNothing;
}

std::size_t RtuFramer::FinishReply(std::uint8_t* frame, std::size_t pdu_bytes) const {
  frame[0] = address_;
  const std::uint16_t crc = core::Crc16(frame, pdu_bytes + 1);
  frame[pdu_bytes + 1] = static_cast<std::uint8_t>(crc & 0xFFu);
  frame[pdu_bytes + 2] = static_cast<std::uint8_t>(crc >> 8);
  return pdu_bytes + 3;
}

void RtuService::Poll() {
  if (sent_ < reply_bytes_) {
    sent_ += serial_.Write(reply_ + sent_, reply_bytes_ - sent_);
    return;
  }
  RtuFramer::Result result = asked_;
  if (result == RtuFramer::Result::kNothing) {
    if (taken_ == there_) {
      taken_ = 0;
      there_ = serial_.Read(bytes_, sizeof bytes_);
    }
    std::size_t used = 0;
    result = framer_.OnBytes(bytes_ + taken_, there_ - taken_, clock_.Ms(), used);
    taken_ += used;
    if (result == RtuFramer::Result::kNothing) return;
  }
  const std::size_t pdu = engine_.Handle(framer_.pdu(), framer_.pdu_bytes(), reply_ + 1, session_);
  asked_ = pdu == kReplyLater ? result : RtuFramer::Result::kNothing;
  if (pdu == kReplyLater) return;
  sent_ = 0;
  reply_bytes_ = result == RtuFramer::Result::kBroadcast || pdu == 0 ? 0 : framer_.FinishReply(reply_, pdu);
}

}  // namespace armcal::link
