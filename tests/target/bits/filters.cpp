// tests - every filter on rows good, gated and bad: what it answers, and what it knows in the end.
#include "port/runner/line.hpp"
#include "tests/target/filter_list.hpp"
#include "tests/target/rows.hpp"

using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

void PrintReadOut(const FilterCalls& filter) {
  filter.begin_read_out();
  while (!filter.step_read_out()) {
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
  for (int sample = 1; sample <= kSamples; ++sample) {
    for (int joint = 0; joint < 6; ++joint) {
      Row row = rows.Next(joint, rows.Draw());
      filter.update(row);
      digest.Add(row.report.innovation);
      digest.Add(row.report.variance);
      digest.Add(static_cast<std::uint32_t>(row.report.status) << 1 | row.report.accepted);
    }
    filter.end_sample(sample % 7 == 0 ? 21u : 63u);
    if (sample % kPrinted == 0) Line("sample").Decimal(sample).Hex(digest.value()).End();
  }
  PrintReadOut(filter);
}

}  // namespace

int Program() {
  ForEachFilter(Run);
  return 0;
}
