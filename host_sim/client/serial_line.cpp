// client - asks the kernel for a speed by its number, which termios cannot, and waits for silence.
#include "host_sim/client/serial_line.hpp"

#include <asm/termbits.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>

namespace armcal::client {

int SetSpeed(int descriptor, int baud) {
  termios2 settings;
  if (ioctl(descriptor, TCGETS2, &settings) != 0) return 0;
  settings.c_cflag &= ~static_cast<tcflag_t>(CBAUD | (CBAUD << IBSHIFT));
  settings.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(baud);
  if (ioctl(descriptor, TCSETS2, &settings) != 0 || ioctl(descriptor, TCGETS2, &settings) != 0) return 0;
  return static_cast<int>(settings.c_ospeed);
}

void SetExclusive(int descriptor, bool exclusive) { ioctl(descriptor, exclusive ? TIOCEXCL : TIOCNXCL); }

bool DrainToSilence(int descriptor, int quiet_ms) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(2);
  pollfd watched{descriptor, POLLIN, 0};
  while (Clock::now() < end) {
    if (poll(&watched, 1, quiet_ms) <= 0) return true;
    char bytes[256];
    if (read(descriptor, bytes, sizeof bytes) <= 0) return true;  // the line is gone; the next request will say so
  }
  return false;
}

}  // namespace armcal::client
