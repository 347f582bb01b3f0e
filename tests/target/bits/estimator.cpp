// tests - whole estimators on a recorded trace, with every filter of a model without nonlinear parameters.
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/target/trace_run.hpp"

using namespace armcal;  // NOLINT: the program is about all of it
using target::Run;
using Model = generated::Er20Like;

namespace {
Run<Model, filter::ForgettingFilter<Model>> forgetting;
Run<Model, filter::KalmanFilter<Model>> dense;
Run<Model, filter::KalmanFilter<Model, filter::Form::kBlock>> block;
Run<Model, filter::ModelBank<Model>> bank;
}  // namespace

// Named here: a name that they had from the start would put them in .data.
int Program() {
  forgetting.name = "forgetting", dense.name = "kalman_dense", block.name = "kalman_block", bank.name = "bank";
  return target::RunAlong(forgetting, dense, block, bank);
}
