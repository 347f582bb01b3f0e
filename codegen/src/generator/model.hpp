// generator - a robot and its effects as one graph with a parameter table.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/base_parameters.hpp"
#include "codegen/src/generator/effect.hpp"
#include "codegen/src/generator/instance.hpp"
#include "codegen/src/generator/robot_prior.hpp"
#include "codegen/src/generator/tape.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

using Catalogue = std::map<std::string, EffectRecord>;

// One entry of the parameter table, in its order: bodies (11 a link), front columns, dense effect columns, eta.
struct TableParameter {
  std::string name, unit;
  double mean = 0, sd = 0, lower = 0, upper = 0, process_noise = 0;
  std::string state = "estimated";
  int group = 0;       // 0 bodies, 1 friction, 2 effects
  int joint = -1;      // 0-based: of a body or an effect, of a pair the first one; -1: the whole arm
  std::string effect;  // record; empty for bodies
};

// Measured or derived motion, one row a sample. N samples, n joints; joint units and SI.
struct Signals {
  Eigen::VectorXd t;
  Eigen::MatrixXd q, qd, qdd, temp;  // temp may be empty: then it reads as zero
  int samples() const { return static_cast<int>(q.rows()); }
};

// Immutable after construction.
class Model {
 public:
  // Throws io::InputError where the robot file and the records do not fit together.
  Model(const Robot& robot, const Catalogue& catalogue);

  const Robot& robot() const { return robot_; }
  int joints() const { return robot_.joints(); }
  int front() const { return front_; }
  int rigid() const { return rigid_; }
  int dense() const { return dense_; }
  int columns() const { return front_ + dense_; }  // filter coordinates: [front, dense]
  int nonlinear() const { return static_cast<int>(unknown_.size()); }
  int body_parameters() const { return kBodyBlock * joints(); }
  int parameters() const { return static_cast<int>(table_.size()); }
  int front_begin(int joint) const { return front_begin_[joint]; }  // joint = joints(): front()
  int row_begin(int joint) const { return row_begin_[joint]; }
  int table_index(int column) const {
    return column < front_ ? body_parameters() + column : body_parameters() + column - rigid_;
  }
  bool is_rigid(int column) const { return column >= front_ && column < front_ + rigid_; }
  int column_joint(int column) const { return column_joint_[column]; }  // the one joint it touches, or -1
  const std::vector<TableParameter>& table() const { return table_; }
  std::string column_name(int column) const;
  std::string column_unit(int column) const;
  const std::vector<int>& base_columns() const { return base_.column; }  // body parameters, indices into 11n
  const Eigen::MatrixXd& base_map() const { return base_.map; }          // rigid x 11n
  const BodyPrior& body_prior() const { return body_prior_; }
  const std::vector<RotorInertia>& rotors() const { return rotor_; }  // [joints]
  const std::vector<EffectInstance>& effects() const { return effect_; }
  const std::vector<EffectUnknown>& unknowns() const { return unknown_; }
  bool depends_on_estimate() const { return depends_on_estimate_; }
  int states() const { return states_; }  // what the model carries from sample to sample
  int sensitivities() const { return static_cast<int>(graph_->states().size()) - states_; }  // d state / d eta
  int ready_state(int joint) const { return ready_state_[joint]; }  // 1 in it: the row may be used; -1: always

  // row[i]: N x columns(), torque of joint i per unit of each filter coordinate.
  // committed: columns() values (used by columns that depend on the estimate), eta: nonlinear() values.
  void Regressor(const Signals& s, std::span<const double> committed, std::span<const double> eta,
                 std::vector<Eigen::MatrixXd>& row) const;

  // The same block by block, for sums over a log that no memory should hold: see Tape::ForEachBlock. States run through
  // from the first sample; root[joint * columns() + column].
  void ForEachBlock(const Signals& s, std::span<const double> committed, std::span<const double> eta,
                    const Tape::Visit& visit) const;

  // d tau / d eta at filter coordinates p: row[i] is N x nonlinear().
  void Jacobian(const Signals& s, std::span<const double> committed, std::span<const double> p,
                std::span<const double> eta, std::vector<Eigen::MatrixXd>& row) const;

  // Columns of one body about its file frame: out[i] is N x 10, row i.
  void BodyColumns(const Signals& s, int body, std::vector<Eigen::MatrixXd>& out) const;
  // Rigid base columns without motion (gravity only): row[i] is N x rigid().
  void GravityRegressor(const Signals& s, std::vector<Eigen::MatrixXd>& row) const;

  const Graph& graph() const { return *graph_; }
  const std::vector<std::vector<Expr>>& rows() const { return rows_; }  // [joint][column]
  const std::vector<std::vector<Expr>>& jacobian() const {
    return jacobian_;
  }  // [joint][eta]; reads kCoordinate inputs

 private:
  BodyRows TiltedRows(int axis);
  BodyRows TiltRows(const Catalogue& catalogue);
  Expr CommittedTorque(const BodyRows& rows, int joint);
  Expr QuantityOf(const InputId& id);
  void MakeReady();
  void MakeJacobian();
  void AddEffects(const Catalogue& catalogue);
  void PlaceColumns();
  void MakeTable();
  const EffectColumn& effect_column(int k) const {
    return effect_[effect_column_[k].effect].columns[effect_column_[k].column];
  }
  struct Bound;  // inputs bound to a log's columns
  Bound Bind(const Signals& s, std::span<const double> committed, std::span<const double> eta, int states) const;

  Robot robot_;
  BodyPrior body_prior_;
  std::unique_ptr<Graph> graph_ = std::make_unique<Graph>();
  BaseParameters base_;
  std::vector<RotorInertia> rotor_;
  int front_ = 0, rigid_ = 0, dense_ = 0;
  std::vector<int> front_begin_, row_begin_, column_joint_;
  Catalogue record_;  // those in use; effect_ points into it
  std::vector<EffectInstance> effect_;
  std::vector<EffectUse> use_;  // one per effect_
  std::vector<EffectUnknown> unknown_;
  std::vector<TableParameter> table_;
  struct ColumnOf {
    int effect, column;
  };
  std::vector<ColumnOf> effect_column_;  // filter columns that are no rigid ones: [front, dense effects]
  std::vector<std::vector<Expr>> rows_, jacobian_, body_rows_, gravity_rows_;
  int states_ = 0;
  std::vector<int> ready_state_;
  std::unique_ptr<Tape> regressor_tape_;
  bool depends_on_estimate_ = false;
};

}  // namespace armcal::codegen
