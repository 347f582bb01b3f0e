// estimator - linearises the model at the present estimate, for the extended Kalman filter.
#pragma once

#include "armcal/estimator/adopted_table.hpp"

namespace armcal::estimator {

// The rows of one sample, linearised at the estimate x0 before it: tau = tau(x0) + h (x - x0). This class has its own
// states of effects with memory, and their sensitivities. It computes them with the estimated eta. The states in the
// intake use the committed eta. The instructions depend on two things only: whether the sample follows the one before,
// and whether the last states were finite. Context: background.
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
    if constexpr (kNonlinear > 0) Model::Jacobian(x, table.committed.p, eta_, p_, now_, next_, jacobian_);
    running_ = true;
    for (int k = 0; k < kCarried; ++k) {
      running_ = running_ && math::IsFinite(next_[k]);
      now_[k] = next_[k];
    }
  }

  const model::Rows<Model>& rows() const { return rows_; }
  // Completes a row that FillRow has filled in: eta = d tau / d x, whitened, and y = (tau - tau(x0)) / sigma + h x0.
  template <class Row>
  void CompleteRow(const AdoptedTable<Model>& table, int joint, float tau_Nm, Row& row) const {
    const int first = Model::kFrontBegin[joint], end = Model::kFrontBegin[joint + 1];
    const float whiten = 1.0f / table.sigma_Nm[joint];
    for (int e = 0; e < kNonlinear; ++e)
      row.eta[e] = math::Masked(jacobian_[joint * kNonlinear + e] * EtaSlope(table, e, eta_[e]),
                                table.prior.active[Model::kColumns + e]);
    float y = (tau_Nm - model::RowTorque(p_, rows_, joint)) * whiten;
    for (int k = first; k < end; ++k) y += row.front[k - first] * x0_[k];
    for (int k = Model::kRowBegin[joint]; k < Model::kDense; ++k) y += row.dense[k] * x0_[Model::kFront + k];
    for (int e = 0; e < kNonlinear; ++e) y += (row.eta[e] *= whiten) * x0_[Model::kColumns + e];
    row.y = y;
  }

 private:
  static constexpr int kCarried = Model::kStates + Model::kSensitivities;
  model::Rows<Model> rows_ = {};
  static constexpr int kRoom = kNonlinear > 0 ? kNonlinear : 1;  // a model without eta is served, too
  float jacobian_[n * kRoom] = {};
  float x0_[Model::kColumns + kNonlinear] = {}, p_[Model::kColumns] = {}, eta_[kRoom] = {};
  float now_[kCarried > 0 ? kCarried : 1] = {}, next_[kCarried > 0 ? kCarried : 1] = {};
  bool running_ = false;
};

}  // namespace armcal::estimator
