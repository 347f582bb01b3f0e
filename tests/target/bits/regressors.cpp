// tests - every generated regressor along a random walk: rows, states and sensitivities.
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"
#include "tests/target/regressor_list.hpp"

using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

void Run(const RegressorCalls& model) {
  constexpr int kSamples = 500, kPrinted = 50;
  const int n = model.joints;
  Line("regressor").Text(model.name).End();
  Numbers numbers(9);
  Digest digest;
  for (int sample = 1; sample <= kSamples; ++sample) {
    for (int i = 0; i < n; ++i) {
      model.input[i] += 0.1f * numbers.Signed();
      model.input[n + i] = 2.0f * numbers.Signed();
      model.input[2 * n + i] = 10.0f * numbers.Signed();
      model.input[3 * n + i] = numbers.Between(20.0f, 60.0f);
    }
    model.input[4 * n] = 0.008f * static_cast<float>(sample);
    model.input[4 * n + 1] = 0.008f;
    if (sample % 200 == 1) model.start();
    model.evaluate();
    model.differentiate();
    digest.Add(model.front_rows, model.front);
    digest.Add(model.dense_rows, model.dense);
    digest.Add(model.jacobian, model.nonlinear);
    if (sample % kPrinted == 0) Line("sample").Decimal(sample).Hex(digest.value()).End();
  }
}

}  // namespace

int Program() {
  ForEachRegressor(Run);
  return 0;
}
