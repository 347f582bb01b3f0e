// generator - assembles rigid base columns, friction law and effects into one model; knows no output format.
#include "codegen/src/generator/model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/io/input_error.hpp"

namespace armcal::codegen {
namespace {

const char* const kFrictionLaw = "coulomb_viscous";  // the record of the robot's own friction, model (3) of the survey
const char* const kBodyName[] = {"m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "Ia"};
const char* const kBodyUnit[] = {"kg",     "kg*m",   "kg*m",   "kg*m",   "kg*m^2", "kg*m^2",
                                 "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2"};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// m, m c, I about the link origin from mass, centre and I about the centre.
std::array<double, 10> AboutOrigin(const Link& l) {
  const auto& c = l.center_m;
  const auto& I = l.inertia_kgm2;
  const double m = l.mass_kg, x = c[0], y = c[1], z = c[2];
  return {m,
          m * x,
          m * y,
          m * z,
          I[0] + m * (y * y + z * z),
          I[1] - m * x * y,
          I[2] - m * x * z,
          I[3] + m * (x * x + z * z),
          I[4] - m * y * z,
          I[5] + m * (x * x + y * y)};
}

// Prior standard deviations of (m, c, I about the centre).
std::array<double, 10> LinkDeviation(const Robot& r, const Link& l) {
  std::array<double, 10> sd{};
  sd[0] = r.link_relative_sd * l.mass_kg;
  for (int k = 0; k < 3; ++k) sd[1 + k] = std::max(r.link_relative_sd * std::abs(l.center_m[k]), r.center_floor_m);
  const double largest = std::max({l.inertia_kgm2[0], l.inertia_kgm2[3], l.inertia_kgm2[5]});
  for (int k = 0; k < 6; ++k)
    sd[4 + k] = std::max(r.link_relative_sd * std::abs(l.inertia_kgm2[k]), r.inertia_floor_ratio * largest);
  return sd;
}

}  // namespace

Model::Model(const Robot& robot, const Catalogue& catalogue) : robot_(robot) {
  const int n = joints();
  body_rows_ = BodyRegressor(*graph_, robot_);
  base_ = FindBaseParameters(*graph_, body_rows_, robot_);
  rigid_ = static_cast<int>(base_.column.size());
  gravity_rows_ = BodyRegressor(*graph_, robot_, false);
  // Columns that need the committed model see its torque as an expression; filter indices are known only after all
  // effects are placed, so the committed base parameters are named by their base number here and renumbered when
  // emitted.
  const auto torque = [this](const std::vector<std::vector<Expr>>& rows, int joint) {
    depends_on_estimate_ = true;
    Expr sum = graph_->Constant(0);
    for (int d = 0; d < rigid_; ++d)
      sum = sum + rows[joint][base_.column[d]] * graph_->Input("base" + std::to_string(d));
    return sum;
  };
  const ModelQuantities quantities{[&](int j) { return torque(body_rows_, j); },
                                   [&](int j) { return torque(gravity_rows_, j); },
                                   [&](int row, int body, int p) { return body_rows_[row][kBodyBlock * body + p]; }};
  AddEffects(catalogue, quantities);
  PlaceColumns();
  MakeTable();
  std::vector<Expr> roots;
  for (int i = 0; i < n; ++i) roots.insert(roots.end(), rows_[i].begin(), rows_[i].end());
  regressor_tape_ = std::make_unique<Tape>(*graph_, roots);
}

void Model::AddEffects(const Catalogue& catalogue, const ModelQuantities& quantities) {
  std::vector<EffectUse> uses = robot_.effect;
  EffectUse law;
  law.effect = kFrictionLaw;
  for (int j = 0; j < joints(); ++j) law.joints.push_back(j);
  uses.insert(uses.begin(), law);
  for (const EffectUse& use : uses) {
    const auto it = catalogue.find(use.effect);
    if (it == catalogue.end())
      throw io::InputError(robot_.path + ": effect." + use.effect + ": expected the name of an effect record");
    record_.emplace(it->first, it->second);
    const EffectRecord& record = record_.at(use.effect);
    std::vector<std::vector<int>> sets;
    if (record.scope == "joint")
      for (const int j : use.joints) sets.push_back({j});
    else sets.push_back(use.joints);
    if (sets.empty()) throw io::InputError(robot_.path + ": effect." + use.effect + ": expected joints = [...]");
    for (const auto& set : sets) {
      // A later entry for the same effect and joints says more about the first one: its state and values, not a second
      // column.
      std::size_t known = effect_.size();
      int ordinal = 1;
      for (std::size_t e = 0; e < effect_.size(); ++e)
        if (effect_[e].record == &record && effect_[e].joints == set) known = e, ++ordinal;
      if (known < effect_.size() && record.search.how != "spectral") {
        use_[known] = use;
        continue;
      }
      effect_.push_back(Instantiate(*graph_, record, robot_, set, quantities, ordinal));
      use_.push_back(use);
    }
  }
}

void Model::PlaceColumns() {
  const int n = joints();
  std::vector<std::vector<ColumnOf>> by_joint(n);
  std::vector<ColumnOf> shared;
  for (std::size_t e = 0; e < effect_.size(); ++e)
    for (std::size_t c = 0; c < effect_[e].columns.size(); ++c) {
      const auto& rows = effect_[e].columns[c].rows;
      const ColumnOf place{static_cast<int>(e), static_cast<int>(c)};
      if (rows.size() == 1) by_joint[rows.begin()->first].push_back(place);
      else shared.push_back(place);
    }
  for (int j = 0; j < n; ++j) {
    front_begin_.push_back(static_cast<int>(effect_column_.size()));
    for (const ColumnOf& c : by_joint[j]) effect_column_.push_back(c), column_joint_.push_back(j);
  }
  front_ = static_cast<int>(effect_column_.size());
  front_begin_.push_back(front_);
  effect_column_.insert(effect_column_.end(), shared.begin(), shared.end());
  dense_ = rigid_ + static_cast<int>(shared.size());
  column_joint_.resize(columns(), -1);
  const Expr zero = graph_->Constant(0);
  rows_.assign(n, std::vector<Expr>(columns(), zero));
  for (int d = 0; d < rigid_; ++d)
    for (int i = 0; i < n; ++i) rows_[i][front_ + d] = body_rows_[i][base_.column[d]];
  for (std::size_t k = 0; k < effect_column_.size(); ++k) {
    const int column = static_cast<int>(k) < front_ ? static_cast<int>(k) : static_cast<int>(k) + rigid_;
    for (const auto& [i, e] : effect_column(static_cast<int>(k)).rows) rows_[i][column] = e;
  }
  for (int i = 0; i < n; ++i) {
    int begin = dense_;
    for (int d = dense_ - 1; d >= 0; --d)
      if (!rows_[i][front_ + d].IsZero()) begin = d;
    row_begin_.push_back(begin);
  }
  for (const EffectInstance& e : effect_) unknown_.insert(unknown_.end(), e.unknowns.begin(), e.unknowns.end());
}

void Model::MakeTable() {
  for (int j = 0; j < joints(); ++j) {
    const Joint& joint = robot_.joint[j];
    const std::string number = std::to_string(j + 1);
    // Without a prior every link starts as a small ball: physical, and so wide that it says nothing.
    const Link& link = robot_.has_prior ? joint.link : Link{1, {}, {0.01, 0, 0, 0.01, 0, 0.01}};
    const auto mean = AboutOrigin(link);
    const auto sd = robot_.has_prior ? LinkDeviation(robot_, link)
                                     : std::array<double, 10>{1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3};
    for (int p = 0; p < 10; ++p)
      table_.push_back({kBodyName[p] + number, kBodyUnit[p], mean[p], sd[p], p == 0 ? 0 : -kInfinity, kInfinity, 0,
                        "estimated", 0, j, ""});
    const double rotor = joint.motor.gear_ratio * joint.motor.gear_ratio * joint.motor.rotor_inertia_kgm2;
    table_.push_back({"Ia" + number, "kg*m^2", rotor, robot_.has_prior ? robot_.link_relative_sd * rotor : 1e3, 0,
                      kInfinity, 0, "estimated", 0, j, ""});
  }
  for (std::size_t k = 0; k < effect_column_.size(); ++k) {
    const EffectColumn& c = effect_column(static_cast<int>(k));
    const EffectInstance& e = effect_[effect_column_[k].effect];
    const EffectUse& use = use_[effect_column_[k].effect];
    const int joint = static_cast<int>(k) < front_ ? column_joint_[k] : -1;
    TableParameter p{
        c.name, c.unit,        c.amplitude, c.sd, c.lower, c.upper, 0, use.state, e.record->friction_law ? 1 : 2,
        joint,  e.record->name};
    if (e.record->friction_law && joint >= 0) {
      const auto it = robot_.joint[joint].nominal.find(c.key);
      if (it != robot_.joint[joint].nominal.end() && it->second > 0)
        p.mean = it->second, p.sd = robot_.friction_relative_sd * it->second;
    }
    if (const auto it = use.mean.find(c.key); it != use.mean.end()) p.mean = it->second;
    if (c.fixed_amplitude) p.state = "fixed";
    if (use.state == "standby") p.mean = 0;
    p.process_noise = c.process_noise * c.sd * c.sd * robot_.sample_ticks / robot_.tick_rate_Hz;
    table_.push_back(p);
  }
  for (std::size_t e = 0; e < effect_.size(); ++e)
    for (const EffectUnknown& u : effect_[e].unknowns) {
      const auto it = use_[e].nonlinear.find(u.key);
      const double mean = it != use_[e].nonlinear.end() ? it->second : u.initial;
      table_.push_back({u.name, u.unit, mean, 0, u.lower, u.upper, 0, "fixed", 2,
                        effect_[e].joints.empty() ? -1 : effect_[e].joints[0], effect_[e].record->name});
    }
}

std::string Model::column_name(int column) const {
  if (!is_rigid(column)) return table_[table_index(column)].name;
  const int p = base_.column[column - front_];
  const auto& map = base_.map.row(column - front_);
  const bool merged = (map.array() != 0).count() > 1;
  return kBodyName[p % kBodyBlock] + std::to_string(p / kBodyBlock + 1) + (merged ? "R" : "");  // R: regrouped
}

std::string Model::column_unit(int column) const {
  return is_rigid(column) ? kBodyUnit[base_.column[column - front_] % kBodyBlock] : table_[table_index(column)].unit;
}

std::vector<Binding> Model::Bind(const Signals& s, std::span<const double> committed,
                                 std::span<const double> eta) const {
  std::map<std::string, Binding> value;
  for (int j = 0; j < joints(); ++j) {
    value[InputName("q", j)].column = s.q.col(j).data();
    value[InputName("qd", j)].column = s.qd.col(j).data();
    value[InputName("qdd", j)].column = s.qdd.col(j).data();
    if (s.temp.cols() > j) value[InputName("temp", j)].column = s.temp.col(j).data();
  }
  if (s.t.size()) value["t"].column = s.t.data();
  for (int d = 0; d < rigid_ && !committed.empty(); ++d)
    value["base" + std::to_string(d)].value = committed[front_ + d];
  for (int k = 0; k < nonlinear(); ++k)
    value[unknown_[k].name].value = eta.empty() ? table_[parameters() - nonlinear() + k].mean : eta[k];
  std::vector<Binding> bindings;
  for (const std::string& input : graph_->inputs()) bindings.push_back(value[input]);
  return bindings;
}

namespace {
// Evaluates [joint][column] expressions into one N x columns matrix a joint; zero expressions cost nothing.
void EvaluateRows(const Graph& graph, const std::vector<std::vector<Expr>>& rows, std::span<const Binding> bindings,
                  int samples, std::vector<Eigen::MatrixXd>& out, const Tape* tape = nullptr) {
  std::vector<Expr> roots;
  std::vector<double*> target;
  out.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    out[i].resize(samples, static_cast<Eigen::Index>(rows[i].size()));
    for (std::size_t c = 0; c < rows[i].size(); ++c) {
      roots.push_back(rows[i][c]);
      target.push_back(out[i].col(static_cast<Eigen::Index>(c)).data());
    }
  }
  if (tape) return tape->Evaluate(bindings, samples, target);
  Tape(graph, roots).Evaluate(bindings, samples, target);
}
}  // namespace

void Model::Regressor(const Signals& s, std::span<const double> committed, std::span<const double> eta,
                      std::vector<Eigen::MatrixXd>& row) const {
  EvaluateRows(*graph_, rows_, Bind(s, committed, eta), s.samples(), row, regressor_tape_.get());
}

void Model::BodyColumns(const Signals& s, int body, std::vector<Eigen::MatrixXd>& out) const {
  std::vector<std::vector<Expr>> rows;
  for (const auto& r : body_rows_) rows.emplace_back(r.begin() + kBodyBlock * body, r.begin() + kBodyBlock * body + 10);
  EvaluateRows(*graph_, rows, Bind(s, {}, {}), s.samples(), out);
  const Eigen::MatrixXd slide = SlideMap(robot_).block(kBodyBlock * body, kBodyBlock * body, 10, 10);
  for (auto& m : out) m = (m * slide).eval();
}

void Model::GravityRegressor(const Signals& s, std::vector<Eigen::MatrixXd>& row) const {
  std::vector<std::vector<Expr>> rows;
  for (const auto& r : gravity_rows_) {
    rows.emplace_back();
    for (const int c : base_.column) rows.back().push_back(r[c]);
  }
  EvaluateRows(*graph_, rows, Bind(s, {}, {}), s.samples(), row);
}

}  // namespace armcal::codegen
