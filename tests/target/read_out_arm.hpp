// tests - an arm that has moved for a while, and the physical read-out of its filter; needs a double FPU.
#pragma once

#include "armcal/estimator/physical_read_out.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/target/numbers.hpp"

namespace armcal::target {

class ReadOutArm {
 public:
  using Model = generated::Er20Like;

  bool Start() {
    if (!core::IsOk(estimator::BuildAdoptedTable(estimator::DefaultTable<Model>(), 1, rigid_, adopted_))) return false;
    estimator_.Adopt(adopted_, 0);
    return true;
  }

  // Random states; friction a fifth and base parameters a tenth off the table.
  void Feed(int samples) {
    for (int k = 0; k < samples; ++k) {
      model::Sample<6> s;
      s.tick = tick_ += Model::kSampleTicks;
      model::ModelInput<float, 6> x = {};
      for (int i = 0; i < 6; ++i) {
        x.q[i] = s.q[i] = 3.0f * numbers_.Signed();
        x.qd[i] = s.qd[i] = 2.0f * numbers_.Signed();
        x.qdd[i] = s.qdd[i] = 8.0f * numbers_.Signed();
        s.flags[i] = model::kValid | model::kMoving;
      }
      const float* p = adopted_.committed.p;
      Model::Regressor<float>(x, p, adopted_.committed.eta, nullptr, nullptr, front_, dense_);
      for (int i = 0; i < 6; ++i) {
        for (int c = Model::kFrontBegin[i]; c < Model::kFrontBegin[i + 1]; ++c) s.tau[i] += 1.2f * front_[c] * p[c];
        for (int c = 0; c < Model::kDense; ++c)
          s.tau[i] += (c % 2 == 0 ? 1.1f : 0.9f) * dense_[i * Model::kDense + c] * p[Model::kFront + c];
        s.tau[i] += 2.0f * Model::kAxes[i].sigma_Nm * numbers_.Signed();
      }
      (void)estimator_.PushSample(s);
      Work();
    }
    estimator_.RequestReadOut();
    Work();
  }

  bool Begin(bool warm) { return core::IsOk(estimator::BeginPhysical(adopted_, rigid_, estimator_, warm, read_out)); }
  bool HandOver() { return estimator::ContinuePhysical(estimator_, read_out) == core::Status::kBusy; }

  physical::MapReadOut<Model, double> read_out;

 private:
  void Work() {
    while (estimator_.Step()) {
    }
  }

  physical::RigidPrior<Model, float> rigid_;
  estimator::AdoptedTable<Model> adopted_;
  estimator::Estimator<Model, filter::KalmanFilter<Model>> estimator_;
  float front_[Model::kFront] = {}, dense_[6 * Model::kDense] = {};
  Numbers numbers_{23};
  std::uint32_t tick_ = 0;
};

}  // namespace armcal::target
