// report - prints the progress line.
#include "host_sim/data/report/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>

namespace armcal::report {

namespace {

constexpr double kFirstGuess_s = 2;

// " 12 s left", " 3 min left"; empty: it is too early to say.
std::string Left(double past_s, double done) {
  if (past_s < kFirstGuess_s || done <= 0 || done >= 1) return {};
  const double left_s = past_s * (1 - done) / done;
  const bool minutes = left_s >= 100;
  return " " + std::to_string(static_cast<int>(std::ceil(minutes ? left_s / 60 : left_s))) +
         (minutes ? " min left" : " s left");
}

}  // namespace

Progress::Progress(std::string task, std::FILE* out)
    : task_(std::move(task)), out_(out), terminal_(isatty(fileno(out)) == 1) {}

Progress::~Progress() { Clear(); }

void Progress::Clear() {
  if (!terminal_ || shown_percent_ < 0) return;
  std::fputs("\r\033[K", out_);
  std::fflush(out_);
  shown_percent_ = -1;
}

void Progress::Note(const std::string& text) {
  const std::lock_guard lock(note_mutex_);
  note_ = text;
}

void Progress::Set(double done) {
  if (!terminal_) return;
  const int percent = static_cast<int>(100 * std::clamp(done, 0.0, 1.0) + 1e-9);
  if (percent <= shown_percent_) return;
  shown_percent_ = percent;
  constexpr int kWidth = 30;
  const int full = percent * kWidth / 100;
  const std::lock_guard lock(note_mutex_);
  const double past_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  std::fprintf(out_, "\r%s [%s%s] %3d %%%s%s%s\033[K", task_.c_str(),
               std::string(static_cast<std::size_t>(full), '#').c_str(),
               std::string(static_cast<std::size_t>(kWidth - full), '.').c_str(), percent, Left(past_s, done).c_str(),
               note_.empty() ? "" : ", ", note_.c_str());
  std::fflush(out_);
}

}  // namespace armcal::report
