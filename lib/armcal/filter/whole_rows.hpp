// filter - a filter's verbs without slices, made of those in slices; knows no filter.
#pragma once

#include "armcal/filter/row.hpp"
#include "armcal/filter/slices.hpp"

namespace armcal::filter {

// Base of a Filter with BeginRow, StepRow, report, BeginEnd and StepEnd. Context: background.
template <class Filter>
class WholeRows {
 public:
  // A whole row, as BeginRow takes it.
  template <class... Row>
  UpdateReport Update(int joint, const Row&... row) {
    self().BeginRow(joint, row...);
    int all = kNoSlices;
    (void)self().StepRow(all);
    return self().report();
  }
  // A whole end of a sample, as BeginEnd takes it.
  void EndSample(std::uint32_t moving) {
    self().BeginEnd(moving);
    int all = kNoSlices;
    (void)self().StepEnd(all);
  }

 private:
  Filter& self() { return static_cast<Filter&>(*this); }
};

}  // namespace armcal::filter
