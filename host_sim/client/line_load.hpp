// client - tells how many records a second a serial line can carry.
#pragma once

#include "host_sim/client/drive_client.hpp"

namespace armcal::client {

struct LineLoad {
  double bytes_per_s = 0;
  double turnaround_s = 0;  // from the last byte of a request to the first of the reply, as measured
  bool window = false;      // the drive serves function 23 and the window: one request for up to 114 registers

  // Whether records of so many registers come faster by windows than by pages.
  bool WindowPays(int record_words) const;
  // What of the line's time a record of so many registers needs.
  double SecondsOf(int record_words) const;
  // The least decimation, at least `wanted` and a multiple of `sample_ticks` above it, at which records of so many
  // registers leave a part of the line free for repeats. 0: none does. `other_share`: of the line's time that is taken.
  int Decimation(int record_words, int wanted, int sample_ticks, double tick_rate_Hz, double other_share) const;
};

// What of the line's time recordings may need; the rest is for repeats.
inline constexpr double kLineShare = 0.88;

// Measures the turnaround with a few requests. The drive's connection must be a serial line.
LineLoad MeasureLine(DriveClient& drive, bool window);

}  // namespace armcal::client
