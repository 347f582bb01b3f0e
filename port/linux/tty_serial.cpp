// port_linux - sets a terminal up with termios and reads it without waiting.
#include "port/linux/tty_serial.hpp"

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

namespace armcal::port_linux {

using core::Status;

namespace {

struct Speed {
  int baud;
  speed_t code;
};
constexpr Speed kSpeeds[] = {{9600, B9600},   {19200, B19200},   {38400, B38400},
                             {57600, B57600}, {115200, B115200}, {230400, B230400}};

}  // namespace

TtySerial::~TtySerial() {
  if (tty_ >= 0) ::close(tty_);
}

Status TtySerial::Open(const std::string& path, int baud, Parity parity) {
  const Speed* speed = nullptr;
  for (const Speed& s : kSpeeds)
    if (s.baud == baud) speed = &s;
  if (speed == nullptr) return Status::kOutOfRange;
  const int tty = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios settings;
  if (tty < 0 || ::tcgetattr(tty, &settings) != 0) {
    if (tty >= 0) ::close(tty);
    return Status::kBadAddress;
  }
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARODD | CRTSCTS);
  if (parity == Parity::kEven) settings.c_cflag |= PARENB;
  ::cfsetispeed(&settings, speed->code);
  ::cfsetospeed(&settings, speed->code);
  if (::tcsetattr(tty, TCSANOW, &settings) != 0) {
    ::close(tty);
    return Status::kBadAddress;
  }
  if (tty_ >= 0) ::close(tty_);
  tty_ = tty;
  return Status::kOk;
}

hardware::Serial TtySerial::serial() { return {this, &Read, &Write}; }

std::size_t TtySerial::Read(void* self, std::uint8_t* bytes, std::size_t capacity) {
  const ssize_t count = ::read(static_cast<TtySerial*>(self)->tty_, bytes, capacity);
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::size_t TtySerial::Write(void* self, const std::uint8_t* bytes, std::size_t count) {
  const ssize_t written = ::write(static_cast<TtySerial*>(self)->tty_, bytes, count);
  return written > 0 ? static_cast<std::size_t>(written) : 0;
}

}  // namespace armcal::port_linux
