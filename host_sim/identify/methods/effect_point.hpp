// methods - friction and effects at one instant, for methods that go sample by sample.
#pragma once

#include <span>

#include "codegen/src/generator/model.hpp"

namespace armcal::calibration {

// The columns of a model that are not rigid, and their derivative by eta, at one sample. Holds scratch: one object a
// thread.
class EffectPoint {
 public:
  // InputError for a model with memory: its columns need the samples before.
  explicit EffectPoint(const codegen::Model& model);

  // q, qd, qdd [n]; temp [n], or empty for 0; z = [p, eta]. Where a column depends on the committed model, p stands for
  // it.
  void Set(double t, const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
           const Eigen::VectorXd& temp, const Eigen::VectorXd& z);
  // Writes the values at the last Set. row: [n x columns], slope: [n x nonlinear]. Other entries stay as they are.
  void Columns(Eigen::MatrixXd& row);
  void Slope(Eigen::MatrixXd& slope);
  // Torque of all effects at the last Set, [n].
  Eigen::VectorXd Torque();

 private:
  struct Place {
    int joint, column;
  };
  const codegen::Model& model_;
  std::vector<Place> column_place_, slope_place_;
  codegen::Tape column_tape_, slope_tape_;
  struct Source {
    enum Kind {
      kZero,
      kTime,
      kPosition,
      kSpeed,
      kAcceleration,
      kTemperature,
      kCommitted,
      kCoordinate,
      kEta
    } kind = kZero;
    int index = 0;
  };
  std::vector<Source> source_;  // of each graph input
  std::vector<double> input_, scratch_, value_;
  Eigen::VectorXd z_;
};

}  // namespace armcal::calibration
