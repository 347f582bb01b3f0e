// port_linux - a serial line of the machine, or a pseudo-terminal, as lib's serial line.
#pragma once

#include <string>

#include "armcal/core/status.hpp"
#include "armcal/hardware/serial.hpp"

namespace armcal::port_linux {

enum class Parity { kEven, kNone };

class TtySerial {
 public:
  TtySerial() = default;
  ~TtySerial();
  TtySerial(const TtySerial&) = delete;
  TtySerial& operator=(const TtySerial&) = delete;

  // Raw bytes, eight data bits, one stop bit. kBadAddress: it cannot be opened or is no terminal. kOutOfRange: the
  // speed is not 9600, 19200, 38400, 57600, 115200 or 230400 baud.
  core::Status Open(const std::string& path, int baud = 115200, Parity parity = Parity::kEven);

  // Valid while this object lives.
  hardware::Serial serial();

 private:
  static std::size_t Read(void* self, std::uint8_t* bytes, std::size_t capacity);
  static std::size_t Write(void* self, const std::uint8_t* bytes, std::size_t count);

  int tty_ = -1;
};

}  // namespace armcal::port_linux
