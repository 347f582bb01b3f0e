// excitation - slow strokes at constant speed in both directions, and small reversals; knows no model.
// Friction near standstill (Stribeck, presliding, backlash) shows here and hardly in a Fourier series.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "codegen/src/robot/robot.hpp"

namespace armcal::excitation {

// One joint out and back, `strokes` times (even): from rest at home, at constant speed +v, -v, .., to rest at home.
// Speed changes are quintic, so the acceleration is continuous.
class Strokes {
 public:
  // speed: signed; blend_s: duration of each change of speed, at most (duration_s - blend_s) / strokes.
  Strokes(double duration_s, int strokes, double speed_radps, double blend_s);

  double Offset(double t_s) const;  // from home, rad
  double reach_rad() const;         // the farthest offset's size

 private:
  double duration_s_, speed_radps_, blend_s_;
  int strokes_;
};

// Cells of equal duration, one after the other; every joint runs through the same kinds of cells, each joint from
// another one on, so that the arm's joints move at different speeds at any time.
class SlowMoves {
 public:
  // home: where every cell starts and ends. speeds: cells at constant speed, logarithmically from 3 v_min to 0.3 of the
  // speed limit times `reach` (0..1), less where position or acceleration limits, used up to `share`, leave no room;
  // one more cell is small reversals at 5 v_min.
  SlowMoves(const codegen::Robot& robot, const Eigen::VectorXd& home, int speeds, double share, double reach);

  double duration_s() const;
  Eigen::VectorXd Position(double t_s) const;

 private:
  Eigen::VectorXd home_;
  std::vector<std::vector<Strokes>> cell_;  // [joint][cell]
};

}  // namespace armcal::excitation
