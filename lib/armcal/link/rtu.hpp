// link - Modbus RTU: frames out of a byte stream, and the service that answers them on a serial line.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/hardware/clock.hpp"
#include "armcal/hardware/serial.hpp"
#include "armcal/link/pdu_engine.hpp"

namespace armcal::link {

inline constexpr std::size_t kMaxRtuFrame = 1 + kMaxPdu + 2;

// One line's receiver. A request of a known function ends at its known length if the checksum agrees; so does a reply
// of another device, which is skipped. Everything else ends with silence: a host's operating system cannot keep the 3.5
// characters of the specification, so that silence alone is not enough, and a garbled length must not deafen us longer.
class RtuFramer {
 public:
  enum class Result : std::uint8_t { kNothing, kRequest, kBroadcast };

  // `address`: ours, 1 to 247. `silence_ms`: after so long a pause a frame begins anew (2 above 19200 baud; more where
  // the driver delivers in portions).
  RtuFramer(std::uint8_t address, std::uint32_t silence_ms) : address_(address), silence_ms_(silence_ms) {}

  // Takes bytes up to the end of one frame; `used` says how many. Call again with the rest; call with count 0 from time
  // to time so that silence is noticed. kRequest: answer. kBroadcast: act, stay silent. Context: background.
  Result OnBytes(const std::uint8_t* bytes, std::size_t count, std::uint32_t now_ms, std::size_t& used);

  // After kRequest or kBroadcast, until the next OnBytes.
  const std::uint8_t* pdu() const { return frame_ + 1; }
  std::size_t pdu_bytes() const { return filled_ - 3; }

  // Turns a reply PDU already at frame + 1 into a frame; returns its length. `frame` [kMaxRtuFrame].
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
  bool overrun_ = false;  // more bytes than any frame: wait for silence
  std::uint32_t last_byte_ms_ = 0;
};

class RtuService {
 public:
  RtuService(PduEngine& engine, const hardware::Serial& serial, const hardware::Clock& clock, std::uint8_t address,
             std::uint32_t silence_ms)
      : engine_(engine), serial_(serial), clock_(clock), framer_(address, silence_ms) {}

  // One portion of bytes and at most one request. Never waits. Context: background.
  void Poll();

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
