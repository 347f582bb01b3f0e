// estimator - the regressor and its derivative at the live estimate; only the extended filter takes this way.
#pragma once

#include "armcal/estimator/adopted_table.hpp"

namespace armcal::estimator {

// The rows of one sample, linearised at the estimate x0 before it: tau = tau(x0) + h (x - x0). The states of effects
// with memory run here at the live eta, together with their sensitivities; the intake runs those of the committed
// model. The instructions are the same for any data. Context: background.
template <class Model>
class LiveModel {
 public:
  static constexpr int n = Model::kJoints, kNonlinear = Model::kNonlinear;

  void Restart() { running_ = false; }

  // filter.x(column) is the estimate in prior units. gap: the sample does not follow the one before. After a gap, or
  // after a state that is not finite, the states start again.
  template <class Filter>
  void Linearise(const AdoptedTable<Model>& table, const Filter& filter, const model::ModelInput<float, n>& x,
                 bool gap) {
    for (int k = 0; k < Model::kColumns + kNonlinear; ++k) x0_[k] = filter.x(k);
    for (int k = 0; k < Model::kColumns; ++k) p_[k] = table.committed.p[k] + table.scale[k] * x0_[k];
    for (int e = 0; e < kNonlinear; ++e) eta_[e] = EtaAt(table, e, x0_[Model::kColumns + e]);
    if constexpr (kCarried > 0) {
      if (gap || !running_) {
        Model::InitialState(x, table.committed.p, eta_, now_);
        for (int k = Model::kStates; k < kCarried; ++k) now_[k] = 0.0f;
      }
    }
    Model::Regressor(x, table.committed.p, eta_, now_, next_, rows_.front, rows_.dense);
    Model::Jacobian(x, table.committed.p, eta_, p_, now_, next_, jacobian_);
    running_ = true;
    for (int k = 0; k < kCarried; ++k) {
      running_ = running_ && math::IsFinite(next_[k]);
      now_[k] = next_[k];
    }
  }

  const model::Rows<Model>& rows() const { return rows_; }
  float Torque(int joint) const { return model::RowTorque(p_, rows_, joint); }
  // d tau / d x of the eta columns in N m. Shape: slope [kNonlinear].
  void EtaRow(const AdoptedTable<Model>& table, int joint, float* slope) const {
    for (int e = 0; e < kNonlinear; ++e)
      slope[e] = math::Masked(jacobian_[joint * kNonlinear + e] * EtaSlope(table, e, eta_[e]),
                              table.prior.active[Model::kColumns + e]);
  }
  float x0(int column) const { return x0_[column]; }

 private:
  static constexpr int kCarried = Model::kStates + Model::kSensitivities;
  model::Rows<Model> rows_ = {};
  float jacobian_[n * kNonlinear] = {};
  float x0_[Model::kColumns + kNonlinear] = {}, p_[Model::kColumns] = {}, eta_[kNonlinear] = {};
  float now_[kCarried > 0 ? kCarried : 1] = {}, next_[kCarried > 0 ? kCarried : 1] = {};
  bool running_ = false;
};

}  // namespace armcal::estimator
