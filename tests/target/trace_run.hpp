// tests - one estimator along a recorded trace: what it publishes on the way and in the end.
#pragma once

#include "armcal/estimator/estimator.hpp"
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"
#include "tests/target/trace_tick.hpp"

namespace armcal::target {

template <class Model, class Filter>
struct Run {
  const char* name = nullptr;
  estimator::Estimator<Model, Filter> estimator;
  estimator::Estimates<Model> estimates;
  Digest rows;  // what every row did

  static void See(void* context, const model::Sample<6>& sample, const float* tau_model_Nm) {
    auto& run = *static_cast<Run*>(context);
    run.rows.Add(tau_model_Nm, 6);
    for (const std::uint8_t flags : sample.flags) run.rows.Add(std::uint32_t{flags});
  }
  void Start(const estimator::AdoptedTable<Model>& adopted) {
    estimator.SetObserver(See, this);
    estimator.SetPublishEvery(1250);
    estimator.Adopt(adopted, 0);
  }
  void Tick(const model::RawSample<6>& raw) {
    (void)estimator.Push(raw);  // the background keeps up, below
    while (estimator.Step()) {
    }
    if (!estimator.Take(estimates)) return;
    Digest all;
    all.Add(estimates.value, Model::kColumns);
    all.Add(estimates.sd, Model::kColumns);
    port::runner::Line(name).Decimal(estimates.samples).Hex(rows.value()).Hex(all.value()).End();
  }
  void Finish() {
    estimator.RequestReadOut();
    while (estimator.Step()) {
    }
    estimator.Take(estimates);
    for (int k = 0; k < Model::kColumns; ++k)
      port::runner::Line("column")
          .Decimal(k)
          .Hex(ResultBits(estimates.value[k]))
          .Hex(ResultBits(estimates.sd[k]))
          .End();
    for (int e = 0; e < Model::kNonlinear; ++e)
      port::runner::Line("eta").Decimal(e).Hex(ResultBits(estimates.eta[e])).Hex(ResultBits(estimates.eta_sd[e])).End();
    for (int i = 0; i < 6; ++i)
      port::runner::Line("joint")
          .Decimal(i + 1)
          .Decimal(estimates.rows_used[i])
          .Decimal(estimates.rows_gated[i])
          .Hex(ResultBits(estimates.nis[i]))
          .Hex(ResultBits(estimates.residual_rms_Nm[i]))
          .End();
  }
};

// Calls each(raw) for every tick of the trace. Answers how many there were.
template <class Each>
std::uint32_t ForEachTick(Each each) {
  static TraceTick ticks[256];
  model::RawSample<6> raw;
  for (std::size_t bytes; (bytes = port::runner::Read(ticks, sizeof ticks)) != 0;) {
    for (const TraceTick* tick = ticks; tick != ticks + bytes / sizeof(TraceTick); ++tick) {
      Unpack(*tick, raw);
      each(raw);
      ++raw.tick;
    }
  }
  return raw.tick;
}

// All of them side by side along the trace, from the model's own table. The answer is 1 if there is no trace, or if it
// taught one of them nothing.
template <class Model, class... Filters>
int RunAlong(Run<Model, Filters>&... runs) {
  static physical::RigidPrior<Model, float> rigid;
  static estimator::AdoptedTable<Model> adopted;
  if (!core::IsOk(estimator::BuildAdoptedTable(estimator::DefaultTable<Model>(), 1, rigid, adopted))) return 1;
  (runs.Start(adopted), ...);
  const std::uint32_t ticks = ForEachTick([&](const model::RawSample<6>& raw) { (runs.Tick(raw), ...); });
  (runs.Finish(), ...);
  port::runner::Line("ticks").Decimal(ticks).End();
  return ((runs.estimates.rows_used[0] > 0) && ...) ? 0 : 1;
}

}  // namespace armcal::target
