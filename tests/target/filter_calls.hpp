// tests - a filter behind plain functions, so that one program can run them all; knows layouts, no model.
#pragma once

#include <cstdint>

#include "armcal/filter/prior.hpp"

namespace armcal::target {

// Columns of a six-axis arm: 36 dense ones as base parameters lie, {1, 7, 7, 7, 7, 7} a link, and the rest in front.
template <int n>
struct SixJoints {
  static constexpr int kJoints = 6, kDense = 36, kFront = n - kDense, kColumns = n;
  static constexpr int kEach = kFront / kJoints;
  static_assert(kEach * kJoints == kFront);
  static constexpr int kFrontBegin[kJoints + 1] = {0, kEach, 2 * kEach, 3 * kEach, 4 * kEach, 5 * kEach, 6 * kEach};
  static constexpr int kRowBegin[kJoints] = {0, 1, 8, 15, 22, 29};
};

// One row, and what became of it.
struct Row {
  int joint;
  const float* front;
  const float* dense;  // [36], zero before the joint's first
  float y;
  bool use;
  filter::UpdateReport report;
};

struct FilterCalls {
  const char* name;
  int columns, front;
  const int* row_begin;
  std::uint32_t state_bytes;
  void (*restart)();
  void (*update)(Row& row);
  void (*end_sample)(std::uint32_t moving);
  void (*begin_read_out)();
  bool (*step_read_out)();
  const float* value;  // [columns] of the last read-out
  const float* sd;
};

// A prior with some correlation, process noise on the front columns, forgetting everywhere.
template <class Layout>
void MakePrior(filter::Prior<Layout>& prior) {
  for (int j = 0; j < Layout::kDense; ++j) {
    for (int i = 0; i < j; ++i)
      prior.dense_ud[math::UdIndex(i, j)] = static_cast<float>((7 * i + 3 * j) % 11 - 5) / 64.0f;
    prior.dense_ud[math::UdIndex(j, j)] = 1.0f;
  }
  for (int k = 0; k < Layout::kColumns; ++k) {
    prior.active[k] = ~0u;
    prior.lambda[k] = 0.999f;
    prior.noise[k] = k < Layout::kFront ? 1e-6f : 0.0f;
  }
  prior.link_floor = 1e-9f;
  prior.gate_sigma = 4.0f;
}

// The one instance of a filter type, and the calls to it. What they need of code and stack is the filter's.
template <class Filter, class Layout>
struct Instance {
  static inline filter::Prior<Layout> prior;
  static inline Filter filter;
  static inline typename Filter::ReadOut read_out;

  static void Restart() { filter.Restart(prior); }
  static void Update(Row& row) { row.report = filter.Update(row.joint, row.front, row.dense, row.y, row.use); }
  static void EndSample(std::uint32_t moving) { filter.EndSample(moving); }
  static void BeginReadOut() { filter.BeginReadOut(read_out); }
  static bool StepReadOut() { return filter.StepReadOut(read_out); }

  static FilterCalls Calls(const char* name) {
    MakePrior(prior);
    return {name,   Layout::kColumns, Layout::kFront, Layout::kRowBegin, sizeof(Filter), Restart,
            Update, EndSample,        BeginReadOut,   StepReadOut,       read_out.x,     read_out.sd};
  }
};

}  // namespace armcal::target
