// tests - an estimator whose slices the tick interrupts wherever it falls: the estimates are those of a quiet machine.
#include "armcal/estimator/estimator.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"
#include "tests/target/trace_tick.hpp"

using namespace armcal;          // NOLINT: the program is about all of it
using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;
using Model = generated::Er20Like;

namespace {

constexpr std::uint32_t kTicks = 10000;
// Instructions between two ticks: a prime, so that ticks drift through the slices; an eighth of a sample's work fits
// in.
constexpr std::uint32_t kPeriod = 8009;

TraceTick trace[kTicks];
estimator::ImageWork<Model> work;
estimator::Image<Model> image;
estimator::Estimator<Model, filter::ForgettingFilter<Model>> arm;
std::uint32_t next = 0;

void Tick() {
  model::RawSample<6> raw;
  raw.tick = next;
  Unpack(trace[next], raw);
  ++next;
  (void)arm.Push(raw);  // a refusal is counted and printed below
}

}  // namespace

// The answer is 1 without a trace, or if the background was so late that a sample was lost.
int Program() {
  if (port::runner::Read(trace, sizeof trace) != sizeof trace) return 1;
  if (!core::IsOk(estimator::BuildImage(estimator::DefaultTable<Model>(), 1, work, image))) return 1;
  arm.SetPublishEvery(1000000);  // at the end only: the first publication is the adopted table's
  arm.Adopt(image, 0);
  while (arm.Step()) {
  }
  port::runner::RunContexts(kTicks, kPeriod, Tick, [] { return arm.Step(); });
  arm.RequestReadOut();
  while (arm.Step()) {
  }
  estimator::Estimates<Model> estimates;
  arm.Take(estimates);
  for (int k = 0; k < Model::kColumns; ++k)
    Line("column").Decimal(k).Hex(ResultBits(estimates.value[k])).Hex(ResultBits(estimates.sd[k])).End();
  Line("samples").Decimal(estimates.samples).Decimal(estimates.refused).Decimal(estimates.rows_used[0]).End();
  return estimates.refused == 0 && estimates.rows_used[0] > 0 ? 0 : 1;
}
