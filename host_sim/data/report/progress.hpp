// report - shows on stderr how far a long step is.
#pragma once

#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>

namespace armcal::report {

// On a terminal one line that rewrites itself: the share that is done and, after two seconds, how long the rest takes
// at this pace. Elsewhere (a file, a pipe) nothing, so that stderr holds messages only. It clears its line when it
// goes, so that a message never stands inside it.
class Progress {
 public:
  explicit Progress(std::string task, std::FILE* out = stderr);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // done: 0 to 1. Cheap when nothing visible changes.
  void Set(double done);
  // What stands behind the share from now on: the best figure so far, for instance. Any thread may call it.
  void Note(const std::string& text);
  // Takes the line away, so that something else can be printed. The next Set shows it again.
  void Clear();

 private:
  std::string task_, note_;
  std::mutex note_mutex_;
  std::FILE* out_;
  bool terminal_;
  int shown_percent_ = -1;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace armcal::report
