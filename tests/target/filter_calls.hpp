// tests - a filter behind plain functions, so that one program can run them all.
#pragma once

#include <cstdint>
#include <new>

#include "armcal/filter/prior.hpp"
#include "armcal/filter/row.hpp"
#include "armcal/filter/slices.hpp"

namespace armcal::target {

// Columns of a six-axis arm: 36 dense ones as base parameters lie, {1, 7, 7, 7, 7, 7} a link, nonlinear parameters
// alike for every joint, and the rest in front; n in all.
template <int n, int nonlinear>
struct SixJoints {
  static constexpr int kJoints = 6, kDense = 36, kNonlinear = nonlinear;
  static constexpr int kColumns = n - nonlinear, kFront = kColumns - kDense;
  static constexpr int kEach = kFront / kJoints;
  static_assert(kEach * kJoints == kFront);
  static constexpr int kFrontBegin[kJoints + 1] = {0, kEach, 2 * kEach, 3 * kEach, 4 * kEach, 5 * kEach, 6 * kEach};
  static constexpr int kRowBegin[kJoints] = {0, 1, 8, 15, 22, 29};
};

struct Row {
  int joint;
  const float* front;
  const float* dense;  // [36], zero before the joint's first
  const float* eta;    // [nonlinear], zero but for the joint's own
  float y;
  bool use;
};

// Credit and what it buys are those of filter/slices.hpp; a step answers true when its work is done.
struct FilterCalls {
  const char* name;
  int columns, front, nonlinear;
  const int* row_begin;
  std::uint32_t state_bytes;
  void (*restart)();
  int (*slice_credit)();  // that cuts a sample into equal slices
  void (*begin_row)(const Row& row);
  bool (*step_row)(int& credit);
  bool (*step_rows)(int& credit);
  const filter::UpdateReport& (*report)(int joint);
  void (*begin_end)(std::uint32_t moving);
  bool (*step_end)(int& credit);
  void (*begin_read_out)();
  bool (*step_read_out)(int& credit);
  void (*solve)();     // the data alone, without deviations; nullptr: the filter has the estimate at hand
  const float* value;  // [columns] of the last read-out or solution
  const float* sd;     // [columns] of the last read-out
};

// A prior with some correlation, process noise on the front columns and on eta, forgetting everywhere.
template <class Layout>
void MakePrior(filter::Prior<Layout>& prior) {
  for (int j = 0; j < Layout::kDense; ++j) {
    for (int i = 0; i < j; ++i)
      prior.dense_ud[math::UdIndex(i, j)] = static_cast<float>((7 * i + 3 * j) % 11 - 5) / 64.0f;
    prior.dense_ud[math::UdIndex(j, j)] = 1.0f;
  }
  for (int k = 0; k < Layout::kColumns + Layout::kNonlinear; ++k) {
    prior.active[k] = ~0u;
    prior.lambda[k] = 0.999f;
    prior.noise[k] = k < Layout::kFront || k >= Layout::kColumns ? 1e-6f : 0.0f;
  }
  prior.link_floor = 1e-6f;
}

// One filter at a time lives here, with its prior and its read-out, so that a small board has room for the bench.
alignas(8) inline unsigned char room[48 * 1024];

// A filter type, and the calls to it. What they need of code and stack is the filter's.
template <class Filter, class Layout, bool kSolves>
struct Instance {
  struct Parts {
    filter::Prior<Layout> prior;
    Filter filter;
    typename Filter::ReadOut read_out;
  };
  static_assert(sizeof(Parts) <= sizeof room);
  static Parts& parts() { return *reinterpret_cast<Parts*>(room); }

  [[gnu::noinline]] static void MakeParts() {
    new (room) Parts;
    MakePrior(parts().prior);
  }
  static void Restart() {
    MakeParts();
    parts().filter.Restart(parts().prior);
  }
  static int SliceCredit() { return filter::EqualSlices(parts().filter.SampleCost()); }
  static void BeginRow(const Row& row) {
    if constexpr (Layout::kNonlinear > 0)
      parts().filter.BeginRow(row.joint, row.front, row.dense, row.y, row.use, row.eta);
    else parts().filter.BeginRow(row.joint, row.front, row.dense, row.y, row.use);
  }
  static bool StepRow(int& credit) { return parts().filter.StepRow(credit); }
  static bool StepRows(int& credit) { return parts().filter.StepRows(credit); }
  static const filter::UpdateReport& Report(int joint) { return parts().filter.report(joint); }
  static void BeginEnd(std::uint32_t moving) { parts().filter.BeginEnd(moving); }
  static bool StepEnd(int& credit) { return parts().filter.StepEnd(credit); }
  static void BeginReadOut() { parts().filter.BeginReadOut(parts().read_out); }
  static bool StepReadOut(int& credit) { return parts().filter.StepReadOut(parts().read_out, credit); }
  static void Solve() {
    if constexpr (kSolves) parts().filter.Solve(parts().read_out.x);
  }

  static FilterCalls Calls(const char* name) {
    return {name,
            Layout::kColumns + Layout::kNonlinear,
            Layout::kFront,
            Layout::kNonlinear,
            Layout::kRowBegin,
            sizeof(Filter),
            Restart,
            SliceCredit,
            BeginRow,
            StepRow,
            StepRows,
            Report,
            BeginEnd,
            StepEnd,
            BeginReadOut,
            StepReadOut,
            kSolves ? Solve : nullptr,
            parts().read_out.x,
            parts().read_out.sd};
  }
};

}  // namespace armcal::target
