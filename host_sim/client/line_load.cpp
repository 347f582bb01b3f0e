// client - sums up the bytes of requests and replies, and measures what lies between them.
#include "host_sim/client/line_load.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

namespace armcal::client {

namespace reg = link::reg;

namespace {
constexpr int kLooks = 7, kFair = 1, kMostDecimation = 125;
// Windows are preferred: pages are as fast only when many records wait, and a lost request for one costs two seconds.
constexpr double kPreferred = 1.3;
constexpr double kReadBytes = 8 + 5;       // request, and a reply without its registers
constexpr double kExchangeBytes = 17 + 5;  // the same of function 23, which acknowledges
constexpr double kPlainRequest = 120;      // registers of one plain request

// The whole window goes over the line, whatever it holds.
double ByWindows(const LineLoad& line, int record_words) {
  const int fit = reg::kWindowWords / record_words;
  return fit == 0 ? 1e9 : ((kExchangeBytes + 2 * reg::kWindowBlock.count) / line.bytes_per_s + line.turnaround_s) / fit;
}

double ByPages(const LineLoad& line, int record_words) {
  return 2.0 * record_words / line.bytes_per_s +
         record_words / kPlainRequest * (kReadBytes / line.bytes_per_s + line.turnaround_s);
}

}  // namespace

bool LineLoad::WindowPays(int record_words) const {
  return window && ByWindows(*this, record_words) < kPreferred * ByPages(*this, record_words);
}

double LineLoad::SecondsOf(int record_words) const {
  return WindowPays(record_words) ? ByWindows(*this, record_words) : ByPages(*this, record_words);
}

int LineLoad::Decimation(int record_words, int wanted, int sample_ticks, double tick_rate_Hz,
                         double other_share) const {
  const double left = kLineShare - other_share;
  for (int d = wanted; left > 0 && d <= kMostDecimation; d = d % sample_ticks == 0 ? d + sample_ticks : d + 1)
    if (SecondsOf(record_words) * tick_rate_Hz / d <= left) return d;
  return 0;
}

LineLoad MeasureLine(DriveClient& drive, bool window) {
  using Clock = std::chrono::steady_clock;
  LineLoad load{drive.line()->bytes_per_s(), 0, window};
  std::vector<double> took_s;
  for (int k = 0; k < kLooks; ++k) {
    const auto start = Clock::now();
    (void)drive.ReadValue<reg::kTick>();
    took_s.push_back(std::chrono::duration<double>(Clock::now() - start).count());
  }
  // Not the least, which luck may make, and not the mean, which a busy PC makes.
  std::sort(took_s.begin(), took_s.end());
  load.turnaround_s = std::max(0.0, took_s[kFair] - (kReadBytes + 4) / load.bytes_per_s);
  return load;
}

}  // namespace armcal::client
