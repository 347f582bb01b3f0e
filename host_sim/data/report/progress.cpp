// report - prints the progress line.
#include "host_sim/data/report/progress.hpp"

#include <unistd.h>

#include <algorithm>

namespace armcal::report {

Progress::Progress(std::string task, std::FILE* out)
    : task_(std::move(task)), out_(out), terminal_(isatty(fileno(out)) == 1) {}

Progress::~Progress() { Clear(); }

void Progress::Clear() {
  if (!terminal_ || shown_percent_ < 0) return;
  std::fputs("\r\033[K", out_);
  std::fflush(out_);
  shown_percent_ = -1;
}

void Progress::Set(double done) {
  if (!terminal_) return;
  const int percent = static_cast<int>(100 * std::clamp(done, 0.0, 1.0) + 1e-9);
  if (percent <= shown_percent_) return;
  shown_percent_ = percent;
  constexpr int kWidth = 30;
  const int full = percent * kWidth / 100;
  std::fprintf(out_, "\r%s [%s%s] %3d %%\033[K", task_.c_str(),
               std::string(static_cast<std::size_t>(full), '#').c_str(),
               std::string(static_cast<std::size_t>(kWidth - full), '.').c_str(), percent);
  std::fflush(out_);
}

}  // namespace armcal::report
