// tool - shows how far the computations of a verb are.
#pragma once

#include <string>

#include "codegen/src/io/watch.hpp"
#include "host_sim/data/report/progress.hpp"

namespace armcal::tool {

// While one lives, a line on the terminal follows what io::SetDone says. Clear() before anything is printed.
class Watched {
 public:
  explicit Watched(const std::string& task) : line_(task), watch_([this](double share) { line_.Set(share); }) {}
  void Clear() { line_.Clear(); }
  void Note(const std::string& text) { line_.Note(text); }

 private:
  report::Progress line_;
  io::Watch watch_;
};

}  // namespace armcal::tool
