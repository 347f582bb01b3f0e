// excitation - builds the whole trajectory: a blend in, periods of a series, slow moves, and back to the first pose.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/data/trajectory/trajectory.hpp"
#include "host_sim/identify/excitation/observation.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/identify/excitation/series.hpp"

namespace armcal::excitation {

// Position, speed and acceleration of all joints at one instant.
struct State {
  Eigen::VectorXd q, qd, qdd;
};
State AtRest(const Eigen::VectorXd& q);

// The polynomial of degree 5 between two states. It meets position, speed and acceleration at both ends.
class Blend {
 public:
  Blend(const State& from, const State& to, double duration_s);

  double duration_s() const { return duration_s_; }
  Eigen::VectorXd Position(double t_s) const;
  codegen::Signals At(const Eigen::VectorXd& t) const;

 private:
  double duration_s_;
  Eigen::MatrixXd power_;  // [joints x 6], in t / duration
};

// The shortest blend of those tried (0.5 s to 20 s) that keeps the limits. Empty: none found.
std::optional<Blend> ShortestBlend(const Observation& observation, const State& from, const State& to,
                                   const Limits& limits);

// The same with one end at rest. The place of rest is where the moving end's speed, falling to zero, leads; it is kept
// inside the position limits.
std::optional<Blend> ShortestStart(const Observation& observation, const State& to, const Limits& limits);
std::optional<Blend> ShortestStop(const Observation& observation, const State& from, const Limits& limits);

// Slow strokes of one joint. They show friction near standstill (Stribeck, presliding, backlash), which a Fourier
// series hardly does. The joint starts at rest at home, moves at constant speed +v, -v, .., and ends at rest at home.
// `strokes` is even. Speed changes are quintic, so the acceleration is continuous.
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

// Cells of equal duration, one after the other. Every joint runs through the same kinds of cells, but each starts with
// another one. So the joints move at different speeds at any time.
class SlowMoves {
 public:
  // home: where every cell starts and ends. speeds: the number of cells at constant speed. These speeds are spaced
  // logarithmically from 3 v_min to 0.3 of the speed limit times `reach` (0..1); they are lower where position or
  // acceleration limits, used up to `share`, leave no room. One more cell has small reversals at 5 v_min.
  SlowMoves(const codegen::Robot& robot, const Eigen::VectorXd& home, int speeds, double share, double reach);

  double duration_s() const;
  Eigen::VectorXd Position(double t_s) const;

 private:
  Eigen::VectorXd home_;
  std::vector<std::vector<Strokes>> cell_;  // [joint][cell]
};

struct ComposeSettings {
  int periods = 4;
  int slow_speeds = 6;  // cells of constant speed in the slow part; 0: no slow part
  double step_s = 0.004;
  double margin = 0.05;                             // of every limit, kept free
  const collision::Clearance* clearance = nullptr;  // none: collisions are not checked
};

struct Section {
  std::string name;
  double begin_s = 0, end_s = 0;
};

struct Composed {
  trajectory::Trajectory trajectory;
  std::vector<Section> sections;
  std::vector<JointPeaks> peaks;  // of the spline through the trajectory, on the check grid
  collision::Nearest nearest;     // the same, with a clearance
};

// The trajectory starts and ends at rest in the same pose, so it may be repeated. The series is entered where it is
// slowest. Slow moves are made around the series' middle pose, or else around the place where the series is left.
// InputError: no blend or slow part within the limits.
Composed Compose(const Observation& observation, const Series& series, const ComposeSettings& settings);

}  // namespace armcal::excitation
