// model - evaluates a generated model: the regressor of one sample, and the torque of the parameters in force.
#pragma once

#include <cstdint>

#include "armcal/math/columns.hpp"
#include "armcal/model/contract.hpp"

namespace armcal::model {

// The committed parameters: what the adopted table says, in filter coordinates. Feed-forward predicts torque with them,
// and every filter's estimate starts from them. All zero: no table is valid.
template <class Model>
struct Committed {
  static constexpr int n = Model::kJoints;
  bool valid = false;
  bool bumpless = false;         // may be adopted while axes are enabled; the torque cross-fades over blend_ticks
  std::uint32_t generation = 0;  // every adoption has its own
  std::uint32_t blend_ticks = 0;
  float p[Model::kColumns] = {};
  float eta[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  float limit_Nm[n] = {};
  float v_min_radps[n] = {};
  float torque_scale[n] = {};
};

// The regressor at one sample. It starts as zero, because a model never writes its structural zeros.
template <class Model>
struct Rows {
  float front[Model::kFront > 0 ? Model::kFront : 1] = {};
  float dense[Model::kDense > 0 ? Model::kJoints* Model::kDense : 1] = {};
};

// The states of effects with memory. Each stream of samples has a Memory of its own.
template <class Model>
struct Memory {
  float now[Model::kStates > 0 ? Model::kStates : 1] = {};
  float next[Model::kStates > 0 ? Model::kStates : 1] = {};
  bool running = false;  // false: the next sample sets the initial states
};

// Evaluates the regressor at x and steps the memory once. If a new state is not finite (because a number of the sample
// was not), the next sample sets the initial states again. Context: any.
template <class Model>
void EvaluateRows(const Committed<Model>& committed, const ModelInput<float, Model::kJoints>& x, Memory<Model>& memory,
                  Rows<Model>& rows) {
  if constexpr (Model::kStates > 0)
    if (!memory.running) Model::InitialState(x, committed.p, committed.eta, memory.now);
  Model::Regressor(x, committed.p, committed.eta, memory.now, memory.next, rows.front, rows.dense);
  memory.running = true;
  for (int k = 0; k < Model::kStates; ++k) {
    memory.running = memory.running && math::IsFinite(memory.next[k]);
    memory.now[k] = memory.next[k];
  }
}

// sum + the sum of p[k] value[k] for k < count. Shapes: p, value [count]. A column whose parameter is zero adds
// nothing, even if its value is not finite: an effect in standby may read a sensor that the machine does not have. The
// instructions are the same for any numbers. Context: any.
ARMCAL_NOINLINE inline float AddTorque(const float* p, const float* value, int count, float sum) {
  math::internal::ByFours(count, [&](int k) ARMCAL_INLINE {
    const bool counts = math::BitsOf(p[k]) << 1 != 0u;  // neither 0 nor -0
    sum += p[k] * math::FloatOf(counts ? math::BitsOf(value[k]) : 0u);
  });
  return sum;
}

// Torque of one joint (N m or N) from the dense columns alone, without the joint's own friction and effects. p
// [kColumns]. Context: any.
template <class Model>
float LoadTorque(const float* p, const Rows<Model>& rows, int joint) {
  const int first = Model::kRowBegin[joint], effects = math::Max(first, Model::kRigid);
  const float *const dense = p + Model::kFront, *const row = rows.dense + joint * Model::kDense;
  const float links_Nm = math::Dot(dense + first, row + first, effects - first);
  return AddTorque(dense + effects, row + effects, Model::kDense - effects, links_Nm);
}

// Torque of one joint (N m or N). p [kColumns]; load_Nm is its LoadTorque. Context: any.
template <class Model>
float RowTorque(const float* p, const Rows<Model>& rows, int joint, float load_Nm) {
  const int first = Model::kFrontBegin[joint];
  return AddTorque(p + first, rows.front + first, Model::kFrontBegin[joint + 1] - first, load_Nm);
}
template <class Model>
float RowTorque(const float* p, const Rows<Model>& rows, int joint) {
  return RowTorque(p, rows, joint, LoadTorque(p, rows, joint));
}

// Torque of all joints at a state, without limits. Shape: tau_Nm [kJoints]. Not finite where the model is not.
// Context: any.
template <class Model>
void ModelTorque(const Committed<Model>& committed, const ModelInput<float, Model::kJoints>& state,
                 Memory<Model>& memory, Rows<Model>& rows, float* tau_Nm) {
  EvaluateRows(committed, state, memory, rows);
  for (int i = 0; i < Model::kJoints; ++i) tau_Nm[i] = RowTorque(committed.p, rows, i);
}

}  // namespace armcal::model
