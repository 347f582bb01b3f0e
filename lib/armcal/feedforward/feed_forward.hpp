// feedforward - the torque of a set-point, by the committed parameters alone; an estimate has no part in it.
#pragma once

#include "armcal/core/mailbox.hpp"
#include "armcal/core/status.hpp"
#include "armcal/model/evaluate.hpp"

namespace armcal::feedforward {

template <class Model>
class FeedForward {
 public:
  static constexpr int n = Model::kJoints;

  // Hands over the next committed parameters. They take effect at the next tick. kAxisEnabled: an axis is enabled and
  // they are not bumpless; nothing has changed. Context: background.
  core::Status Offer(const model::Committed<Model>& next, bool any_axis_enabled) {
    if (any_axis_enabled && !next.bumpless) return core::Status::kAxisEnabled;
    offered_.Post(next);
    return core::Status::kOk;
  }

  // Torque of the set-point. Shapes: all [kJoints]. t_s: seconds since the table was adopted. A set-point slower than
  // v_min counts as standing, so that friction does not chatter. kOk; kClamped (a joint was cut to its limit, and that
  // was counted); kEmpty (no valid table; torque zero); kNotFinite (set-point or model is not finite; that joint's
  // torque is zero). Constant time, because the old and the new parameters of a cross-fade are always both evaluated.
  // Context: tick.
  core::Status Evaluate(const float* q, const float* qd, const float* qdd, const float* temperature_degC, float t_s,
                        float* tau_Nm) {
    Adopt();
    model::ModelInput<float, n> state;
    for (int i = 0; i < n; ++i) {
      state.q[i] = q[i];
      state.qd[i] = math::Select(math::Abs(qd[i]) < active_.v_min_radps[i], 0.0f, qd[i]);
      state.qdd[i] = qdd[i];
      state.temp[i] = temperature_degC[i];
    }
    state.t = t_s;
    state.dt = 1.0f / static_cast<float>(Model::kTickRate_Hz);
    blended_ticks_ += blended_ticks_ < active_.blend_ticks;
    const bool blending = blended_ticks_ < active_.blend_ticks;
    const float share =
        math::Select(blending, static_cast<float>(blended_ticks_) / Positive(active_.blend_ticks), 1.0f);
    float before[n], now[n];
    model::ModelTorque(previous_, state, previous_memory_, rows_, before);
    model::ModelTorque(active_, state, active_memory_, rows_, now);

    core::Status status = active_.valid ? core::Status::kOk : core::Status::kEmpty;
    const std::uint32_t fading = math::MaskOf(blending && previous_.valid);
    for (int i = 0; i < n; ++i) {
      const float tau = share * now[i] + math::Masked((1.0f - share) * before[i], fading);
      const bool usable = active_.valid && math::IsFinite(tau);
      if (active_.valid && !usable) status = core::Status::kNotFinite;
      tau_Nm[i] = Clamp(math::Masked(tau, math::MaskOf(usable)), active_.limit_Nm[i], status);
    }
    return status;
  }

  std::uint32_t clamp_count() const { return clamp_count_; }  // how often a joint was cut to its limit
  std::uint32_t generation() const { return active_.generation; }
  bool valid() const { return active_.valid; }
  bool blending() const { return blended_ticks_ < active_.blend_ticks; }

 private:
  static float Positive(std::uint32_t ticks) { return static_cast<float>(math::Max<std::uint32_t>(ticks, 1)); }

  void Adopt() {
    if (!offered_.Refresh()) return;
    previous_ = active_;
    previous_memory_ = active_memory_;
    active_ = offered_.latest();
    active_memory_.running = false;
    if (!active_.bumpless) active_.blend_ticks = 0;
    blended_ticks_ = 0;
  }

  float Clamp(float tau, float limit, core::Status& status) {
    const bool over = math::Abs(tau) > limit;
    clamp_count_ += over;
    if (over && status == core::Status::kOk) status = core::Status::kClamped;
    return math::Max(-limit, math::Min(limit, tau));
  }

  core::Mailbox<model::Committed<Model>> offered_;
  model::Committed<Model> active_, previous_;
  model::Memory<Model> active_memory_, previous_memory_;
  model::Rows<Model> rows_ = {};
  std::uint32_t blended_ticks_ = 0;
  std::uint32_t clamp_count_ = 0;
};

}  // namespace armcal::feedforward
