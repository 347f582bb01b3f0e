// collision - how near an arm comes to itself and to its cell along a motion.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/identify/collision/cell.hpp"
#include "host_sim/identify/collision/distance.hpp"

namespace armcal::collision {

struct Unchecked {
  std::string a, b, why;
};

// The smallest distance of a motion, and where it is.
struct Nearest {
  double distance_m = 0;  // 0: they touch or overlap; infinite: there is no pair to check
  Eigen::Index sample = 0;
  std::string a, b;
};

// A line for each collision mesh that is there and cannot be used: its kind, its content, or its size.
std::vector<std::string> MeshFaults(const codegen::Robot& robot);

// Why this arm cannot be checked; empty: it can.
std::string WhyUncheckable(const codegen::Robot& robot);

// May be used by several threads at once.
class Clearance {
 public:
  // margin_m: the distance that is asked for. Throws io::InputError: a mesh that cannot be read, or a shape that is not
  // in metres. WhyUncheckable must be empty.
  Clearance(const codegen::Robot& robot, const Cell& cell, double margin_m);

  double margin_m() const { return margin_m_; }
  std::size_t pairs() const { return pair_.size(); }
  // Solids of neighbours, and those that are nearer to each other than that in every pose that was tried.
  const std::vector<Unchecked>& unchecked() const { return unchecked_; }
  // Bodies that move and have no shape.
  const std::vector<std::string>& shapeless() const { return shapeless_; }

  // q: [samples x joints]. True if no pair comes nearer than the margin, and a guard of 0.5 mm, at any sample.
  bool Keeps(const Eigen::MatrixXd& q) const;
  Nearest Smallest(const Eigen::MatrixXd& q) const;

  // Adds up, over samples and pairs, the square of the share of kSoft_m by which the pair is too near, and adds
  // `weight` times the derivative to d_q. It begins a little before the margin, so that a search keeps off. For
  // overlapping solids the balls around them stand in their place: the value jumps there, and it leads apart.
  double Penalty(const Eigen::MatrixXd& q, double weight, Eigen::MatrixXd& d_q) const;

 private:
  // A solid or a plane, of a body or of the cell.
  struct Part {
    std::string name;
    bool is_cell = false;
    int body = 0;            // 0 for the cell, too
    Eigen::Isometry3d pose;  // seen from the body's frame
    SolidPtr solid;          // none: a plane
    Eigen::Vector3d middle;  // of a ball around, in the solid's axes
    double radius = 0;       // of this ball
    // What a plane meets first is one of these points, or a ball (round) or a disc across z (rim) around it.
    std::vector<Eigen::Vector3d> extreme;
    double round = 0, rim = 0;
    Eigen::Vector3d normal;  // of a plane
    double offset = 0;
  };
  struct Pair {
    std::size_t a, b;       // b is the outer one
    Eigen::VectorXd reach;  // of each joint: the distance changes by at most this much for one rad or m
  };
  // Nearest points and the unit vector from a to b. Positive: apart.
  struct Meeting {
    double distance;
    Eigen::Vector3d on_a, on_b, direction;
  };
  using Poses = std::vector<Eigen::Isometry3d>;  // of the bodies, seen from the base frame

  void AddArm();
  void AddCell(const Cell& cell);
  void ChoosePairs();
  Eigen::VectorXd Reach(const Part& inner, const Part& outer) const;
  Poses At(const Eigen::VectorXd& q) const;
  Eigen::Isometry3d PoseOf(const Part& part, const Poses& poses) const { return poses[BodyOf(part)] * part.pose; }
  static std::size_t BodyOf(const Part& part) { return static_cast<std::size_t>(part.body); }
  double BallsApart(const Pair& pair, const Poses& poses) const;
  Meeting Meet(const Pair& pair, const Poses& poses) const;
  static Meeting MeetPlane(const Part& plane, const Part& part, const Eigen::Isometry3d& pose);
  template <class Visit>
  void ForNearPairs(const Eigen::MatrixXd& q, const double& limit, Visit visit) const;

  codegen::Robot robot_;
  double margin_m_;
  std::vector<Part> part_;
  std::vector<Pair> pair_;
  std::vector<Unchecked> unchecked_;
  std::vector<std::string> shapeless_;
};

}  // namespace armcal::collision
