// estimator - the adopted table: what a parameter table means for feed-forward and filters, and how it is computed.
#pragma once

#include "armcal/estimator/row_gate.hpp"
#include "armcal/filter/prior.hpp"
#include "armcal/math/mul_add.hpp"
#include "armcal/model/evaluate.hpp"
#include "armcal/model/parameters.hpp"
#include "armcal/physical/rigid_prior.hpp"

namespace armcal::estimator {

// The smallest D of a dense column (and of eta) in the Kalman form, in prior units. It keeps the conditional standard
// deviation of each of them above a thousandth of its prior. Without a floor, D becomes so small that a row changes U
// by less than one rounding, and rounding errors add up in U. Measured: after a million samples with a regressor
// condition of 1e4, the estimate is wrong by 0.3 standard deviations with a floor of 1e-9, and by 0.01 with this one.
inline constexpr float kLinkFloor = 1e-6f;
// A column whose prior standard deviation is below this (in its own unit) is taken as known.
inline constexpr float kSmallestSd = 1e-12f;

template <class Model>
using Table = model::ParameterTable<Model::kJoints, Model::kParameters>;

// What one table means for feed-forward and filters. It must not change while an estimator works with it. Shapes are
// those of the arrays; columns are in the order [front, dense, eta].
template <class Model>
struct AdoptedTable {
  static_assert(Model::kRigid > 0, "a model has at least one base parameter of its links");
  model::Committed<Model> committed;  // b0, and all that the tick needs
  filter::Prior<Model> prior;
  // s: an estimate is b = b0 + s x; of a logarithmic eta, ln b = ln b0 + s x. 0: the column is not estimated.
  float scale[Model::kColumns + Model::kNonlinear] = {};
  float eta_low[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};  // bounds of x of eta, prior units
  float eta_high[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  float sigma_Nm[Model::kJoints] = {};    // torque noise of a row
  float gate_sigma[Model::kJoints] = {};  // limit of RowGate; 0: every row is taken
};

// True if the lower bound of eta is positive. Then the filter estimates ln eta instead of eta.
template <class Model>
constexpr bool IsLogarithmic(int e) {
  return Model::kInfo[Model::kParameters - Model::kNonlinear + e].lower > 0.0f;
}
// The value of eta number e at x, which is in prior units.
template <class Model>
float EtaAt(const AdoptedTable<Model>& table, int e, float x) {
  const float step = table.scale[Model::kColumns + e] * x;
  return IsLogarithmic<Model>(e) ? table.committed.eta[e] * math::Exp(step) : table.committed.eta[e] + step;
}
// The derivative of eta number e by x, where its value is `eta`.
template <class Model>
float EtaSlope(const AdoptedTable<Model>& table, int e, float eta) {
  return table.scale[Model::kColumns + e] * (IsLogarithmic<Model>(e) ? eta : 1.0f);
}

namespace internal {
inline bool Uncertain(model::ParameterState s) {
  return s == model::ParameterState::kEstimated || s == model::ParameterState::kConsidered;
}
inline float Amplitude(const model::ParameterEntry& e) {
  return e.state == model::ParameterState::kStandby ? 0.0f : e.mean;
}
inline float Spread(const model::ParameterEntry& e) { return Uncertain(e.state) ? e.sd : 0.0f; }

// A rigid column is `considered` if every uncertain body parameter that it depends on is.
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

// The prior of the dense columns in prior units: rigid columns are correlated with each other, effects with nothing.
template <class Model>
void ScaleCorrelation(const physical::RigidPrior<Model, float>& rigid, AdoptedTable<Model>& adopted) {
  constexpr int kRigid = Model::kRigid;
  filter::Prior<Model>& prior = adopted.prior;
  for (float& u : prior.dense_ud) u = 0.0f;
  for (int k = 0; k < math::UdSize(kRigid); ++k) prior.dense_ud[k] = rigid.ud[k];
  for (int j = kRigid; j < Model::kDense; ++j)
    prior.dense_ud[math::UdIndex(j, j)] = math::Masked(1.0f, prior.active[Model::kFront + j]);
  const float* scale = adopted.scale + Model::kFront;
  float inverse[kRigid];
  for (int r = 0; r < kRigid; ++r) inverse[r] = math::Divide(1.0f, scale[r]);
  math::UdScale<kRigid>(prior.dense_ud, inverse, scale);
}

// The eta columns of the extended filter, and the range of x that keeps each eta in the range of its effect's record.
template <class Model>
void PriorOfEta(const Table<Model>& table, AdoptedTable<Model>& adopted) {
  for (int e = 0; e < Model::kNonlinear; ++e) {
    const int k = Model::kColumns + e, entry = Model::kParameters - Model::kNonlinear + e;
    const model::ParameterEntry& given = table.parameter[entry];
    const model::ParameterInfo& info = Model::kInfo[entry];
    const bool log = IsLogarithmic<Model>(e);
    adopted.committed.eta[e] = given.mean;
    const float scale = log ? math::Divide(Spread(given), given.mean) : Spread(given);
    const bool active = scale > kSmallestSd && given.mean >= info.lower && given.mean <= info.upper;
    adopted.scale[k] = active ? scale : 0.0f;
    adopted.prior.active[k] = math::MaskOf(active);
    adopted.prior.considered[k] = active && given.state == model::ParameterState::kConsidered;
    adopted.prior.any_considered |= adopted.prior.considered[k];
    adopted.prior.lambda[k] = 1.0f;
    const bool noisy = active && given.state == model::ParameterState::kEstimated;
    adopted.prior.noise[k] = noisy ? given.process_noise / given.sd / given.sd : 0.0f;
    const float low = log ? math::Log(info.lower / given.mean) : info.lower - given.mean;
    const float high = log ? math::Log(info.upper / given.mean) : info.upper - given.mean;
    adopted.eta_low[e] = active ? low / scale : 0.0f;
    adopted.eta_high[e] = active ? high / scale : 0.0f;
  }
}
}  // namespace internal

// Fills in an AdoptedTable in slices: Begin, then Step until it no longer answers kBusy. Context: background.
template <class Model>
class TableBuild {
 public:
  // `table` must not change until the end. `rigid` and `adopted` must live until the end; Step writes both. Afterwards
  // ReadBodies and BeginPhysical may read `rigid`.
  void Begin(const Table<Model>& table, std::uint32_t generation, physical::RigidPrior<Model, float>& rigid,
             AdoptedTable<Model>& adopted) {
    table_ = &table;
    rigid_ = &rigid;
    adopted_ = &adopted;
    generation_ = generation;
    at_ = 0;
    stage_ = Stage::kBodies;
  }

  // One slice. kBusy: call again. kOk: `adopted` is filled in. kContracted (the compiler's flags); kWrongSchema;
  // kUnphysical (a link's body, or a negative rotor inertia); kNotFinite (the map overflows). On refusal `adopted` is
  // unchanged.
  core::Status Step() {
    switch (stage_) {
      case Stage::kBodies:
        return Next(Stage::kSpread, MapMeans());
      case Stage::kSpread:
        physical::SpreadLink<Model>(*rigid_, at_++);
        if (at_ == Model::kJoints) at_ = 0, stage_ = Stage::kConsidered;
        return core::Status::kBusy;
      case Stage::kConsidered:
        for (int rows = 0; rows < kRows && at_ < kRigid; ++rows, ++at_)
          considered_[at_] = internal::RigidConsidered<Model>(*table_, rigid_->w + at_ * Model::kBodyParameters);
        if (at_ == kRigid) stage_ = Stage::kBeginFactor;
        return core::Status::kBusy;
      case Stage::kBeginFactor:
        factor_.Begin(rigid_->w, rigid_->ud);
        stage_ = Stage::kFactor;
        return core::Status::kBusy;
      case Stage::kFactor:
        if (factor_.Step(kPairs)) stage_ = Stage::kVariance;
        return core::Status::kBusy;
      case Stage::kVariance:
        return Next(Stage::kColumns, Variances());
      case Stage::kColumns:
        FillColumns();
        return Next(Stage::kPrior, core::Status::kOk);
      case Stage::kPrior:
        internal::PriorOfEta<Model>(*table_, *adopted_);
        internal::ScaleCorrelation(*rigid_, *adopted_);
        FillAxes();
        return core::Status::kOk;
    }
    return core::Status::kOk;
  }

 private:
  enum class Stage : std::uint8_t { kBodies, kSpread, kConsidered, kBeginFactor, kFactor, kVariance, kColumns, kPrior };
  static constexpr int kRigid = Model::kRigid, kBlock = model::kBodyBlock;
  // Of a slice: rows of the map, and pairs of rows of its factor. Some 12 000 instructions of a Cortex-M4F.
  static constexpr int kRows = 1 + 900 / Model::kBodyParameters, kPairs = kRows;

  core::Status Next(Stage next, core::Status status) {
    if (!core::IsOk(status)) return status;
    stage_ = next;
    return core::Status::kBusy;
  }

  // From bodies to base parameters: the mean.
  core::Status MapMeans() {
    if (math::Contracts()) return core::Status::kContracted;
    if (table_->schema != Model::kSchema) return core::Status::kWrongSchema;
    for (int link = 0; link < Model::kJoints; ++link) {
      float body[kBlock];
      for (int k = 0; k < kBlock; ++k) body[k] = internal::Amplitude(table_->parameter[link * kBlock + k]);
      if (!physical::CanExist(body)) return core::Status::kUnphysical;
    }
    for (int k = 0; k < Model::kBodyParameters; ++k) {
      rigid_->mean[k] = internal::Amplitude(table_->parameter[k]);
      rigid_->sd[k] = internal::Spread(table_->parameter[k]);
    }
    physical::MapBodies<Model>(rigid_->mean, base_);
    return core::Status::kOk;
  }

  core::Status Variances() {
    math::UdDiagonal<kRigid>(rigid_->ud, variance_);
    bool finite = true;
    for (int r = 0; r < kRigid; ++r) finite &= math::IsFinite(base_[r]) && math::IsFinite(variance_[r]);
    for (float u : rigid_->ud) finite &= math::IsFinite(u);
    return finite ? core::Status::kOk : core::Status::kNotFinite;
  }

  void FillColumns() {
    const Table<Model>& table = *table_;
    // The table holds bodies, front columns, dense effect columns and eta, in this order.
    const auto entry = [&](int k) -> const model::ParameterEntry& {
      return table.parameter[Model::kBodyParameters + (k < Model::kFront ? k : k - kRigid)];
    };
    filter::Prior<Model>& prior = adopted_->prior;
    prior.any_considered = false;
    for (int k = 0; k < Model::kColumns; ++k) {
      const bool body = k >= Model::kFront && k < Model::kFront + kRigid;
      const int r = k - Model::kFront;
      adopted_->committed.p[k] = body ? base_[r] : internal::Amplitude(entry(k));
      const float sd = body ? math::Sqrt(variance_[r]) : internal::Spread(entry(k));
      const bool active = sd > kSmallestSd;
      adopted_->scale[k] = active ? sd : 0.0f;
      prior.active[k] = math::MaskOf(active);
      prior.considered[k] = active && (body ? considered_[r] : entry(k).state == model::ParameterState::kConsidered);
      prior.any_considered |= prior.considered[k];
      prior.lambda[k] = table.forgetting[body ? 0 : entry(k).group];
      const bool noisy = active && !body && entry(k).state == model::ParameterState::kEstimated;
      prior.noise[k] = noisy ? entry(k).process_noise / sd / sd : 0.0f;
    }
    prior.link_floor = kLinkFloor;
  }

  void FillAxes() {
    model::Committed<Model>& c = adopted_->committed;
    c.valid = true;
    c.generation = generation_;
    c.bumpless = (table_->flags & model::kFlagBumpless) != 0;
    // Cut to the largest float below 2^32: the cast of a larger number differs between machines.
    const float blend = static_cast<float>(table_->blend_ms) * (Model::kTickRate_Hz / 1000.0f);
    c.blend_ticks = static_cast<std::uint32_t>(math::Min(blend, 4294967040.0f));
    for (int i = 0; i < Model::kJoints; ++i) {
      c.limit_Nm[i] = table_->joint[i].torque_limit_Nm;
      c.v_min_radps[i] = table_->joint[i].v_min_radps;
      c.torque_scale[i] = table_->joint[i].torque_scale;
      adopted_->sigma_Nm[i] = table_->joint[i].sigma_Nm;
      const float gate = table_->joint[i].gate_sigma;
      adopted_->gate_sigma[i] = gate > 0.0f ? gate : kGateSigma;
    }
  }

  const Table<Model>* table_ = nullptr;
  physical::RigidPrior<Model, float>* rigid_ = nullptr;
  AdoptedTable<Model>* adopted_ = nullptr;
  std::uint32_t generation_ = 0;
  float base_[kRigid] = {}, variance_[kRigid] = {};
  bool considered_[kRigid] = {};  // which columns are only considered
  math::UdOfSquareRoot<kRigid, Model::kBodyParameters, float> factor_;
  int at_ = 0;
  Stage stage_ = Stage::kBodies;
};

// The same at once, and with the same answers. This is the longest call of lib: for a program that may wait. Not
// inlined: the caller's stack frame often holds the table, and this one holds the factors.
template <class Model>
[[gnu::noinline]] core::Status BuildAdoptedTable(const Table<Model>& table, std::uint32_t generation,
                                                 physical::RigidPrior<Model, float>& rigid,
                                                 AdoptedTable<Model>& adopted) {
  TableBuild<Model> build;
  build.Begin(table, generation, rigid, adopted);
  core::Status status = core::Status::kBusy;
  while (status == core::Status::kBusy) status = build.Step();
  return status;
}

// The table that holds every default of the model's kInfo and kAxes.
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
