// tests - a generated regressor behind plain functions, so that one program can run them all.
#pragma once

#include <cstdint>

#include "armcal/model/sample.hpp"

namespace armcal::target {

struct RegressorCalls {
  const char* name;
  int joints, front, dense, nonlinear;  // dense: of all rows
  float* input;                         // q, qd, qdd, temperature, t, dt: [4 joints + 2]
  void (*start)();                      // states as at the first sample of a stretch
  void (*evaluate)();                   // rows, and the step of the states
  void (*differentiate)();              // after evaluate: d torque / d eta
  const float *front_rows, *dense_rows, *jacobian;
};

// The regressor of one generated model. What `Rows` needs of code and stack is the model's. Without friction: what goes
// into a local `front` is thrown away, so the compiler leaves it out and the base parameters' columns remain.
template <class Model, bool kFriction>
struct RegressorInstance {
  static constexpr int n = Model::kJoints;
  static constexpr int kMemory = Model::kStates + Model::kSensitivities;
  static inline model::ModelInput<float, n> x;
  static inline float parameters[Model::kColumns], eta[Model::kNonlinear + 1];
  static inline float state[kMemory + 1], next[kMemory + 1];
  static inline float front[Model::kFront + 1], dense[n * Model::kDense], jacobian[n * Model::kNonlinear + 1];

  static void Start() {
    if constexpr (Model::kStates > 0) Model::InitialState(x, parameters, eta, state);
    for (int k = Model::kStates; k < kMemory; ++k) state[k] = 0.0f;
  }
  // noipa: called as from another object, or the addresses above become constants that need registers.
  [[gnu::noipa]] static void Rows(const model::ModelInput<float, n>& input, const float* now, float* after,
                                  float* front_rows, float* dense_rows) {
    if constexpr (kFriction) {
      Model::Regressor(input, parameters, eta, now, after, front_rows, dense_rows);
    } else {
      float unused[Model::kFront + 1];
      Model::Regressor(input, parameters, eta, now, after, unused, dense_rows);
    }
  }
  static void Evaluate() { Rows(x, state, next, front, dense); }
  static void Differentiate() {
    if constexpr (Model::kNonlinear > 0) Model::Jacobian(x, parameters, eta, parameters, state, next, jacobian);
    for (int k = 0; k < kMemory; ++k) state[k] = next[k];
  }

  static RegressorCalls Calls(const char* name) {
    for (int k = 0; k < Model::kColumns; ++k) parameters[k] = 1.0f / static_cast<float>(1 + k % 5);
    for (int k = 0; k < Model::kNonlinear; ++k) eta[k] = Model::kInfo[Model::kParameters - Model::kNonlinear + k].mean;
    return {name,
            n,
            Model::kFront,
            n * Model::kDense,
            n * Model::kNonlinear,
            reinterpret_cast<float*>(&x),
            Start,
            Evaluate,
            Differentiate,
            front,
            dense,
            jacobian};
  }
};

}  // namespace armcal::target
