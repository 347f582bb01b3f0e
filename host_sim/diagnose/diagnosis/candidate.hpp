// diagnosis - tries an effect record on given joints: its columns over the logs. No kind of effect is named here.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "codegen/src/generator/arm_torque.hpp"
#include "codegen/src/generator/instance.hpp"
#include "codegen/src/generator/tape.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::diagnosis {

// What the columns of a record may read, over one dataset. Model torque is the current estimate's, never the measured
// one.
struct Quantities {
  const calibration::Dataset* data = nullptr;
  codegen::TorqueParts parts;
  Eigen::MatrixXd tau_model;                         // [N x n] predicted torque
  std::map<int, std::vector<Eigen::MatrixXd>> body;  // of each body that is read: [n] N x 10, a row of its columns
  Eigen::VectorXd dt;                                // [N] time since the sample before
  std::vector<char> restart;                         // [N] 1: states start anew
};

// One candidate: a record on a set of joints. Columns are evaluated for given nonlinear parameters.
class Candidate {
 public:
  Candidate(const codegen::EffectRecord& record, const codegen::Robot& robot, const std::vector<int>& joints);

  const codegen::EffectRecord& record() const { return *instance_.record; }
  const std::vector<int>& joints() const { return instance_.joints; }
  const codegen::EffectInstance& instance() const { return instance_; }
  const std::vector<codegen::EffectUnknown>& unknowns() const { return instance_.unknowns; }
  std::vector<codegen::EffectUnknown>& unknowns() { return instance_.unknowns; }
  // eta may hold the values of the unknowns several times. The record is then used as often, each time with columns of
  // its own.
  int columns(const std::vector<double>& eta) const {
    return static_cast<int>(instance_.columns.size() * (unknowns().empty() ? 1 : eta.size() / unknowns().size()));
  }
  const codegen::EffectColumn& column(int c) const { return instance_.columns[c % instance_.columns.size()]; }
  const std::vector<int>& rows() const { return rows_; }  // joints whose torque it touches
  bool reads(codegen::Quantity quantity) const;
  // What its columns read, and the load of its joints, which a search may ask for.
  std::set<codegen::InputId> inputs() const;
  // It reads every signal that the other one reads. Unknowns and states are no signals.
  bool ReadsAllOf(const Candidate& other) const;
  bool is_curve() const { return record().generic_penalty > 0; }       // fits a form, names no cause
  bool is_surface() const { return !record().search.second.empty(); }  // a curve over two signals
  // It happens at one time of the training log. One part of a log says nothing about it in another part, or in another
  // log.
  bool is_event() const { return record().search.how == codegen::SearchWay::kWindow; }
  // The columns at one sample depend on other samples, so they cannot be computed from a thinned log.
  bool has_memory() const { return !graph_->states().empty() || reads(codegen::Quantity::kDelayedTorque); }
  std::string name() const;  // "stribeck, joint 3"

  // value[c][r]: column c (all of the first use, then all of the next) in row rows()[r], N values (empty where the
  // column does not touch that row). time_s: what the columns read as time for the whole log, instead of the log's own.
  void Evaluate(const Quantities& quantities, const std::vector<double>& eta,
                std::vector<std::vector<Eigen::VectorXd>>& value, std::optional<double> time_s = {}) const;

  // 1 at each sample where its states no longer remember how they started, 0 elsewhere, N values; empty: it has none
  // that forget.
  Eigen::VectorXd Settled(const Quantities& quantities, const std::vector<double>& eta) const;

  std::vector<double> Initial() const;
  // The unknown that says by how much the measurement is delayed; -1 if the record is of another kind.
  int delay() const;

 private:
  // The values of some roots of the graph over a log; out: one for each root, N values.
  void Run(const codegen::Tape& tape, const std::vector<char>& states, const Quantities& quantities, const double* eta,
           std::optional<double> time_s, std::span<double* const> out) const;

  std::unique_ptr<codegen::Graph> graph_ = std::make_unique<codegen::Graph>();
  codegen::EffectInstance instance_;
  std::vector<int> rows_;
  std::vector<std::pair<int, int>> root_;  // (column, index into rows_)
  std::unique_ptr<codegen::Tape> tape_;
  std::vector<char> states_;  // those of the graph that the columns need
};

// Every record of the catalogue on every joint set it may be tried on, except the friction law and what the model
// already estimates.
std::vector<std::unique_ptr<Candidate>> MakeCandidates(const codegen::Catalogue& catalogue,
                                                       const codegen::Model& model);

}  // namespace armcal::diagnosis
