// client - a serial line of the PC: any speed that its hardware takes, silence before a request is repeated, and how
// fast it is.
#pragma once

#include <string>

namespace armcal::client {

// As SPEC.md has it: eight data bits, one stop bit.
struct SerialLine {
  std::string device;  // "/dev/ttyUSB0"
  int baud = 115200;
  char parity = 'E';  // N, E or O

  double bytes_per_s() const { return baud / (parity == 'N' ? 10.0 : 11.0); }
};

// Sets an open line to any speed. Returns the speed that the hardware took, 0 if it took none.
int SetSpeed(int descriptor, int baud);

// Whether the line belongs to this program alone until it is closed. Programs of root may open it all the same.
void SetExclusive(int descriptor, bool exclusive);

// Reads and drops what comes until nothing has come for `quiet_ms`. False: bytes were still coming after two seconds.
bool DrainToSilence(int descriptor, int quiet_ms);

}  // namespace armcal::client
