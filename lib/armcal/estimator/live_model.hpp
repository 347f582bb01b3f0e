// estimator - the regressor and its derivative at the live estimate, for the extended filter; knows no filter's inside.
#pragma once

#include "armcal/estimator/image.hpp"

namespace armcal::estimator {

// value of eta at x in prior units, and its derivative; see IsLogarithmic.
template <class Model>
float EtaAt(const Image<Model>& image, int e, float x) {
  const float step = image.scale[Model::kColumns + e] * x;
  return IsLogarithmic<Model>(e) ? image.committed.eta[e] * math::Exp(step) : image.committed.eta[e] + step;
}
template <class Model>
float EtaSlope(const Image<Model>& image, int e, float eta) {
  return image.scale[Model::kColumns + e] * (IsLogarithmic<Model>(e) ? eta : 1.0f);
}

// Rows tau = tau(x0) + h (x - x0) of one sample at the estimate x0 before it. States of effects with memory run at the
// live eta, with their sensitivities, beside those of the committed model. The instructions are the same for any data.
template <class Model>
class LiveModel {
 public:
  static constexpr int n = Model::kJoints, kNonlinear = Model::kNonlinear;

  void Restart() { running_ = false; }

  // `filter`: x(column) is its estimate in prior units. A step that is not finite starts the states anew.
  template <class Filter>
  void Linearise(const Image<Model>& image, const Filter& filter, const model::ModelInput<float, n>& x, bool gap) {
    for (int k = 0; k < Model::kColumns + kNonlinear; ++k) x0_[k] = filter.x(k);
    for (int k = 0; k < Model::kColumns; ++k) p_[k] = image.committed.p[k] + image.scale[k] * x0_[k];
    for (int e = 0; e < kNonlinear; ++e) eta_[e] = EtaAt(image, e, x0_[Model::kColumns + e]);
    if constexpr (kCarried > 0) {
      if (gap || !running_) {
        Model::InitialState(x, image.committed.p, eta_, now_);
        for (int k = Model::kStates; k < kCarried; ++k) now_[k] = 0.0f;
      }
    }
    Model::Regressor(x, image.committed.p, eta_, now_, next_, rows_.front, rows_.dense);
    Model::Jacobian(x, image.committed.p, eta_, p_, now_, next_, jacobian_);
    running_ = true;
    for (int k = 0; k < kCarried; ++k) {
      running_ = running_ && math::IsFinite(next_[k]);
      now_[k] = next_[k];
    }
  }

  const feedforward::Rows<Model>& rows() const { return rows_; }
  float Torque(int joint) const { return feedforward::RowTorque(p_, rows_, joint); }
  // d tau / d x of the eta columns, N m. Shape: slope [kNonlinear].
  void EtaRow(const Image<Model>& image, int joint, float* slope) const {
    for (int e = 0; e < kNonlinear; ++e)
      slope[e] = math::Masked(jacobian_[joint * kNonlinear + e] * EtaSlope(image, e, eta_[e]),
                              image.prior.active[Model::kColumns + e]);
  }
  float x0(int column) const { return x0_[column]; }

 private:
  static constexpr int kCarried = Model::kStates + Model::kSensitivities;
  feedforward::Rows<Model> rows_ = {};
  float jacobian_[n * kNonlinear] = {};
  float x0_[Model::kColumns + kNonlinear] = {}, p_[Model::kColumns] = {}, eta_[kNonlinear] = {};
  float now_[kCarried > 0 ? kCarried : 1] = {}, next_[kCarried > 0 ? kCarried : 1] = {};
  bool running_ = false;
};

}  // namespace armcal::estimator
