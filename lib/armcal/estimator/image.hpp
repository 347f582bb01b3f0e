// estimator - from a decoded parameter table to what tick and background run on; knows no storage, no register.
#pragma once

#include "armcal/estimator/rigid_prior.hpp"
#include "armcal/feedforward/committed.hpp"
#include "armcal/filter/prior.hpp"
#include "armcal/model/parameters.hpp"

namespace armcal::estimator {

// D of link columns in the Kalman form stays above this (prior units), a conditional standard deviation of a thousandth
// of the prior's. Rows must go on to move U by more than its rounding, or it wanders: after a million samples at a
// regressor condition of 1e4 the estimate is 0.3 standard deviations off with a floor of 1e-9, 0.01 with this one.
inline constexpr float kLinkFloor = 1e-6f;
// A column whose prior standard deviation is below this (its own unit) is taken as known.
inline constexpr float kSmallestSd = 1e-12f;

template <class Model>
using Table = model::ParameterTable<Model::kJoints, Model::kParameters>;

// One adopted table. Two of them live in the application; the active one must outlive its use.
template <class Model>
struct Image {
  feedforward::Committed<Model> committed;  // b0 and all that the tick needs
  filter::Prior<Model> prior;
  // s: estimate b = b0 + s x; of a logarithmic eta ln b = ln b0 + s x
  float scale[Model::kColumns + Model::kNonlinear] = {};
  float eta_low[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};  // bounds of x
  float eta_high[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  float sigma_Nm[Model::kJoints] = {};
};

// Room for BuildImage; afterwards `rigid` serves ReadBodies.
template <class Model>
struct ImageWork {
  RigidPrior<Model, float> rigid;
};

// A nonlinear parameter whose range excludes zero is positive, and estimated as its logarithm.
template <class Model>
constexpr bool IsLogarithmic(int e) {
  return Model::kInfo[Model::kParameters - Model::kNonlinear + e].lower > 0.0f;
}

namespace internal {
inline bool Uncertain(model::ParameterState s) {
  return s == model::ParameterState::kEstimated || s == model::ParameterState::kConsidered;
}
inline float Amplitude(const model::ParameterEntry& e) {
  return e.state == model::ParameterState::kStandby ? 0.0f : e.mean;
}
inline float Spread(const model::ParameterEntry& e) { return Uncertain(e.state) ? e.sd : 0.0f; }

// Rigid column r is `considered` if all uncertain body parameters behind it are.
template <class Model>
bool RigidConsidered(const Table<Model>& table, const float* w_row) {
  bool any = false, all = true;
  for (int k = 0; k < Model::kBodyParameters; ++k) {
    const bool behind = w_row[k] != 0.0f;
    any |= behind;
    all &= !behind || table.parameter[k].state == model::ParameterState::kConsidered;
  }
  return any && all;
}

// The dense block in prior units: the rigid columns correlated, the effects after them on their own.
template <class Model>
void ScaleCorrelation(const RigidPrior<Model, float>& rigid, Image<Model>& image) {
  constexpr int kRigid = Model::kRigid;
  filter::Prior<Model>& prior = image.prior;
  for (float& u : prior.dense_ud) u = 0.0f;
  for (int k = 0; k < math::UdSize(kRigid); ++k) prior.dense_ud[k] = rigid.ud[k];
  for (int j = kRigid; j < Model::kDense; ++j)
    prior.dense_ud[math::UdIndex(j, j)] = math::Masked(1.0f, prior.active[Model::kFront + j]);
  const float* scale = image.scale + Model::kFront;
  float inverse[kRigid];
  for (int r = 0; r < kRigid; ++r) inverse[r] = math::Divide(1.0f, scale[r]);
  math::UdScale<kRigid>(prior.dense_ud, inverse, scale);
}

// Columns of the extended filter, and the range of x that keeps eta in its own.
template <class Model>
void PriorOfEta(const Table<Model>& table, Image<Model>& image) {
  for (int e = 0; e < Model::kNonlinear; ++e) {
    const int k = Model::kColumns + e, entry = Model::kParameters - Model::kNonlinear + e;
    const model::ParameterEntry& given = table.parameter[entry];
    const model::ParameterInfo& info = Model::kInfo[entry];
    const bool log = IsLogarithmic<Model>(e);
    image.committed.eta[e] = given.mean;
    const float scale = log ? math::Divide(Spread(given), given.mean) : Spread(given);
    const bool active = scale > kSmallestSd && given.mean >= info.lower && given.mean <= info.upper;
    image.scale[k] = active ? scale : 0.0f;
    image.prior.active[k] = math::MaskOf(active);
    image.prior.considered[k] = active && given.state == model::ParameterState::kConsidered;
    image.prior.any_considered |= image.prior.considered[k];
    image.prior.lambda[k] = 1.0f;
    const bool noisy = active && given.state == model::ParameterState::kEstimated;
    image.prior.noise[k] = noisy ? given.process_noise / given.sd / given.sd : 0.0f;
    const float low = log ? math::Log(info.lower / given.mean) : info.lower - given.mean;
    const float high = log ? math::Log(info.upper / given.mean) : info.upper - given.mean;
    image.eta_low[e] = active ? low / scale : 0.0f;
    image.eta_high[e] = active ? high / scale : 0.0f;
  }
}
}  // namespace internal

// kWrongSchema; kUnphysical (a link's body, or a negative rotor inertia); kNotFinite (the map overflows). On refusal
// `image` is unchanged. Longest call of lib, once per table and apart from the tick's budget: see FactorPrior.
// Context: background.
template <class Model>
core::Status BuildImage(const Table<Model>& table, std::uint32_t generation, ImageWork<Model>& work,
                        Image<Model>& image) {
  using core::Status;
  constexpr int kRigid = Model::kRigid, kColumns = Model::kColumns, kBlock = model::kBodyBlock;
  if (table.schema != Model::kSchema) return Status::kWrongSchema;
  for (int link = 0; link < Model::kJoints; ++link) {
    float body[kBlock];
    for (int k = 0; k < kBlock; ++k) body[k] = table.parameter[link * kBlock + k].mean;
    if (!physical::CanExist(body)) return Status::kUnphysical;
  }

  // Bodies to base: mean, covariance, which columns are only considered.
  RigidPrior<Model, float>& rigid = work.rigid;
  for (int k = 0; k < Model::kBodyParameters; ++k) {
    rigid.mean[k] = internal::Amplitude(table.parameter[k]);
    rigid.sd[k] = internal::Spread(table.parameter[k]);
  }
  float base[kRigid];
  bool considered[kRigid];
  MapBodies<Model>(rigid.mean, base);
  SpreadPrior(rigid);
  for (int r = 0; r < kRigid; ++r)
    considered[r] = internal::RigidConsidered<Model>(table, rigid.w + r * Model::kBodyParameters);
  FactorPrior(rigid);
  float variance[kRigid];
  math::UdDiagonal<kRigid>(rigid.ud, variance);
  bool finite = true;
  for (int r = 0; r < kRigid; ++r) finite &= math::IsFinite(base[r]) && math::IsFinite(variance[r]);
  for (float u : rigid.ud) finite &= math::IsFinite(u);
  if (!finite) return Status::kNotFinite;

  const auto is_rigid = [](int k) { return k >= Model::kFront && k < Model::kFront + kRigid; };
  // Entries of the table: bodies, front columns, dense effect columns, eta. The last three follow each other.
  const auto entry = [&](int k) -> const model::ParameterEntry& {
    return table.parameter[Model::kBodyParameters + (k < Model::kFront ? k : k - kRigid)];
  };

  feedforward::Committed<Model>& c = image.committed;
  filter::Prior<Model>& prior = image.prior;
  prior.any_considered = false;
  for (int k = 0; k < kColumns; ++k) {
    const bool body = is_rigid(k);
    const int r = k - Model::kFront;
    c.p[k] = body ? base[r] : internal::Amplitude(entry(k));
    const float sd = body ? math::Sqrt(variance[r]) : internal::Spread(entry(k));
    const bool active = sd > kSmallestSd;
    image.scale[k] = active ? sd : 0.0f;
    prior.active[k] = math::MaskOf(active);
    prior.considered[k] = active && (body ? considered[r] : entry(k).state == model::ParameterState::kConsidered);
    prior.any_considered |= prior.considered[k];
    prior.lambda[k] = table.forgetting[body ? 0 : entry(k).group];
    const bool noisy = active && !body && entry(k).state == model::ParameterState::kEstimated;
    prior.noise[k] = noisy ? entry(k).process_noise / sd / sd : 0.0f;
  }
  internal::PriorOfEta<Model>(table, image);
  prior.link_floor = kLinkFloor;
  prior.gate_sigma = 0.0f;
  internal::ScaleCorrelation(rigid, image);

  c.valid = true;
  c.generation = generation;
  c.bumpless = (table.flags & model::kFlagBumpless) != 0;
  c.blend_ticks = static_cast<std::uint32_t>(static_cast<float>(table.blend_ms) * (Model::kTickRate_Hz / 1000.0f));
  for (int i = 0; i < Model::kJoints; ++i) {
    c.limit_Nm[i] = table.joint[i].torque_limit_Nm;
    c.v_min_radps[i] = table.joint[i].v_min_radps;
    c.torque_scale[i] = table.joint[i].torque_scale;
    image.sigma_Nm[i] = table.joint[i].sigma_Nm;
  }
  return Status::kOk;
}

// The table that the model's own numbers make: every default of kInfo and kAxes.
template <class Model>
Table<Model> DefaultTable() {
  Table<Model> table;
  table.schema = Model::kSchema;
  for (int g = 0; g < model::kForgettingGroups; ++g) table.forgetting[g] = Model::kForgetting[g];
  for (int i = 0; i < Model::kJoints; ++i) {
    const model::AxisInfo& a = Model::kAxes[i];
    table.joint[i] = {a.sigma_Nm, a.v_min_radps, a.torque_limit_Nm, 1.0f};
  }
  for (int k = 0; k < Model::kParameters; ++k) {
    const model::ParameterInfo& p = Model::kInfo[k];
    table.parameter[k] = {p.mean, p.sd, p.process_noise, p.state, p.group};
  }
  return table;
}

}  // namespace armcal::estimator
