// estimator - one sample's regressor, and its rows in the units that a filter wants; knows no filter's inside.
#pragma once

#include <type_traits>

#include "armcal/estimator/live_model.hpp"
#include "armcal/model/sample.hpp"

namespace armcal::estimator {

// extended: rows are linearised at the live estimate and carry d tau / d eta. Context: background.
template <class Model, bool extended>
class SampleRows {
 public:
  static constexpr int n = Model::kJoints;

  // One row, whitened and in prior units: y = (tau - tau at b0) / sigma; extended: as LiveModel says.
  struct Row {
    float front[Model::kFront > 0 ? Model::kFront : 1] = {};  // from the joint's first on
    float dense[Model::kDense] = {};
    float eta[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
    float y = 0.0f;
    float load_Nm = 0.0f, model_Nm = 0.0f;  // committed torque of the links alone, and of all
    float residual_Nm = 0.0f;               // measured minus committed
  };

  // The image must stay until the next Restart. adopted_tick: zero of the model's time.
  void Restart(const Image<Model>& image, std::uint32_t adopted_tick) {
    image_ = &image;
    adopted_tick_ = adopted_tick;
    memory_.running = false;
    if constexpr (extended) live_.Restart();
  }

  // Returns the joints whose rows may update an estimate (bit i: joint i): valid, moving, and their effects with memory
  // past the start. These run from sample to sample; after a gap they start anew.
  template <class Filter>
  std::uint32_t Evaluate(const model::Sample<n>& s, [[maybe_unused]] const Filter& filter) {
    model::ModelInput<float, n> state;
    std::uint32_t moving = 0;
    for (int i = 0; i < n; ++i) {
      state.q[i] = s.q[i];
      state.qd[i] = s.qd[i];
      state.qdd[i] = s.qdd[i];
      state.temp[i] = s.temperature_degC[i];
      constexpr int kUpdates = model::kValid | model::kMoving;
      moving |= static_cast<std::uint32_t>((s.flags[i] & kUpdates) == kUpdates) << i;
    }
    state.t = static_cast<float>(s.tick - adopted_tick_) / static_cast<float>(Model::kTickRate_Hz);
    state.dt = static_cast<float>(Model::kSampleTicks) / static_cast<float>(Model::kTickRate_Hz);
    const bool gap = s.tick - last_tick_ != static_cast<std::uint32_t>(Model::kSampleTicks);
    memory_.running = memory_.running && !gap;
    last_tick_ = s.tick;
    feedforward::EvaluateRows(image_->committed, state, memory_, rows_);
    if constexpr (extended) live_.Linearise(*image_, filter, state, gap);
    for (int i = 0; i < n; ++i)
      if (Model::kReadyState[i] >= 0 && !(memory_.now[Model::kReadyState[i]] > 0.5f)) moving &= ~(1u << i);
    return moving;
  }

  // After Evaluate: row() of the joint.
  void Whiten(int joint, float tau_Nm) {
    const int first = Model::kFrontBegin[joint], end = Model::kFrontBegin[joint + 1];
    const float whiten = 1.0f / image_->sigma_Nm[joint];
    const auto scaled = [&](float value, int column) {
      return math::Masked(value * (image_->scale[column] * whiten), image_->prior.active[column]);
    };
    const feedforward::Rows<Model>& rows = FilterRows();
    for (int k = first; k < end; ++k) row_.front[k - first] = scaled(rows.front[k], k);
    for (int k = 0; k < Model::kDense; ++k)
      row_.dense[k] = scaled(rows.dense[joint * Model::kDense + k], Model::kFront + k);
    row_.load_Nm = feedforward::LoadTorque(image_->committed.p, rows_, joint);
    row_.model_Nm = feedforward::RowTorque(image_->committed.p, rows_, joint, row_.load_Nm);
    row_.residual_Nm = tau_Nm - row_.model_Nm;
    row_.y = row_.residual_Nm * whiten;
    if constexpr (extended) {
      live_.EtaRow(*image_, joint, row_.eta);
      float y = (tau_Nm - live_.Torque(joint)) * whiten;
      for (int k = first; k < end; ++k) y += row_.front[k - first] * live_.x0(k);
      for (int k = 0; k < Model::kDense; ++k) y += row_.dense[k] * live_.x0(Model::kFront + k);
      for (int e = 0; e < Model::kNonlinear; ++e) y += (row_.eta[e] *= whiten) * live_.x0(Model::kColumns + e);
      row_.y = y;
    }
  }
  const Row& row() const { return row_; }

 private:
  struct Nothing {};

  const feedforward::Rows<Model>& FilterRows() const {
    if constexpr (extended) return live_.rows();
    else return rows_;
  }

  const Image<Model>* image_ = nullptr;
  feedforward::Rows<Model> rows_ = {};
  feedforward::Memory<Model> memory_ = {};
  std::conditional_t<extended, LiveModel<Model>, Nothing> live_;
  Row row_;
  std::uint32_t adopted_tick_ = 0, last_tick_ = 0;
};

}  // namespace armcal::estimator
