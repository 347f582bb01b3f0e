// link - joins a serial line, the RTU framer and the PDU engine; knows no register.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/hardware/clock.hpp"
#include "armcal/hardware/serial.hpp"
#include "armcal/link/pdu_engine.hpp"
#include "armcal/link/rtu_framer.hpp"

namespace armcal::link {

class RtuService {
 public:
  RtuService(PduEngine& engine, const hardware::Serial& serial, const hardware::Clock& clock, std::uint8_t address,
             std::uint32_t silence_ms)
      : engine_(engine), serial_(serial), clock_(clock), framer_(address, silence_ms) {}

  // One portion of bytes and at most one request. Never waits. Context: background.
  void Poll() {
    if (sent_ < reply_bytes_) {
      sent_ += serial_.Write(reply_ + sent_, reply_bytes_ - sent_);
      return;
    }
    if (taken_ == there_) {
      taken_ = 0;
      there_ = serial_.Read(bytes_, sizeof bytes_);
    }
    std::size_t used = 0;
    const RtuFramer::Result result = framer_.OnBytes(bytes_ + taken_, there_ - taken_, clock_.Ms(), used);
    taken_ += used;
    if (result == RtuFramer::Result::kNothing) return;
    const std::size_t pdu = engine_.Handle(framer_.pdu(), framer_.pdu_bytes(), reply_ + 1);
    sent_ = 0;
    reply_bytes_ = result == RtuFramer::Result::kBroadcast || pdu == 0 ? 0 : framer_.FinishReply(reply_, pdu);
  }

 private:
  PduEngine& engine_;
  hardware::Serial serial_;
  hardware::Clock clock_;
  RtuFramer framer_;
  std::uint8_t bytes_[64] = {};
  std::size_t there_ = 0, taken_ = 0;
  std::uint8_t reply_[kMaxRtuFrame] = {};
  std::size_t reply_bytes_ = 0, sent_ = 0;
};

}  // namespace armcal::link
