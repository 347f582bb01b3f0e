// application - pretends to be encoders and current sensors, which the board does not have.
#pragma once

#include "armcal/controller/controller.hpp"

namespace armcal::application {

// Every axis swings in a sine of its own period. The current is what the model with its default parameters demands, so
// the arm is exactly as the robot file says. A real drive reads its hardware here.
template <class Model>
class PretendAxes {
 public:
  static constexpr int n = Model::kJoints;

  PretendAxes() {
    const auto table = estimator::DefaultTable<Model>();
    float bodies[Model::kBodyParameters];
    for (int k = 0; k < Model::kBodyParameters; ++k) bodies[k] = table.parameter[k].mean;
    physical::MapBodies<Model>(bodies, arm_.p + Model::kFront);
    for (int k = 0; k < Model::kFront; ++k) arm_.p[k] = table.parameter[Model::kBodyParameters + k].mean;
  }

  // The sample of tick `tick` and the set-point that the axes follow; all axes are under control. Context: tick.
  std::uint32_t Read(std::uint32_t tick, model::RawSample<n>& raw, controller::SetPoint<n>& set) {
    constexpr float kAmplitude_rad = 0.4f, kTurn = 6.2831853f;
    model::ModelInput<float, n> state = {};
    for (int i = 0; i < n; ++i) {
      const auto period = static_cast<std::uint32_t>(Model::kTickRate_Hz) * static_cast<std::uint32_t>(4 + i);
      const float w_radps = kTurn * Model::kTickRate_Hz / static_cast<float>(period);
      float s, c;
      math::SinCos(kTurn * static_cast<float>(tick % period) / static_cast<float>(period), s, c);
      state.q[i] = set.q[i] = kAmplitude_rad * s;
      state.qd[i] = set.qd[i] = kAmplitude_rad * w_radps * c;
      state.qdd[i] = set.qdd[i] = -kAmplitude_rad * w_radps * w_radps * s;
    }
    float tau_Nm[n];
    model::ModelTorque(arm_, state, memory_, rows_, tau_Nm);
    raw.tick = tick;
    raw.latch_ns = tick * model::TickLength_ns(Model::kTickRate_Hz);  // a real drive latches its encoders
    raw.stamped = true;
    for (int i = 0; i < n; ++i) {
      const model::AxisInfo& axis = Model::kAxes[i];
      raw.counts[i] = axis.zero_counts + static_cast<std::int32_t>(state.q[i] / axis.counts_to_rad);
      raw.current[i] = static_cast<std::int16_t>(tau_Nm[i] / axis.lsb_to_Nm);
      raw.flags[i] = model::kEnabled;
      raw.temperature_degC[i] = 25.0f;
    }
    return (1u << n) - 1u;
  }

 private:
  model::Committed<Model> arm_;
  model::Rows<Model> rows_ = {};
  model::Memory<Model> memory_ = {};
};

}  // namespace armcal::application
