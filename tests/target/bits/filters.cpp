// tests - every filter on rows good, gated and bad: what it answers, and what it knows in the end.
#include "port/runner/line.hpp"
#include "tests/target/filter_list.hpp"
#include "tests/target/rows.hpp"

using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

void PrintReadOut(const FilterCalls& filter) {
  filter.begin_read_out();
  int credit = armcal::filter::kNoSlices;
  while (!filter.step_read_out(credit)) {
  }
  for (int k = 0; k < filter.columns; ++k)
    Line("column").Decimal(k).Hex(ResultBits(filter.value[k])).Hex(ResultBits(filter.sd[k])).End();
}

void Run(const FilterCalls& filter) {
  constexpr int kSamples = 400, kPrinted = 40;
  Line("filter").Text(filter.name).Decimal(filter.columns).End();
  filter.restart();
  Rows rows(filter);
  Digest digest;
  const int slice = filter.slice_credit();
  int credit = slice;
  for (int sample = 1; sample <= kSamples; ++sample) {
    for (int joint = 0; joint < 6; ++joint) {
      filter.begin_row(rows.Next(joint, rows.Draw()));
      while (!filter.step_row(credit)) credit += slice;
    }
    while (!filter.step_rows(credit)) credit += slice;
    for (int joint = 0; joint < 6; ++joint) {
      const auto& report = filter.report(joint);
      digest.Add(report.innovation);
      digest.Add(report.variance);
      digest.Add(static_cast<std::uint32_t>(report.status) << 1 | report.accepted);
    }
    filter.begin_end(sample % 7 == 0 ? 21u : 63u);
    while (!filter.step_end(credit)) credit += slice;
    if (sample % kPrinted == 0) Line("sample").Decimal(sample).Hex(digest.value()).End();
  }
  PrintReadOut(filter);
  if (filter.solve == nullptr) return;
  filter.solve();
  Digest solution;
  solution.Add(filter.value, filter.columns);
  Line("solution").Hex(solution.value()).End();
}

}  // namespace

int Program() {
  ForEachFilter(Run);
  return 0;
}
