// tests - whole estimators on a recorded trace, with every filter of a model without nonlinear parameters.
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/target/trace_run.hpp"

using namespace armcal;          // NOLINT: the program is about all of it
using namespace armcal::target;  // NOLINT: the bench of these programs
using Model = generated::Er20Like;

namespace {

estimator::ImageWork<Model> work;
estimator::Image<Model> image;
Run<Model, filter::ForgettingFilter<Model>> forgetting = {"forgetting", {}, {}, {}};
Run<Model, filter::KalmanFilter<Model>> dense = {"kalman_dense", {}, {}, {}};
Run<Model, filter::KalmanFilter<Model, filter::Form::kBlock>> block = {"kalman_block", {}, {}, {}};

}  // namespace

// The answer is 1 if there is no trace, or if it taught the filters nothing.
int Program() {
  if (!core::IsOk(estimator::BuildImage(estimator::DefaultTable<Model>(), 1, work, image))) return 1;
  forgetting.Start(image);
  dense.Start(image);
  block.Start(image);
  const std::uint32_t ticks = ForEachTick([](const model::RawSample<6>& raw) {
    forgetting.Tick(raw);
    dense.Tick(raw);
    block.Tick(raw);
  });
  forgetting.Finish();
  dense.Finish();
  block.Finish();
  port::runner::Line("ticks").Decimal(ticks).End();
  return forgetting.estimates.rows_used[0] > 0 && dense.estimates.rows_used[0] > 0 ? 0 : 1;
}
