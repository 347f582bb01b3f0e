// tests - what an estimator takes from the tick and from the background, on an arm whose joints all move.
#include "armcal/estimator/estimator.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/runner/line.hpp"
#include "tests/target/measure.hpp"
#include "tests/target/raw_ticks.hpp"

namespace armcal::target {
namespace {

using Model = generated::Er20Like;

estimator::RigidPrior<Model, float> rigid;
estimator::AdoptedTable<Model> adopted;

// Push: the tick's share, of a tick that completes a sample and of the others. Sample: all slices of one.
template <class Filter>
void Measure(const char* name) {
  static estimator::Estimator<Model, Filter> arm;
  arm.SetPublishEvery(1000000);
  arm.Adopt(adopted, 0);
  while (arm.Step()) {
  }
  RawTicks<Model::kJoints> ticks;
  Range completing, others, sample, slice;
  for (int k = 0; k < 2000; ++k) {
    const model::RawSample<Model::kJoints>& raw = ticks.Next();
    const std::uint32_t push = CostOf([&] { (void)arm.Push(raw); });
    (arm.pending() != 0 ? completing : others).Add(push);
    if (arm.pending() == 0) continue;
    std::uint32_t sum = 0;
    for (bool busy = true; busy;) {
      const std::uint32_t spent = CostOf([&] { busy = arm.Step(); });
      if (!busy) break;
      slice.Add(spent);
      sum += spent;
    }
    sample.Add(sum);
  }
  port::runner::Line("estimator")
      .Text(name)
      .Value("push", others.most)
      .Value("push_max", completing.most)
      .Value("sample", sample.most)
      .Value("slice_max", slice.most)
      .Value("slice_min", slice.least)
      .Value("state_bytes", sizeof arm)
      .End();
}

}  // namespace

void MeasureEstimators() {
  if (!core::IsOk(estimator::BuildAdoptedTable(estimator::DefaultTable<Model>(), 1, rigid, adopted))) return;
  Measure<filter::ForgettingFilter<Model>>("forgetting");
  Measure<filter::KalmanFilter<Model, filter::Form::kBlock>>("kalman_block");
  Measure<filter::KalmanFilter<Model>>("kalman_dense");
}

}  // namespace armcal::target
