// tests - estimators whose slices the tick interrupts wherever it falls: the estimates are those of a quiet machine.
#include "armcal/estimator/estimator.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"
#include "tests/target/trace_tick.hpp"

using namespace armcal;          // NOLINT: the program is about all of it
using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;
using Model = generated::Er20Like;

namespace {

constexpr std::uint32_t kTicks = 8000;

TraceTick trace[kTicks];
physical::RigidPrior<Model, float> rigid;
estimator::AdoptedTable<Model> adopted;
std::uint32_t next;

template <class Filter>
estimator::Estimator<Model, Filter> arm;

template <class Filter>
void Tick() {
  model::RawSample<6> raw;
  raw.tick = next;
  Unpack(trace[next], raw);
  ++next;
  (void)arm<Filter>.Push(raw);  // a refusal is counted and printed below
}

// period: instructions between two ticks, a prime, so that ticks drift through the slices. Eight must hold a sample's
// work. False: a sample was lost because the background was late, or none was used.
template <class Filter>
bool Run(const char* name, std::uint32_t period) {
  auto& estimator = arm<Filter>;
  const auto background = [] { return arm<Filter>.Step(); };
  estimator.SetPublishEvery(1000000);  // at the end only: the first publication is the adopted table's
  estimator.Adopt(adopted, 0);
  while (background()) {
  }
  next = 0;
  port::runner::RunContexts(kTicks, period, Tick<Filter>, background);
  estimator.RequestReadOut();
  while (background()) {
  }
  estimator::Estimates<Model> estimates;
  estimator.Take(estimates);
  Digest result;
  result.Add(estimates.value, Model::kColumns);
  result.Add(estimates.sd, Model::kColumns);
  result.Add(estimates.nis, 6);
  Line(name).Decimal(estimates.samples).Decimal(estimates.rows_used[0]).Hex(result.value()).End();
  return estimates.refused == 0 && estimates.rows_used[0] > 0;
}

}  // namespace

int Program() {
  if (port::runner::Read(trace, sizeof trace) != sizeof trace) return 1;
  if (!core::IsOk(estimator::BuildAdoptedTable(estimator::DefaultTable<Model>(), 1, rigid, adopted))) return 1;
  const bool forgetting = Run<filter::ForgettingFilter<Model>>("forgetting", 10007);
  const bool kalman = Run<filter::KalmanFilter<Model, filter::Form::kBlock>>("kalman_block", 18013);
  return forgetting && kalman ? 0 : 2;
}
