// bench - how long a piece of work takes, in CPU time of this thread; knows no work.
#pragma once

#include <algorithm>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

namespace armcal::bench {
namespace {  // this program's own: nothing here may meet the same code compiled otherwise

constexpr double kBlock_ns = 5e5;  // shorter blocks feel the clock's own cost

// Wall time would count what else the machine does.
inline double CpuTime_ns() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

// What the compiler must take as read and written here.
inline void Touch(const void* p) { asm volatile("" : : "g"(p) : "memory"); }

struct Work {
  std::string name;
  std::function<void(int calls)> run;
  double per_call = 1;  // evaluations or samples in one call
  std::vector<double> time_ns = {};
  int calls = 0;

  double quantile(double share) const {
    std::vector<double> sorted = time_ns;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  double median_ns() const { return quantile(0.5); }
};

// Times `blocks` blocks of each work in turn, so that what the machine does meanwhile falls on all of them alike.
inline void Measure(std::vector<Work*> works, int blocks) {
  const auto time_ns = [](const Work& w) {
    const double start = CpuTime_ns();
    w.run(w.calls);
    return CpuTime_ns() - start;
  };
  for (Work* w : works)
    for (w->calls = 1; time_ns(*w) < kBlock_ns;) w->calls *= 2;
  for (int b = 0; b < blocks; ++b)
    for (Work* w : works) w->time_ns.push_back(time_ns(*w) / (w->calls * w->per_call));
}

}  // namespace
}  // namespace armcal::bench
