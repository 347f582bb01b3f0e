// tests - whole estimators on a recorded trace: what each publishes on the way and in the end.
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

estimator::ImageWork<Model> work;
estimator::Image<Model> image;

template <class Filter>
struct Run {
  const char* name;
  estimator::Estimator<Model, Filter> estimator;
  estimator::Estimates<Model> estimates;
  Digest rows;  // what every row did

  static void See(void* context, const model::Sample<6>& sample, const float* tau_model_Nm) {
    auto& run = *static_cast<Run*>(context);
    run.rows.Add(tau_model_Nm, 6);
    for (const std::uint8_t flags : sample.flags) run.rows.Add(std::uint32_t{flags});
  }
  void Start() {
    estimator.SetObserver(See, this);
    estimator.SetPublishEvery(1250);
    estimator.Adopt(image, 0);
  }
  void Tick(const model::RawSample<6>& raw) {
    (void)estimator.Push(raw);  // the background keeps up, below
    while (estimator.Step()) {
    }
    if (!estimator.Take(estimates)) return;
    Digest all;
    all.Add(estimates.value, Model::kColumns);
    all.Add(estimates.sd, Model::kColumns);
    Line(name).Decimal(estimates.samples).Hex(rows.value()).Hex(all.value()).End();
  }
  void Finish() {
    estimator.RequestReadOut();
    while (estimator.Step()) {
    }
    estimator.Take(estimates);
    for (int k = 0; k < Model::kColumns; ++k)
      Line("column").Decimal(k).Hex(ResultBits(estimates.value[k])).Hex(ResultBits(estimates.sd[k])).End();
    for (int i = 0; i < 6; ++i)
      Line("joint")
          .Decimal(i + 1)
          .Decimal(estimates.rows_used[i])
          .Decimal(estimates.rows_gated[i])
          .Hex(ResultBits(estimates.nis[i]))
          .Hex(ResultBits(estimates.residual_rms_Nm[i]))
          .End();
  }
};

Run<filter::ForgettingFilter<Model>> forgetting = {"forgetting", {}, {}, {}};
Run<filter::KalmanFilter<Model>> kalman = {"kalman", {}, {}, {}};

}  // namespace

// The answer is 1 if there is no trace, or if it taught the filters nothing.
int Program() {
  const auto table = estimator::DefaultTable<Model>();
  if (!core::IsOk(estimator::BuildImage(table, 1, work, image))) return 1;
  forgetting.Start();
  kalman.Start();
  static TraceTick ticks[256];
  model::RawSample<6> raw;
  for (std::size_t bytes; (bytes = port::runner::Read(ticks, sizeof ticks)) != 0;) {
    for (const TraceTick* tick = ticks; tick != ticks + bytes / sizeof(TraceTick); ++tick) {
      for (int i = 0; i < 6; ++i) {
        raw.counts[i] = tick->counts[i];
        raw.current[i] = tick->current[i];
        raw.flags[i] = tick->flags[i];
        raw.temperature_degC[i] = 0.01f * static_cast<float>(tick->temperature_cdegC[i]);
      }
      forgetting.Tick(raw);
      kalman.Tick(raw);
      ++raw.tick;
    }
  }
  forgetting.Finish();
  kalman.Finish();
  Line("ticks").Decimal(raw.tick).End();
  return forgetting.estimates.rows_used[0] > 0 && kalman.estimates.rows_used[0] > 0 ? 0 : 1;
}
