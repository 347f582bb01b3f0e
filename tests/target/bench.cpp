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

// Slices are what the background may not divide: an update by one row, the end of a sample, a step of the read-out.
struct FilterCost {
  Range sample, row, end, solve, step;
  std::uint32_t stack_bytes = 0;

  void Deeper(std::uint32_t bytes) { stack_bytes = bytes > stack_bytes ? bytes : stack_bytes; }
};

// Six rows and their end, all of one kind; the joints that move take turns.
void Sample(const FilterCalls& filter, Rows& rows, RowKind kind, std::uint32_t moving, FilterCost& cost) {
  std::uint32_t sum = 0;
  for (int joint = 0; joint < 6; ++joint) {
    Row row = rows.Next(joint, kind);
    const std::uint32_t spent = CostOf([&] { filter.update(row); });
    cost.row.Add(spent);
    sum += spent;
  }
  const std::uint32_t spent = CostOf([&] { filter.end_sample(moving); });
  cost.end.Add(spent);
  cost.sample.Add(sum + spent);
}

void Solve(const FilterCalls& filter, FilterCost& cost) {
  std::uint32_t sum = CostOf([&] { filter.begin_read_out(); });
  for (bool done = false; !done;) {
    const std::uint32_t spent = CostOf([&] { done = filter.step_read_out(); });
    cost.step.Add(spent);
    sum += spent;
  }
  cost.solve.Add(sum);
}

void Deepest(const FilterCalls& filter, Rows& rows, FilterCost& cost) {
  for (int joint = 0; joint < 6; ++joint) {
    Row row = rows.Next(joint, RowKind::kPlain);
    cost.Deeper(StackOf([&] { filter.update(row); }));
  }
  cost.Deeper(StackOf([&] { filter.end_sample(63); }));
  cost.Deeper(StackOf([&] { filter.begin_read_out(); }));
  for (bool done = false; !done;) cost.Deeper(StackOf([&] { done = filter.step_read_out(); }));
}

void MeasureFilter(const FilterCalls& filter) {
  FilterCost cost;
  Rows rows(filter);
  filter.restart();
  for (int round = 0; round < 6; ++round) {
    const auto moving = static_cast<std::uint32_t>(63 >> round);
    for (int kind = 0; kind < static_cast<int>(RowKind::kKinds); ++kind)
      Sample(filter, rows, static_cast<RowKind>(kind), moving, cost);
    Solve(filter, cost);
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
      .Value("slice_max", cost.row.most)
      .Value("slice_min", cost.row.least)
      .Value("end", cost.end.most)
      .Value("step_max", cost.step.most)
      .Value("step_min", cost.step.least)
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
