// estimator - what the signal path needs of a generated model and of its table; knows no filter.
#pragma once

#include "armcal/feedforward/committed.hpp"
#include "armcal/signal/signal_path.hpp"

namespace armcal::estimator {

// Signal axes of a generated model.
template <class Model>
signal::Axes<Model::kJoints> AxesOf() {
  constexpr int n = Model::kJoints;
  signal::Axes<n> axes = {};
  for (int i = 0; i < n; ++i) {
    axes.counts_to_rad[i] = Model::kAxes[i].counts_to_rad;
    axes.zero_counts[i] = Model::kAxes[i].zero_counts;
    axes.lsb_to_Nm[i] = Model::kAxes[i].lsb_to_Nm;
  }
  for (int i = 0; i < n * n; ++i) {
    axes.motor_to_joint[i] = Model::kMotorToJoint[i];
    axes.motor_torque_to_joint[i] = Model::kMotorTorqueToJoint[i];
  }
  axes.tick_rate_Hz = static_cast<float>(Model::kTickRate_Hz);
  return axes;
}

// What a table says to the signal path.
template <class Model>
signal::Settings<Model::kJoints> SettingsOf(const feedforward::Committed<Model>& committed) {
  signal::Settings<Model::kJoints> settings = {};
  for (int i = 0; i < Model::kJoints; ++i) {
    settings.v_min_radps[i] = committed.v_min_radps[i];
    settings.torque_scale[i] = committed.torque_scale[i];
  }
  settings.generation = committed.generation;
  return settings;
}

}  // namespace armcal::estimator
