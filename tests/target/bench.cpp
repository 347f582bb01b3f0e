// tests - what filters, regressors and estimators cost on the machine that runs this: a line each, in its counter's
// unit.
//
// On the emulated boards the unit is one instruction; the budgets target reads these lines. On a board of yours it is
// one core cycle (PORTING.md says how). Every count is taken on rows and inputs of all kinds; "least" is the smallest.
#include <limits>

#include "port/runner/line.hpp"
#include "port/runner/stack.hpp"
#include "tests/target/filter_list.hpp"
#include "tests/target/measure.hpp"
#include "tests/target/regressor_list.hpp"
#include "tests/target/rows.hpp"

using namespace armcal::target;        // NOLINT: the bench of these programs
using namespace armcal::port::runner;  // NOLINT: what it runs on

namespace {

// Sample: six rows and their end at once. Slice: the same in equal slices, as the estimator cuts it. Solve: what gives
// the estimate, with its deviations if the filter has no cheaper way; read-out: estimate and deviations.
struct FilterCost {
  Range sample, slice, solve, read_out;
  std::uint32_t stack_bytes = 0;
};

void Sample(const FilterCalls& filter, Rows& rows, RowKind kind, std::uint32_t moving, FilterCost& cost) {
  std::uint32_t sum = 0;
  int all = armcal::filter::kNoSlices;
  for (int joint = 0; joint < 6; ++joint) {
    const Row row = rows.Next(joint, kind);
    sum += CostOf([&] { filter.begin_row(row); });
    sum += CostOf([&] { (void)filter.step_row(all); });
  }
  sum += CostOf([&] { (void)filter.step_rows(all); });
  sum += CostOf([&] { filter.begin_end(moving); });
  sum += CostOf([&] { (void)filter.step_end(all); });
  cost.sample.Add(sum);
}

// Adds up what is done until the credit is gone.
class Slices {
 public:
  Slices(int credit, Range& range) : slice_(credit), credit_(credit), range_(range) {}

  template <class Call>
  void Do(Call call) {
    if (credit_ <= 0) Cut();
    spent_ += CostOf(call);
  }
  template <class Step>
  void Finish(Step step) {
    for (bool done = false; !done;) Do([&] { done = step(credit_); });
  }
  void Cut() {
    range_.Add(spent_);
    spent_ = 0;
    credit_ += slice_;
  }

 private:
  int slice_, credit_;
  std::uint32_t spent_ = 0;
  Range& range_;
};

void SampleInSlices(const FilterCalls& filter, Rows& rows, FilterCost& cost) {
  Slices slices(filter.slice_credit(), cost.slice);
  for (int joint = 0; joint < 6; ++joint) {
    const Row row = rows.Next(joint, RowKind::kPlain);
    slices.Do([&] { filter.begin_row(row); });
    slices.Finish(filter.step_row);
  }
  slices.Finish(filter.step_rows);
  slices.Do([&] { filter.begin_end(63); });
  slices.Finish(filter.step_end);
  slices.Cut();
}

void ReadOut(const FilterCalls& filter, FilterCost& cost) {
  int all = armcal::filter::kNoSlices;
  const std::uint32_t begin = CostOf([&] { filter.begin_read_out(); });
  const std::uint32_t sum = begin + CostOf([&] { (void)filter.step_read_out(all); });
  cost.read_out.Add(sum);
  cost.solve.Add(filter.solve == nullptr ? sum : CostOf(filter.solve));
}

void Deepest(const FilterCalls& filter, Rows& rows, FilterCost& cost) {
  int all = armcal::filter::kNoSlices;
  const auto go = [&](auto call) {
    const std::uint32_t bytes = StackOf(call);
    cost.stack_bytes = bytes > cost.stack_bytes ? bytes : cost.stack_bytes;
  };
  for (int joint = 0; joint < 6; ++joint) {
    const Row row = rows.Next(joint, RowKind::kPlain);
    go([&] { filter.begin_row(row); });
    go([&] { (void)filter.step_row(all); });
  }
  go([&] { (void)filter.step_rows(all); });
  go([&] { filter.begin_end(63); });
  go([&] { (void)filter.step_end(all); });
  go([&] { filter.begin_read_out(); });
  go([&] { (void)filter.step_read_out(all); });
  if (filter.solve != nullptr) go(filter.solve);
}

void MeasureFilter(const FilterCalls& filter) {
  FilterCost cost;
  Rows rows(filter);
  filter.restart();
  for (int round = 0; round < 6; ++round) {
    const auto moving = static_cast<std::uint32_t>(63 >> round);
    for (int kind = 0; kind < static_cast<int>(RowKind::kKinds); ++kind)
      Sample(filter, rows, static_cast<RowKind>(kind), moving, cost);
    SampleInSlices(filter, rows, cost);
    ReadOut(filter, cost);
  }
  Deepest(filter, rows, cost);
  Line("filter")
      .Text(filter.name)
      .Value("n", static_cast<std::uint32_t>(filter.columns))
      .Value("n_front", static_cast<std::uint32_t>(filter.front))
      .Value("instructions", cost.sample.most)
      .Value("instructions_least", cost.sample.least)
      .Value("solve", cost.solve.most)
      .Value("solve_least", cost.solve.least)
      .Value("read_out", cost.read_out.most)
      .Value("read_out_least", cost.read_out.least)
      .Value("slice_max", cost.slice.most)
      .Value("slice_min", cost.slice.least)
      .Value("state_bytes", filter.state_bytes)
      .Value("painted_bytes", cost.stack_bytes)
      .End();
}

void MeasureRegressor(const RegressorCalls& model) {
  Numbers numbers(7);
  Range cost;
  for (int k = 0; k < 20; ++k) {
    const float size = k % 5 == 4 ? std::numeric_limits<float>::quiet_NaN() : k % 5 == 3 ? 0.0f : 3.0f;
    for (int i = 0; i < 4 * model.joints + 2; ++i) model.input[i] = size * numbers.Signed();
    model.start();
    cost.Add(CostOf([&] { model.evaluate(); }));
  }
  Line("regressor")
      .Text(model.name)
      .Value("instructions", cost.most)
      .Value("instructions_least", cost.least)
      .Value("painted_bytes", StackOf([&] { model.evaluate(); }))
      .End();
}

}  // namespace

int Program() {
  ForEachFilter(MeasureFilter);
  ForEachRegressor(MeasureRegressor);
  MeasureEstimators();
  MeasureReadOut();
  return 0;
}
