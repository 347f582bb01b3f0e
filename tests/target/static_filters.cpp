// tests - filters and an estimator as static objects. The check after the link fails if one of them lies in .data,
// where its numbers would take flash, too.
#include "armcal/estimator/estimator.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/runner/line.hpp"

using namespace armcal;  // NOLINT: the library that this program looks at
using Model = generated::Er20Like;

static filter::ForgettingFilter<Model> forgetting;
static filter::KalmanFilter<Model> kalman;
static filter::KalmanFilter<Model, filter::Form::kBlock> block;
static filter::ExtendedKalmanFilter<Model> extended;
static filter::ModelBank<Model> bank;
static estimator::Estimator<Model, filter::ForgettingFilter<Model>> learns;

// So that the linker keeps them all.
static const void* volatile kept;

int Program() {
  for (const void* object :
       {static_cast<const void*>(&forgetting), static_cast<const void*>(&kalman), static_cast<const void*>(&block),
        static_cast<const void*>(&extended), static_cast<const void*>(&bank), static_cast<const void*>(&learns)})
    kept = object;
  port::runner::Line("kept").Decimal(6).End();
  return 0;
}
