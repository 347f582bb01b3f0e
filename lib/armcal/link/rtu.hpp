// link - Modbus RTU: frames out of a byte stream, and the service that answers them on a serial line.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/hardware/clock.hpp"
#include "armcal/hardware/serial.hpp"
#include "armcal/link/pdu_engine.hpp"

namespace armcal::link {

inline constexpr std::size_t kMaxRtuFrame = 1 + kMaxPdu + 2;

// The receiver of one line. A request of a known function ends at its known length if the checksum agrees. The reply of
// another device ends in the same way and is skipped. Everything else ends with silence. Silence alone would not be
// enough, because a host's operating system cannot keep the 3.5 characters of the specification. Length alone would not
// be enough, because after a garbled length nothing would be heard for a long time. Context of every call: background.
class RtuFramer {
 public:
  enum class Result : std::uint8_t { kNothing, kRequest, kBroadcast };

  // `address`: of this device, 1 to 247. `silence_ms`: after a pause of this length a new frame begins. Take 2 above
  // 19200 baud, and more if the driver delivers bytes in portions.
  RtuFramer(std::uint8_t address, std::uint32_t silence_ms) : address_(address), silence_ms_(silence_ms) {}

  // Takes bytes up to the end of one frame; `used` says how many. Call it again with the rest. Call it with count 0
  // from time to time, so that it notices silence. kRequest: carry it out and answer. kBroadcast: carry it out, do not
  // answer. Context: background.
  Result OnBytes(const std::uint8_t* bytes, std::size_t count, std::uint32_t now_ms, std::size_t& used);

  // Valid after kRequest or kBroadcast, until the next OnBytes.
  const std::uint8_t* pdu() const { return frame_ + 1; }
  std::size_t pdu_bytes() const { return filled_ - 3; }

  // Turns a reply PDU, which lies at frame + 1, into a frame and returns its length. frame: [kMaxRtuFrame].
  std::size_t FinishReply(std::uint8_t* frame, std::size_t pdu_bytes) const;

 private:
  bool ChecksumHolds() const;
  bool EndsHere() const;
  Result Deliver();

  std::uint8_t address_;
  std::uint32_t silence_ms_;
  std::uint8_t frame_[kMaxRtuFrame] = {};
  std::size_t filled_ = 0;
  bool complete_ = false;
  bool overrun_ = false;  // more bytes have come than any frame has: wait for silence
  std::uint32_t last_byte_ms_ = 0;
};

// The service of one serial line, which is one session for as long as the power is on. `engine` must outlive it. Call
// Poll more often than once in silence_ms, or a frame that arrives in two portions is lost. Context of every call:
// background.
class RtuService {
 public:
  RtuService(PduEngine& engine, const hardware::Serial& serial, const hardware::Clock& clock, std::uint8_t address,
             std::uint32_t silence_ms)
      : engine_(engine),
        serial_(serial),
        clock_(clock),
        framer_(address, silence_ms),
        session_(engine.sessions().Begin()) {}

  // Reads one portion of bytes and answers at most one request. It never waits. While the answer to a request is not
  // ready, it reads nothing.
  void Poll();

 private:
  PduEngine& engine_;
  hardware::Serial serial_;
  hardware::Clock clock_;
  RtuFramer framer_;
  std::uint32_t session_;  // the line's: whoever writes on it
  std::uint8_t bytes_[64] = {};
  std::size_t there_ = 0, taken_ = 0;
  RtuFramer::Result asked_ = RtuFramer::Result::kNothing;  // a request whose answer is not ready
  std::uint8_t reply_[kMaxRtuFrame] = {};
  std::size_t reply_bytes_ = 0, sent_ = 0;
};

}  // namespace armcal::link
