// excitation - quintic blends between states of motion, as short as the limits allow; knows no trajectory family.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "host_sim/identify/excitation/observation.hpp"

namespace armcal::excitation {

// Position, speed and acceleration of all joints at one instant.
struct State {
  Eigen::VectorXd q, qd, qdd;
};
State AtRest(const Eigen::VectorXd& q);

// The polynomial of degree 5 between two states: position, speed and acceleration are met at both ends.
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

// The shortest blend of those tried (0.5 s to 20 s) whose shares of all limits are at most `share`; none: not found.
std::optional<Blend> ShortestBlend(const Observation& observation, const State& from, const State& to, double share);

// The same with one end at rest wherever suits: half way of the moving end's speed ahead, inside the position limits.
std::optional<Blend> ShortestStart(const Observation& observation, const State& to, double share);
std::optional<Blend> ShortestStop(const Observation& observation, const State& from, double share);

}  // namespace armcal::excitation
