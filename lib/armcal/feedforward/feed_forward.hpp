// feedforward - the torque of a set-point, by the committed parameters alone; an estimate has no part in it.
#pragma once

#include "armcal/core/mailbox.hpp"
#include "armcal/core/status.hpp"
#include "armcal/model/evaluate.hpp"

namespace armcal::feedforward {

// The shortest cross-fade. If a table that fades asks for less, this time is used, so that the torque does not step.
inline constexpr float kShortestFade_s = 0.05f;

// The torque of a set-point by the table in force. Context: background for Offer, tick for all others.
template <class Model>
class FeedForward {
 public:
  static constexpr int n = Model::kJoints;

  FeedForward() { share_ = 1.0f; }  // not constexpr, so that a static object takes no flash

  // Hands over the next committed parameters. They take effect at the next tick. kAxisEnabled: an axis is enabled and
  // they are not bumpless; nothing has changed. Context: background.
  core::Status Offer(const model::Committed<Model>& next, bool any_axis_enabled) {
    if (any_axis_enabled && !next.bumpless) return core::Status::kAxisEnabled;
    offered_.Post(next);
    return core::Status::kOk;
  }

  // Torque of the set-point. Shapes: all [kJoints]. q, qd, qdd: rad (m), rad/s, rad/s^2. temperature_degC: NaN where
  // there is no sensor. t_s: seconds since the table was adopted. any_axis_enabled: at this tick. A joint whose
  // set-point speed is below v_min counts as standing, so that friction does not chatter. tau_Nm: N m (N).
  // kOk; kClamped (a joint was cut to its limit, and that was counted); kEmpty (no valid table; torque zero);
  // kNotFinite (set-point or model of a joint is not finite; the torque of that joint is zero).
  // Constant time: the old and the new parameters are always both evaluated. Only the tick that takes over a new table
  // takes longer.
  // A cross-fade starts from the present torque, also if another one is running. Each table is evaluated with its own
  // v_min, and its torque is cut to its own limit before the two are mixed. So if the set-point does not change, the
  // torque changes in one tick by at most (old limit + new limit) / ticks of the fade. A table that is not bumpless is
  // taken over at once, unless an axis was enabled after its Offer; then it fades, too. Context: tick.
  core::Status Evaluate(const float* q, const float* qd, const float* qdd, const float* temperature_degC, float t_s,
                        bool any_axis_enabled, float* tau_Nm) {
    Adopt(any_axis_enabled);
    constexpr float kTick_s = 1.0f / static_cast<float>(Model::kTickRate_Hz);
    model::ModelInput<float, n> state;
    for (int i = 0; i < n; ++i) {
      state.q[i] = q[i];
      state.qd[i] = Moving(previous_, qd, i);
      state.qdd[i] = qdd[i];
      state.temp[i] = temperature_degC[i];
    }
    state.dt = kTick_s;
    state.t = previous_t_s_ += kTick_s;
    blended_ticks_ += blended_ticks_ < active_.blend_ticks;
    const bool blending = blended_ticks_ < active_.blend_ticks;
    const float share =
        math::Select(blending, static_cast<float>(blended_ticks_) / Positive(active_.blend_ticks), 1.0f);
    float before[n], now[n];
    model::EvaluateRows(previous_, state, previous_memory_, rows_);
    for (int i = 0; i < n; ++i) before[i] = model::RowTorque(previous_p_, rows_, i) + remainder_Nm_[i];
    for (int i = 0; i < n; ++i) state.qd[i] = Moving(active_, qd, i);
    state.t = t_s_ = t_s;
    model::ModelTorque(active_, state, active_memory_, rows_, now);

    const std::uint32_t fading = math::MaskOf(blending && previous_.valid);
    core::Status status = active_.valid ? core::Status::kOk : core::Status::kEmpty;
    for (int i = 0; i < n; ++i) {
      const float old = math::Masked(before[i], fading);
      const bool usable = active_.valid && math::IsFinite(now[i]) && math::IsFinite(old);
      if (active_.valid && !usable) status = core::Status::kNotFinite;
      const float limit = active_.limit_Nm[i], least = math::Select(fading != 0u, first_limit_Nm_[i], limit);
      if (usable) Count(math::Abs(now[i]) > limit || math::Abs(old) > least, status);
      const float tau = share * Cut(now[i], limit) + (1.0f - share) * Cut(old, least);
      limit_Nm_[i] = least + share * (limit - least);
      const float first_gain = math::Select(fading != 0u, first_gain_[i], next_gain_[i]);
      gain_[i] = first_gain + share * (next_gain_[i] - first_gain);
      tau_Nm[i] = Cut(math::Masked(tau, math::MaskOf(usable)), limit_Nm_[i]);
      last_Nm_[i] = tau_Nm[i];
    }
    share_ = share;
    return status;
  }

  // Joint i's torque scale, by which a torque is divided before it is turned into a motor current. It is that of the
  // table in force. During a cross-fade its inverse goes from the old to the new in equal steps, so that the current
  // does not step either. 1 without a valid table. Context: tick, after Evaluate.
  float torque_scale(int i) const { return active_.valid ? 1.0f / gain_[i] : 1.0f; }

  std::uint32_t clamp_count() const { return clamp_count_; }  // how often a joint was cut to its limit
  std::uint32_t generation() const { return active_.generation; }
  bool valid() const { return active_.valid; }
  bool blending() const { return blended_ticks_ < active_.blend_ticks; }

 private:
  static float Positive(std::uint32_t ticks) { return static_cast<float>(math::Max<std::uint32_t>(ticks, 1)); }

  void Adopt(bool any_axis_enabled) {
    if (!offered_.Refresh()) return;
    StartFromHere();
    active_ = offered_.latest();
    active_memory_.running = false;
    constexpr auto kShortest = static_cast<std::uint32_t>(kShortestFade_s * Model::kTickRate_Hz);
    const bool fades = active_.bumpless || any_axis_enabled;
    active_.blend_ticks = fades ? math::Max(active_.blend_ticks, kShortest) : 0u;
    blended_ticks_ = 0;
    for (int i = 0; i < n; ++i) next_gain_[i] = 1.0f / active_.torque_scale[i];
  }

  // Prepares the next fade. It starts from the torque of the last tick. If no fade is running, it starts from the
  // parameters in force. If one is running, it starts from the mixture of parameters that this fade has reached. So the
  // start torque still depends on the set-point. The torque of the mixture may differ from the last torque, because the
  // two tables may have other eta, memories or columns. remainder_Nm_ holds this difference, and it is added during the
  // fade. rows_ still holds the regressor of the table in force at the last tick.
  void StartFromHere() {
    const bool was_fading = active_.valid && share_ < 1.0f;
    for (int k = 0; k < Model::kColumns; ++k) {
      const float from = previous_.valid ? previous_p_[k] : 0.0f;
      previous_p_[k] = was_fading ? from + share_ * (active_.p[k] - from) : active_.p[k];
    }
    for (int i = 0; i < n; ++i) {
      const float rest = last_Nm_[i] - model::RowTorque(previous_p_, rows_, i);
      remainder_Nm_[i] = math::Masked(rest, math::MaskOf(was_fading && math::IsFinite(rest)));
      first_limit_Nm_[i] = limit_Nm_[i];
      first_gain_[i] = gain_[i];
    }
    previous_ = active_;
    previous_memory_ = active_memory_;
    previous_t_s_ = t_s_;
  }

  // A speed of the set-point, as a table uses it: zero below the table's v_min.
  static float Moving(const model::Committed<Model>& table, const float* qd, int i) {
    return math::Select(math::Abs(qd[i]) < table.v_min_radps[i], 0.0f, qd[i]);
  }
  static float Cut(float tau, float limit) { return math::Max(-limit, math::Min(limit, tau)); }
  void Count(bool over, core::Status& status) {
    clamp_count_ += over;
    if (over && status == core::Status::kOk) status = core::Status::kClamped;
  }

  core::Mailbox<model::Committed<Model>> offered_;
  model::Committed<Model> active_, previous_;
  model::Memory<Model> active_memory_, previous_memory_;
  model::Rows<Model> rows_ = {};
  float previous_p_[Model::kColumns] = {};  // amplitudes that a fade starts from, with the columns of previous_
  float remainder_Nm_[n] = {};              // and a torque beside them
  float first_limit_Nm_[n] = {};            // at the start of the fade
  float first_gain_[n] = {}, next_gain_[n] = {}, gain_[n] = {};  // 1 / torque scale: at its start and end, and now
  float limit_Nm_[n] = {}, last_Nm_[n] = {};                     // of the last tick
  float share_ = 0.0f, t_s_ = 0.0f;                              // of the last tick
  float previous_t_s_ = 0.0f;                                    // the time of previous_ goes on
  std::uint32_t blended_ticks_ = 0;
  std::uint32_t clamp_count_ = 0;
};

}  // namespace armcal::feedforward
