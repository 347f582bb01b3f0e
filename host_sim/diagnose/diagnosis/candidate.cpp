// diagnosis - instantiates an effect record on joints and evaluates its expressions over whole logs.
#include "host_sim/diagnose/diagnosis/candidate.hpp"

#include <algorithm>

#include "codegen/src/generator/state_path.hpp"
#include "host_sim/identify/calibration/channel.hpp"

namespace armcal::diagnosis {

using Eigen::VectorXd;

Candidate::Candidate(const codegen::EffectRecord& record, const codegen::Robot& robot, const std::vector<int>& joints)
    : instance_(codegen::Instantiate(*graph_, record, robot, joints, codegen::QuantitiesAsInputs(*graph_))) {
  std::set<int> rows;
  std::vector<codegen::Expr> roots;
  for (const auto& column : instance_.columns)
    for (const auto& [row, e] : column.rows) rows.insert(row);
  rows_.assign(rows.begin(), rows.end());
  for (std::size_t c = 0; c < instance_.columns.size(); ++c)
    for (const auto& [row, e] : instance_.columns[c].rows) {
      root_.emplace_back(static_cast<int>(c),
                         static_cast<int>(std::find(rows_.begin(), rows_.end(), row) - rows_.begin()));
      roots.push_back(e);
    }
  tape_ = std::make_unique<codegen::Tape>(*graph_, roots);
  states_ = codegen::StatesOf(*graph_, roots);
}

bool Candidate::reads(codegen::Quantity quantity) const {
  const auto& inputs = graph_->inputs();
  return std::any_of(inputs.begin(), inputs.end(), [&](const auto& input) { return input.quantity == quantity; });
}

std::set<codegen::InputId> Candidate::inputs() const {
  std::set<codegen::InputId> out(graph_->inputs().begin(), graph_->inputs().end());
  for (const auto* some : {&joints(), &rows_})
    for (const int j : *some) out.insert({codegen::Quantity::kRigidTorque, j});
  return out;
}

bool Candidate::ReadsAllOf(const Candidate& other) const {
  const auto &own = graph_->inputs(), &asked = other.graph_->inputs();
  return std::all_of(asked.begin(), asked.end(), [&](const codegen::InputId& id) {
    return id.quantity == codegen::Quantity::kSymbol || std::find(own.begin(), own.end(), id) != own.end();
  });
}

std::string Candidate::name() const {
  std::string s = record().name;
  for (std::size_t k = 0; k < joints().size(); ++k) s += (k ? "-" : ", joint ") + std::to_string(joints()[k] + 1);
  return s;
}

int Candidate::delay() const {
  if (record().apply.how != codegen::SensorAct::kDelay) return -1;
  for (std::size_t k = 0; k < unknowns().size(); ++k)
    if (unknowns()[k].key == record().apply.by) return static_cast<int>(k);
  return -1;
}

std::vector<double> Candidate::Initial() const {
  std::vector<double> eta;
  for (const auto& u : unknowns()) eta.push_back(u.initial);
  return eta;
}

namespace {

// Each column as it was a time before, linear between samples: friction's jumps stay jumps.
Eigen::MatrixXd Earlier(const VectorXd& t, const Eigen::MatrixXd& y, double delay_s) {
  return calibration::ChannelAt(t, {0, delay_s, 1}).Through(y);
}

// The log's column that a graph input stands for; null where the log does not have it, which reads as zero.
const double* ColumnOf(const Quantities& quantities, const Eigen::MatrixXd& delayed, const codegen::InputId& input) {
  const codegen::Signals& s = quantities.data->s;
  const auto joint = [&](const Eigen::MatrixXd& m) { return input.row < m.cols() ? m.col(input.row).data() : nullptr; };
  switch (input.quantity) {
    case codegen::Quantity::kPosition:
      return joint(s.q);
    case codegen::Quantity::kSpeed:
      return joint(s.qd);
    case codegen::Quantity::kAcceleration:
      return joint(s.qdd);
    case codegen::Quantity::kTemperature:
      return joint(s.temp);
    case codegen::Quantity::kTime:
      return s.t.data();
    case codegen::Quantity::kRigidTorque:
      return joint(quantities.parts.rigid);
    case codegen::Quantity::kGravityTorque:
      return joint(quantities.parts.gravity);
    case codegen::Quantity::kBodyColumn:
      return quantities.body.at(input.body).at(input.row).col(input.parameter).data();
    case codegen::Quantity::kMassMatrix:
      return quantities.parts.mass[input.row][input.body].data();
    case codegen::Quantity::kGravitySlope:
      return quantities.parts.tilt[input.row][input.parameter].data();
    case codegen::Quantity::kGravityStiffness:
      return quantities.parts.stiffness[input.row][input.body].data();
    case codegen::Quantity::kTorqueSlope:
      return quantities.parts.slope[input.row][input.body].data();
    case codegen::Quantity::kTorqueSpeedSlope:
      return quantities.parts.speed_slope[input.row][input.body].data();
    case codegen::Quantity::kFlangePosition:
      return quantities.parts.flange[input.parameter].data();
    case codegen::Quantity::kFlangeJacobian:
      return quantities.parts.jacobian[input.row][input.parameter].data();
    case codegen::Quantity::kApproach:
      return quantities.parts.approach[input.parameter].data();
    case codegen::Quantity::kApproachSlope:
      return quantities.parts.approach_slope[input.row][input.parameter].data();
    case codegen::Quantity::kModelTorque:
      return joint(quantities.tau_model);
    case codegen::Quantity::kDelayedTorque:
      return joint(delayed);
    case codegen::Quantity::kTimeStep:  // bound by the caller, as the following
    case codegen::Quantity::kBaseParameter:
    case codegen::Quantity::kCoordinate:
    case codegen::Quantity::kSymbol:
      break;
  }
  return nullptr;
}

}  // namespace

void Candidate::Evaluate(const Quantities& quantities, const std::vector<double>& eta,
                         std::vector<std::vector<VectorXd>>& value, std::optional<double> time_s) const {
  value.assign(columns(eta), std::vector<VectorXd>(rows_.size()));
  for (std::size_t first = 0, at = 0; first < value.size();
       first += instance_.columns.size(), at += unknowns().size()) {
    std::vector<double*> out;
    for (const auto& [c, r] : root_) {
      value[first + static_cast<std::size_t>(c)][r].resize(quantities.data->samples());
      out.push_back(value[first + static_cast<std::size_t>(c)][r].data());
    }
    Run(*tape_, states_, quantities, eta.data() + at, time_s, out);
  }
}

VectorXd Candidate::Settled(const Quantities& quantities, const std::vector<double>& eta) const {
  if (instance_.settled.empty()) return {};
  const codegen::Tape tape(*graph_, instance_.settled);
  Eigen::MatrixXd each(quantities.data->samples(), static_cast<Eigen::Index>(instance_.settled.size()));
  std::vector<double*> out;
  for (auto column : each.colwise()) out.push_back(column.data());
  Run(tape, codegen::StatesOf(*graph_, instance_.settled), quantities, eta.data(), {}, out);
  return each.rowwise().minCoeff();
}

void Candidate::Run(const codegen::Tape& tape, const std::vector<char>& wanted, const Quantities& quantities,
                    const double* eta, std::optional<double> time_s, std::span<double* const> out) const {
  const int samples = quantities.data->samples();
  const auto& states = graph_->states();
  const Eigen::MatrixXd delayed = reads(codegen::Quantity::kDelayedTorque)
                                      ? Earlier(quantities.data->s.t, quantities.tau_model, eta[delay()])
                                      : Eigen::MatrixXd();
  std::vector<codegen::Binding> bindings(graph_->inputs().size());
  for (std::size_t i = 0; i < bindings.size(); ++i) {
    const codegen::InputId& input = graph_->inputs()[i];
    if (input.quantity == codegen::Quantity::kSymbol) {  // a nonlinear parameter; a state is bound below
      const auto unknown =
          std::find_if(unknowns().begin(), unknowns().end(), [&](const auto& u) { return u.name == input.symbol; });
      if (unknown != unknowns().end()) bindings[i].value = eta[static_cast<std::size_t>(unknown - unknowns().begin())];
    } else if (input.quantity == codegen::Quantity::kTime && time_s) {
      bindings[i].value = *time_s;
    } else if (input.quantity == codegen::Quantity::kTimeStep) {
      bindings[i] = codegen::BindSteps(quantities.dt);
    } else {
      bindings[i].column = ColumnOf(quantities, delayed, input);
    }
  }
  Eigen::MatrixXd path;
  if (!states.empty()) {
    path = codegen::StatePath(*graph_, states.size(), bindings, samples, quantities.restart, wanted);
    for (std::size_t k = 0; k < states.size(); ++k)
      bindings[graph_->nodes()[states[k].value.id()].a].column = path.col(static_cast<Eigen::Index>(k)).data();
  }
  tape.Evaluate(bindings, samples, out);
}

std::vector<std::unique_ptr<Candidate>> MakeCandidates(const codegen::Catalogue& catalogue,
                                                       const codegen::Model& model) {
  std::set<std::pair<std::string, std::vector<int>>> estimated;
  for (const auto& e : model.effects())
    for (const auto& p : model.table())
      if (p.effect == e.record->name && p.state == "estimated" && (e.joints.empty() || p.joint == e.joints[0]))
        estimated.insert({e.record->name, e.joints});
  std::vector<std::unique_ptr<Candidate>> out;
  for (const auto& [name, record] : catalogue) {
    if (record.friction_law || record.search.how == codegen::SearchWay::kNone) continue;
    for (const auto& joints : codegen::JointSets(record, model.joints()))
      if (!estimated.contains({name, joints}))
        out.push_back(std::make_unique<Candidate>(record, model.robot(), joints));
  }
  std::stable_partition(out.begin(), out.end(), [](const auto& c) { return c->record().search.after.empty(); });
  return out;
}

}  // namespace armcal::diagnosis
