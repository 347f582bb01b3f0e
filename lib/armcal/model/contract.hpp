// model - what a generated model consists of: its constants and its functions.
//
// A generated model is a struct of constants and static functions, `struct Er20Like { ... }`:
//
//   kName        the name of the model (const char*)
//   kJoints      n, rows of the regressor (one torque per joint)
//   kFront       columns that touch ONE row only (friction, joint effects); ordered by joint:
//                columns kFrontBegin[i] .. kFrontBegin[i+1]-1 belong to joint i   (int kFrontBegin[n+1])
//   kRigid       base inertial columns (rotor inertias included)
//   kDense       kRigid + columns of pair and arm effects (they touch several rows)
//   kRowBegin[i] first dense column that is not structurally zero in row i         (int kRowBegin[n])
//   kColumns     kFront + kDense: the filter coordinates, in the order [front, dense]
//   kNonlinear   nonlinear effect parameters eta (constant, but for the extended Kalman filter)
//   kBodyParameters  11 n: per link m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz (about the link-frame
//                origin, in the link frame) and the rotor inertia on the joint side
//   kParameters  the table: [body, front columns, dense effect columns, eta]
//   kSchema      uint32: equal for two models only if their tables mean the same
//   kInfo[kParameters]   ParameterInfo: name, unit, default mean, default prior sd, default state ...
//   kAxes[n]     AxisInfo: encoder, current scale, gear, limits, torque noise, v_min
//   kMotorToJoint[n*n], kMotorTorqueToJoint[n*n]  coupling, row-major: q = A q_motor, tau = B tau_motor (unit if none)
//   kTickRate_Hz (float), kSampleTicks (int)
//   kForgetting[kForgettingGroups]  default forgetting per estimator sample of each group (float)
//   kMapBegin[kRigid+1], kMapColumn[], kMapValue[]  base = B body, compressed rows (float)
//
//   kCeilings    the hardest values that a table may hold: Ceilings<n, kParameters>
//   kFriction[kFront]  bool: the column brakes its own joint
//   kFrictionReads  unsigned: bits kReadsPose, kReadsTemperature, kReadsHistory of friction_grid.hpp
//
//   kStates      values that effects with memory carry from sample to sample (0 for most models)
//   kSensitivities  d state / d eta, carried by the extended Kalman filter only
//   kReadyState[i]  index of a state that becomes 1 when the states of row i no longer depend on their start values.
//                Until then (up to 0.5) row i may not update an estimate. -1: row i has no such state and may always
//                update
//
// Functions. x: ModelInput<T, n>. committed[kColumns]: the committed parameters. Only columns that themselves depend on
// parameters use them, such as load friction, which depends on the committed load torque. eta[kNonlinear]. The code has
// no branch that depends on data, and it calls math functions only. With T = float all computation is in float.
// Context: any.
//
//   template <class T> static void InitialState(x, committed, eta, T* state);
//     state[kStates] at the first sample of a stretch, x being that sample. Sensitivities start at zero.
//   template <class T> static void Regressor(x, committed, eta, const T* state, T* next, T* front, T* dense);
//     state[kStates]: what this function wrote to `next` at the sample before. next[kStates] must be another array.
//     front[kFront]: value of each front column in its own row.
//     dense[kJoints * kDense]: row-major. Structural zeros are NOT written: the caller sets the arrays to zero once and
//     uses them for one model only. tau_i = sum_{c in front(i)} front[c] p[c] + sum_d dense[i*kDense+d] p[kFront+d].
//   template <class T> static void Jacobian(x, committed, eta, const T* p, const T* state, T* next, T* jacobian);
//     jacobian[kJoints * kNonlinear] = d tau / d eta at filter coordinates p[kColumns]; structural zeros as above.
//     state and next have kStates + kSensitivities entries; only the sensitivities of `next` are written.
#pragma once

#include <cstdint>

#include "armcal/model/sample.hpp"

namespace armcal::model {

// State of a parameter in the table.
enum class ParameterState : std::uint8_t {
  kEstimated = 0,
  kConsidered = 1,  // its uncertainty counts, it is not updated (dense Kalman form)
  kFixed = 2,       // its torque is subtracted, its column zeroed
  kStandby = 3,     // compiled in, but its amplitude is zero and its column is zeroed
};

// Index of a body parameter inside its link's block of 11.
enum BodyParameter : int { kM, kMx, kMy, kMz, kIxx, kIxy, kIxz, kIyy, kIyz, kIzz, kRotor, kBodyBlock };

struct ParameterInfo {
  const char* name;      // "m3", "Fc2", "torque_offset.To4", ...
  const char* unit;      // "kg", "N*m", ...
  float mean;            // default mean (body: about the link origin)
  float sd;              // default prior standard deviation; body: of (m, cx, cy, cz, I about the centre, rotor)
  float lower, upper;    // bounds a table value must keep; -inf / +inf where there is none
  float process_noise;   // default variance added per estimator sample (filter coordinates; 0 for bodies)
  ParameterState state;  // default state
  std::uint8_t group;    // default forgetting group
};

// One motor axis. q_motor = counts_to_rad (counts - zero_counts) and tau_motor = lsb_to_Nm current, both on the joint
// side (gear ratio and sign are inside). The coupling matrices give the quantities of the joints.
struct AxisInfo {
  float counts_to_rad;
  std::int32_t zero_counts;
  float lsb_to_Nm;
  float sigma_Nm;         // torque noise of one estimator sample's row (standard deviation)
  float v_min_radps;      // below this the joint counts as standing
  float torque_limit_Nm;  // feed-forward is clamped to +- this
};

}  // namespace armcal::model
