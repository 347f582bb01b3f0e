// tests - what the model of the cores looks at: one sample of each filter with 60 columns, and one regressor.
//
// Every piece lies between a call of Begin and one of End, which QEMU's trace shows; toolchains/cycles.py finds them
// there. Prints the name of each piece, in the same order.
#include "port/runner/line.hpp"
#include "tests/target/filter_list.hpp"
#include "tests/target/regressor_list.hpp"
#include "tests/target/rows.hpp"

using namespace armcal::target;        // NOLINT: the bench of these programs
using namespace armcal::port::runner;  // NOLINT: what it runs on

extern "C" {
[[gnu::noipa]] void Begin() { __asm volatile(""); }
[[gnu::noipa]] void End() { __asm volatile(""); }
}

namespace {

bool IsNamed(const char* name, const char* wanted) {
  while (*name != '\0' && *name == *wanted) ++name, ++wanted;
  return *name == *wanted;
}

template <class Work>
void Piece(const char* name, const char* suffix, Work work) {
  Write(name);
  Write(suffix);
  Write("\n");
  Begin();
  work();
  End();
}

template <int count>
const float* Kept(const float* from, float (&to)[count]) {
  for (int k = 0; k < count; ++k) to[k] = from[k];
  return to;
}

void Sample(const FilterCalls& filter) {
  if (filter.columns != 60 || IsNamed(filter.name, "bank")) return;  // no program uses the bank
  Rows rows(filter);
  Row row[6];
  static float front[6][11], dense[6][36], eta[6][12];  // because the numbers of a row last until the next one
  for (int joint = 0; joint < 6; ++joint) {
    row[joint] = rows.Next(joint, RowKind::kPlain);
    row[joint].front = Kept(row[joint].front, front[joint]);
    row[joint].dense = Kept(row[joint].dense, dense[joint]);
    row[joint].eta = Kept(row[joint].eta, eta[joint]);
  }
  int all = armcal::filter::kNoSlices;
  filter.restart();
  Piece(filter.name, "_60", [&] {
    for (int joint = 0; joint < 6; ++joint) {
      filter.begin_row(row[joint]);
      (void)filter.step_row(all);
    }
    (void)filter.step_rows(all);
    filter.begin_end(63);
    (void)filter.step_end(all);
  });
}

void Regressor(const RegressorCalls& model) {
  if (!IsNamed(model.name, "er20_like")) return;
  for (int i = 0; i < 4 * model.joints + 2; ++i) model.input[i] = 0.1f * static_cast<float>(i);
  model.start();
  Piece(model.name, "", model.evaluate);
}

}  // namespace

int Program() {
  ForEachFilter(Sample);
  ForEachRegressor(Regressor);
  return 0;
}
