// diagnosis - instantiates records and evaluates their expressions over whole logs.
#include "host_sim/diagnosis/candidate.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace armcal::diagnosis {

using Eigen::VectorXd;

Candidate::Candidate(const codegen::EffectRecord& record, const codegen::Robot& robot, const std::vector<int>& joints)
    : instance_(codegen::Instantiate(*graph_, record, robot, joints, codegen::QuantitiesAsInputs(*graph_))) {
  std::set<int> rows;
  std::vector<codegen::Expr> roots;
  for (const auto& column : instance_.columns)
    for (const auto& [row, e] : column.rows) rows.insert(row);
  rows_.assign(rows.begin(), rows.end());
  for (int c = 0; c < columns(); ++c)
    for (const auto& [row, e] : instance_.columns[c].rows) {
      root_.emplace_back(c, static_cast<int>(std::find(rows_.begin(), rows_.end(), row) - rows_.begin()));
      roots.push_back(e);
    }
  tape_ = std::make_unique<codegen::Tape>(*graph_, roots);
}

bool Candidate::reads(const std::string& input) const {
  const auto& inputs = record().inputs;
  return std::find(inputs.begin(), inputs.end(), input) != inputs.end();
}

std::string Candidate::name() const {
  std::string s = record().name;
  for (std::size_t k = 0; k < joints().size(); ++k) s += (k ? "-" : ", joint ") + std::to_string(joints()[k] + 1);
  return s;
}

std::vector<double> Candidate::Initial() const {
  std::vector<double> eta;
  for (const auto& u : unknowns()) eta.push_back(u.initial);
  return eta;
}

void Candidate::Evaluate(const Quantities& quantities, const std::vector<double>& eta,
                         std::vector<std::vector<VectorXd>>& value) const {
  const codegen::Signals& s = quantities.data->s;
  const auto column_of = [&](const std::string& name, codegen::Binding& b) {
    const auto digits = name.find_first_of("0123456789");
    if (name == "t") return b.column = s.t.data(), true;
    if (name[0] == 'Y' && digits == 1) {
      int row = 0, body = 0, p = 0;
      std::sscanf(name.c_str(), "Y%d_%d_%d", &row, &body, &p);
      return b.column = quantities.flange[row].col(p).data(), true;
    }
    if (digits == std::string::npos) return false;
    const std::string quantity = name.substr(0, digits);
    const int joint = std::atoi(name.c_str() + digits) - 1;
    const Eigen::MatrixXd* m = quantity == "q"             ? &s.q
                               : quantity == "qd"          ? &s.qd
                               : quantity == "qdd"         ? &s.qdd
                               : quantity == "temp"        ? &s.temp
                               : quantity == "tau_rigid"   ? &quantities.tau_rigid
                               : quantity == "tau_gravity" ? &quantities.tau_gravity
                                                           : nullptr;
    if (!m || joint < 0 || joint >= m->cols()) return false;
    return b.column = m->col(joint).data(), true;
  };
  std::vector<codegen::Binding> bindings;
  for (const std::string& input : graph_->inputs()) {
    codegen::Binding b;
    bool found = false;
    for (std::size_t k = 0; k < unknowns().size(); ++k)
      if (unknowns()[k].name == input) b.value = eta[k], found = true;
    if (!found) column_of(input, b);
    bindings.push_back(b);
  }
  value.assign(columns(), std::vector<VectorXd>(rows_.size()));
  std::vector<double*> out;
  for (const auto& [c, r] : root_) {
    value[c][r].resize(s.samples());
    out.push_back(value[c][r].data());
  }
  tape_->Evaluate(bindings, s.samples(), out);
}

namespace {
// Whether the search has what this record reads: no memory from sample to sample, no quantity that it does not bind.
bool CanBeTried(const codegen::EffectRecord& record) {
  if (record.kind_class != "static" && record.kind_class != "run_state") return false;
  if (record.search.how == "none" || record.search.how == "window") return false;
  if (record.search.signal == "t") return false;  // what a run did over time says nothing about another run
  static const std::set<std::string> bound = {"q", "qd", "qdd", "temp", "t", "tau_rigid", "tau_gravity", "Y"};
  return std::all_of(record.inputs.begin(), record.inputs.end(), [](const auto& i) { return bound.contains(i); });
}
}  // namespace

std::vector<std::unique_ptr<Candidate>> MakeCandidates(const codegen::Catalogue& catalogue,
                                                       const codegen::Model& model) {
  std::set<std::pair<std::string, std::vector<int>>> estimated;
  for (const auto& e : model.effects())
    for (const auto& p : model.table())
      if (p.effect == e.record->name && p.state == "estimated" && (e.joints.empty() || p.joint == e.joints[0]))
        estimated.insert({e.record->name, e.joints});
  std::vector<std::unique_ptr<Candidate>> out;
  for (const auto& [name, record] : catalogue) {
    if (record.friction_law || !CanBeTried(record)) continue;
    for (const auto& joints : codegen::JointSets(record, model.joints()))
      if (!estimated.contains({name, joints}))
        out.push_back(std::make_unique<Candidate>(record, model.robot(), joints));
  }
  return out;
}

}  // namespace armcal::diagnosis
