// filter - how a filter is called, in slices or in whole rows (WholeRows), and its report of a row (UpdateReport).
//
// Work is counted in elements of a factor's column: one element is eight instructions on a Cortex-M4F. A call in slices
// is given `credit` and takes off what it spends. When no credit is left, it stops at the next place where it can,
// which may be a few elements later. The caller keeps what is left over, also if that is a debt, and adds the credit of
// the next slice to it. So all slices but the last are nearly equal.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"

namespace armcal::filter {

inline constexpr int kSliceCredit = 2600;  // at most: some 21 000 instructions, 0.2 ms on a Cortex-M4F at 168 MHz
inline constexpr int kNoSlices = 1 << 30;  // enough for anything in one call

// Credit of each slice if work of this cost is divided into equal slices.
constexpr int EqualSlices(int cost) {
  const int slices = (cost + kSliceCredit - 1) / kSliceCredit;
  return slices > 1 ? (cost + slices - 1) / slices : cost;
}

// What one row did. Whitened units. All zero before a filter's first row: a static filter then needs no flash for its
// initial bytes.
struct UpdateReport {
  float innovation = 0.0f;  // whitened measurement minus this filter's prediction; 0 if not accepted
  float variance = 0.0f;    // its variance by this filter (forgetting form: from data alone, without the prior)
  bool accepted = false;
  core::Status status = core::Status::kOk;  // kOk, kGated, kNotFinite, kOutOfRange (element beyond kRowLimit)
};

// The calls without slices, made of those in slices. Base of a Filter that has BeginRow, StepRow, StepRows, report,
// BeginEnd and StepEnd. Context: background.
//
// A sample has at most one row of each joint: for each row BeginRow, then StepRow until it returns true. Then StepRows
// until it returns true; then the reports of all rows stand. Then BeginEnd, and StepEnd until it returns true.
template <class Filter>
class WholeRows {
 public:
  // A sample of one row. Arguments as of BeginRow.
  template <class... Row>
  UpdateReport Update(int joint, const Row&... row) {
    self().BeginRow(joint, row...);
    int all = kNoSlices;
    (void)self().StepRow(all);
    (void)self().StepRows(all);
    return self().report(joint);
  }
  // The whole end of a sample. Arguments as of BeginEnd.
  void EndSample(std::uint32_t moving) {
    self().BeginEnd(moving);
    int all = kNoSlices;
    (void)self().StepEnd(all);
  }

 private:
  Filter& self() { return static_cast<Filter&>(*this); }
};

}  // namespace armcal::filter
