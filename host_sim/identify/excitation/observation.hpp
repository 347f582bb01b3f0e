// excitation - how well a motion shows a model's parameters, equation (26), and the torque that it needs.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "codegen/src/generator/model.hpp"

namespace armcal::excitation {

// True if motion alone shows the effect. Then it reads no temperature, time or flag, is no state of the run, and has no
// memory; with memory a row would depend on all samples before.
bool MotionShows(const codegen::EffectRecord& record);

// Defines the condition number of K for all of armcal. Columns are the filter coordinates that are estimated: rigid
// base, Coulomb, viscous, effects. Rows are divided by their joint's torque noise. Columns are scaled to unit norm.
class Observation {
 public:
  enum class Rotors { kAsked, kLeftOut };

  // Left out are columns whose state is not `estimated`, and effects that motion alone does not show.
  // Rotors::kLeftOut: without the rotor inertias, as in the survey. The model must outlive the observation.
  explicit Observation(const codegen::Model& model, Rotors rotors = Rotors::kAsked);

  const codegen::Model& model() const { return model_; }
  const std::vector<int>& columns() const { return column_; }             // filter columns asked for
  const std::vector<std::string>& left_out() const { return left_out_; }  // names of estimated columns not asked for
  const Eigen::VectorXd& mean() const { return mean_; }                   // [model columns] the file's values
  double weight(int joint) const;                                         // 1 / noise^2

  // row[i]: [samples x model columns], at the robot file's values where a column depends on them. Reuses row's memory.
  void Rows(const codegen::Signals& s, std::vector<Eigen::MatrixXd>& row) const;

  // The torque by the robot file's values, [samples x joints]. The file must know bodies: Model::robot().has_prior.
  Eigen::MatrixXd Torque(const codegen::Signals& s) const;

  // sum_i K_i' K_i / noise_i^2 over the columns asked for, of the first `samples` rows.
  Eigen::MatrixXd Gram(const std::vector<Eigen::MatrixXd>& row, Eigen::Index samples) const;

  // The same over a whole motion, piece by piece.
  Eigen::MatrixXd Gram(const codegen::Signals& s) const;

  // cond(K); infinite if a column is zero or K is singular to working precision.
  double ConditionNumber(const codegen::Signals& s) const;

  // The places of these friction terms and effects among columns(). "coulomb_viscous" is Coulomb and viscous friction;
  // "stribeck" is an effect on every joint, "stribeck:3" on joint 3. InputError: a name without a column.
  std::vector<int> Places(const std::vector<std::string>& effects) const;

 private:
  const codegen::Model& model_;
  std::vector<int> column_;
  std::vector<std::string> left_out_;
  Eigen::VectorXd mean_;
};

}  // namespace armcal::excitation
