// methods - where a search may look: ranges, and bodies that can exist; knows no objective.
#pragma once

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

// Coordinates u in [0, 1] stand for the free coordinates of z within their ranges. The bodies that can exist are a
// convex set that holds Problem::start, so whatever lies outside is drawn back along the straight line to the start. Of
// an arm whose robot file knows no bodies, base parameters alone are searched, and no body is asked for.
class SearchSpace {
 public:
  // InputError: a free coordinate without a finite range, or bodies of the start that cannot exist (names them).
  SearchSpace(const Problem& problem, const char* method);

  int size() const { return static_cast<int>(free_.size()); }
  Eigen::VectorXd Point(const Eigen::VectorXd& u) const;  // u -> z
  Eigen::VectorXd Place(const Eigen::VectorXd& z) const;  // z -> u
  Eigen::VectorXd Possible(const Eigen::VectorXd& z) const;
  // What d value / d z is in u.
  Eigen::VectorXd Gradient(const Eigen::VectorXd& dz) const;

  // Standard parameters: those that z shows, and for the rest what the prior expects with them.
  Eigen::VectorXd Bodies(const Eigen::VectorXd& z) const;
  // - sum over links of log det of the pseudo-inertia over that of the start, and its gradient [z]; infinite where a
  // body cannot exist.
  double Barrier(const Eigen::VectorXd& z, Eigen::VectorXd& gradient) const;

  // "3 of 72 at an end of their range"; empty if none.
  std::string AtEnds(const Eigen::VectorXd& z) const;

 private:
  const codegen::Model& model_;
  Eigen::VectorXd start_, lower_, upper_, width_;  // [z], [free] ...
  std::vector<int> free_;
  Eigen::MatrixXd map_;     // [11 n x rigid]
  Eigen::VectorXd offset_;  // bodies = offset + map p
  double start_log_det_ = 0;
};

}  // namespace armcal::calibration
