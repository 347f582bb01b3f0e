// generator - puts the rigid columns, the friction law and the effects into one model, and makes its parameter table.
#include "codegen/src/generator/model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/generator/dynamics.hpp"
#include "codegen/src/io/faults.hpp"
#include "codegen/src/io/input_error.hpp"

namespace armcal::codegen {
namespace {

const char* const kFrictionLaw = "coulomb_viscous";  // the record of the robot's own friction, model (3) of the survey

bool Contains(const std::vector<int>& list, int value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace

Model::Model(const Robot& robot, const Catalogue& catalogue) : robot_(robot), body_prior_(MakeBodyPrior(robot)) {
  body_rows_ = BodyRegressor(*graph_, robot_);
  base_ = FindBaseParameters(*graph_, body_rows_, robot_, TiltRows(catalogue));
  rotor_ = MakeRotors(robot_, body_prior_, base_.map);
  rigid_ = static_cast<int>(base_.column.size());
  gravity_rows_ = BodyRegressor(*graph_, robot_, false);
  AddEffects(catalogue);
  PlaceColumns();
  MakeReady();
  states_ = static_cast<int>(graph_->states().size());
  MakeJacobian();
  MakeTable();
  std::vector<Expr> roots;
  for (const auto& row : rows_) roots.insert(roots.end(), row.begin(), row.end());
  regressor_tape_ = std::make_unique<Tape>(*graph_, roots);
}

// Torque per m/s^2 of gravity along one axis of the base frame.
BodyRows Model::TiltedRows(int axis) {
  Robot tilted = robot_;
  tilted.gravity_mps2 = {};
  tilted.gravity_mps2[axis] = 1;
  return BodyRegressor(*graph_, tilted, false);
}

// What an effect that turns gravity lets the torque see besides: body parameters that the level arm hides are then base
// parameters, too.
BodyRows Model::TiltRows(const Catalogue& catalogue) {
  const bool any = std::any_of(robot_.effect.begin(), robot_.effect.end(), [&](const EffectUse& use) {
    return !FindRecord(catalogue, robot_.path, use.effect).adds_base.empty();
  });
  BodyRows rows;
  for (int axis = 0; any && axis < 3; ++axis) {
    const BodyRows one = TiltedRows(axis);
    rows.insert(rows.end(), one.begin(), one.end());
  }
  return rows;
}

// Columns that need the committed model see its torque as an expression. Filter indices are known only after all
// effects are placed, so the committed base parameters are named by their base number here and renumbered when emitted.
Expr Model::CommittedTorque(const BodyRows& rows, int joint) {
  depends_on_estimate_ = true;
  return BaseTorque(*graph_, rows, base_.column, joint);
}

// What an effect reads of the committed model, as an expression.
Expr Model::QuantityOf(const InputId& id) {
  switch (id.quantity) {
    case Quantity::kRigidTorque:
      depends_on_estimate_ = true;
      return LoadTorque(*graph_, body_rows_, base_.column, rotor_, id.row);
    case Quantity::kGravityTorque:
      return CommittedTorque(gravity_rows_, id.row);
    case Quantity::kBodyColumn: {  // about the file's frame: slid parameters = S parameters, a sum of slid columns
      const Eigen::MatrixXd slide = SlideMap(robot_);
      const int first = kBodyBlock * id.body;
      Expr sum = graph_->Constant(0);
      for (int k = 0; k < kBodyBlock; ++k)
        sum = sum + slide(first + k, first + id.parameter) * body_rows_[id.row][first + k];
      return sum;
    }
    case Quantity::kMassMatrix:
      depends_on_estimate_ = true;
      return LoadTorque(*graph_, AccelerationRows(*graph_, robot_, id.body), base_.column, rotor_, id.row);
    case Quantity::kGravitySlope:
      return CommittedTorque(TiltedRows(id.parameter), id.row);
    case Quantity::kGravityStiffness:
      return Derivative(CommittedTorque(gravity_rows_, id.row), graph_->Input({Quantity::kPosition, id.body}));
    case Quantity::kTorqueSlope:
      return Derivative(QuantityOf({Quantity::kRigidTorque, id.row}), graph_->Input({Quantity::kPosition, id.body}));
    case Quantity::kTorqueSpeedSlope:
      return Derivative(QuantityOf({Quantity::kRigidTorque, id.row}), graph_->Input({Quantity::kSpeed, id.body}));
    case Quantity::kFlangePosition:
      return FlangeOf(*graph_, robot_).position[id.parameter];
    case Quantity::kFlangeJacobian:
      return Derivative(FlangeOf(*graph_, robot_).position[id.parameter], graph_->Input({Quantity::kPosition, id.row}));
    case Quantity::kApproach:
      return FlangeOf(*graph_, robot_).approach[id.parameter];
    case Quantity::kApproachSlope:
      return Derivative(FlangeOf(*graph_, robot_).approach[id.parameter], graph_->Input({Quantity::kPosition, id.row}));
    case Quantity::kModelTorque:
    case Quantity::kDelayedTorque:
      throw io::InputError(robot_.path + ": effect: a sensor record acts on the measurement, not on the torque");
    default:
      return graph_->Input(id);
  }
}

namespace {
// The values that a robot file gives have names of the record's parameters.
void CheckNames(const std::string& where, const EffectUse& use, const EffectInstance& effect) {
  std::vector<std::string> linear, nonlinear;
  for (const EffectColumn& c : effect.columns) linear.push_back(c.key);
  for (const EffectUnknown& u : effect.unknowns) nonlinear.push_back(u.key);
  const auto check = [&](const char* table, const std::map<std::string, double>& values,
                         const std::vector<std::string>& known) {
    for (const auto& [name, value] : values) {
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      const std::string nearest = io::Nearest(name, known);
      std::string all;
      for (const std::string& each : known) all += (all.empty() ? "" : ", ") + each;
      throw io::InputError(where + "." + table + "." + name + ": " +
                           (!nearest.empty() ? "expected " + nearest
                            : known.empty()  ? "the record has no such parameters"
                                             : "expected one of " + all));
    }
  };
  check("mean", use.mean, linear);
  check("nonlinear", use.nonlinear, nonlinear);
}
}  // namespace

void Model::AddEffects(const Catalogue& catalogue) {
  const auto quantities = [this](const InputId& id) { return QuantityOf(id); };
  std::vector<EffectUse> uses = robot_.effect;
  EffectUse law;
  law.effect = kFrictionLaw;
  for (int j = 0; j < joints(); ++j) {
    // On standby, a law that takes its place is off.
    const bool replaced = std::any_of(uses.begin(), uses.end(), [&](const EffectUse& use) {
      return use.state != "standby" && FindRecord(catalogue, robot_.path, use.effect).replaces == kFrictionLaw &&
             Contains(use.joints, j);
    });
    if (!replaced) law.joints.push_back(j);
  }
  if (!law.joints.empty()) uses.insert(uses.begin(), law);
  for (const EffectUse& use : uses) {
    const std::string where = robot_.path + ": effect." + use.effect;
    const EffectRecord& found = FindRecord(catalogue, robot_.path, use.effect);
    if (!found.on_target)
      throw io::InputError(where + ": expected an effect that a model can hold; " + found.name +
                           " is for the host only");
    const EffectRecord& record = record_.emplace(found.name, found).first->second;
    std::vector<std::vector<int>> sets;
    if (record.scope == EffectScope::kJoint)
      for (const int j : use.joints) sets.push_back({j});
    else sets.push_back(use.joints);
    if (sets.empty()) throw io::InputError(where + ": expected joints = [...]");
    for (const auto& set : sets) {
      // A later entry for the same effect and joints says more about the first one: its state and values, not a second
      // column. Where a record may be used several times, that one is on standby.
      std::size_t known = effect_.size();
      int ordinal = 1;
      for (std::size_t e = 0; e < effect_.size(); ++e) {
        if (effect_[e].record != &record || effect_[e].joints != set) continue;
        ++ordinal;
        if (!record.repeats() || (known == effect_.size() && use_[e].state == "standby")) known = e;
      }
      if (known < effect_.size()) {
        use_[known] = use;
      } else {
        effect_.push_back(Instantiate(*graph_, record, robot_, set, quantities, ordinal));
        use_.push_back(use);
      }
      CheckNames(where, use, effect_[known]);
    }
  }
}

// One state per row that waits for others to settle: 1 from the first sample on at which all of them have.
void Model::MakeReady() {
  ready_state_.assign(joints(), -1);
  for (int i = 0; i < joints(); ++i) {
    Expr all;  // stays empty where nothing needs to settle
    for (const EffectInstance& e : effect_) {
      const auto touches = [i](const EffectColumn& c) { return c.rows.contains(i); };
      if (!std::any_of(e.columns.begin(), e.columns.end(), touches)) continue;
      for (const Expr settled : e.settled) all = all.graph() ? graph_->Binary(Op::kMin, all, settled) : settled;
    }
    if (!all.graph()) continue;
    ready_state_[i] = static_cast<int>(graph_->states().size());
    graph_->State("ready" + std::to_string(i + 1), graph_->Constant(0), [&](Expr) { return all; });
  }
}

// d tau_i / d eta_k = sum over the effect's columns of p_c d column / d eta_k, states included.
void Model::MakeJacobian() {
  jacobian_.assign(joints(), std::vector<Expr>(nonlinear(), graph_->Constant(0)));
  for (int k = 0; k < columns(); ++k) {
    if (is_rigid(k)) continue;
    const int number = k < front_ ? k : k - rigid_;
    const EffectInstance& owner = effect_[effect_column_[number].effect];
    const Expr p = graph_->Input({.quantity = Quantity::kCoordinate, .parameter = k});
    for (const EffectUnknown& u : owner.unknowns) {
      const Expr eta = graph_->Symbol(u.name);
      const auto at = std::find_if(unknown_.begin(), unknown_.end(),
                                   [&](const EffectUnknown& other) { return other.name == u.name; });
      for (const auto& [i, e] : effect_column(number).rows) {
        Expr& entry = jacobian_[i][at - unknown_.begin()];
        entry = entry + p * TotalDerivative(e, eta);
      }
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

namespace {

const char* const kBodyUnit[] = {"kg",     "kg*m",   "kg*m",   "kg*m",   "kg*m^2", "kg*m^2",
                                 "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2"};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void Model::MakeTable() {
  for (int k = 0; k < body_parameters(); ++k) {
    const int p = k % kBodyBlock;
    const bool positive = p == 0 || p == kBodyBlock - 1;
    table_.push_back({kBodyParameterName[p] + std::to_string(k / kBodyBlock + 1), kBodyUnit[p], body_prior_.mean[k],
                      body_prior_.deviation[k], positive ? 0 : -kInfinity, kInfinity, 0, "estimated", 0, k / kBodyBlock,
                      ""});
  }
  for (std::size_t k = 0; k < effect_column_.size(); ++k) {
    const EffectColumn& c = effect_column(static_cast<int>(k));
    const EffectInstance& e = effect_[effect_column_[k].effect];
    const EffectUse& use = use_[effect_column_[k].effect];
    const int joint = e.joints.empty() ? -1 : e.joints[0];
    // A record that takes the friction law's place is one, and starts from the same nominal values.
    const bool friction = e.record->friction_law || !e.record->replaces.empty();
    TableParameter p{c.name, c.unit,    c.amplitude,      c.sd,  c.lower,       c.upper,
                     0,      use.state, friction ? 1 : 2, joint, e.record->name};
    if (friction && joint >= 0) {
      const auto it = robot_.joint[joint].nominal.find(c.key);
      if (it != robot_.joint[joint].nominal.end() && it->second > 0)
        p.mean = it->second, p.sd = robot_.friction_relative_sd * it->second;
      if (robot_.joint[joint].wide.contains(c.key)) p.sd = std::max(p.mean, WideFriction(robot_.joint[joint], c.key));
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
  return kBodyParameterName[p % kBodyBlock] + std::to_string(p / kBodyBlock + 1) + (merged ? "R" : "");  // R: regrouped
}

std::string Model::column_unit(int column) const {
  return is_rigid(column) ? kBodyUnit[base_.column[column - front_] % kBodyBlock] : table_[table_index(column)].unit;
}

}  // namespace armcal::codegen
