// generator - the arm's motion and its joints' screws as vectors that can be read in any link's axes.
//
// A vector of space is one thing; its three numbers depend on the axes it is read in. Here a vector is made in the axes
// where that is cheap and carried, joint by joint, to where somebody reads it; nothing is carried that nobody reads.
// Half frames: 2j are the axes of joint j before its own rotation (frame j-1 turned by alpha_j), 2j + 1 those of the
// link, -1 those of the base.
//
// Names of the temporaries, one-based: w2_3x is w of link 2 in the axes of link 3 (3i: of joint 3 before its rotation).
// w, dw: angular velocity, acceleration; a: acceleration of the origin; z, v: a joint's screw; f, n: force and moment
// per unit of a parameter; h: a x z.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <tuple>

#include "codegen/src/generator/rigid_body.hpp"

namespace armcal::codegen {

using Vec = std::array<Expr, 3>;

class ArmVectors {
 public:
  // Accelerations and screws of an arm that moves (or rests: motion = false); frames slid as the choice says.
  ArmVectors(Graph& graph, const Robot& robot, bool motion, const FrameChoice& choice);

  // Torque of joint i per unit of body j's parameter; axes: where each part's dot product is taken, half frames of
  // 2i..2j+1.
  Expr Torque(int i, int j, int parameter, const std::array<int, FrameChoice::kParts>& axes);

  // A point on the last link's z axis, this far from its origin, seen from the base.
  Vec PointOnFlange(double along_m) const;

 private:
  struct Vector {
    std::string name;       // for the temporaries: name + axes + "xyz"
    std::map<int, Vec> in;  // half frame -> components
  };
  struct Step {          // from the axes before to these
    bool joint = false;  // Rz(theta)' or Rx(alpha)'
    Expr s, c;
    double sa = 0, ca = 1;
  };
  Vector* Make(const std::string& name) { return &pool_.emplace_back(Vector{name, {}}); }
  Vector* Make(const std::string& name, int half, const Vec& components);
  Expr Rate(Quantity quantity, int joint) const;  // the graph's input, or zero at rest
  Vec Outward(int half, const Vec& v) const;
  Vec Inward(int half, const Vec& v) const;
  void NameComponents(const Vector& v, int half);
  const Vec& In(Vector* v, int half);
  Vector* AccelerationTimesAxis(int i, int j, int half);  // a_j x z_i, multiplied out in the given axes
  void MakeSteps(const FrameChoice& choice);
  void AddLink(int j, const FrameChoice& choice);
  void AddRates(int j, bool lumped);
  void AddOrigin(int j, bool same_origin);
  void AddScrews(int j, bool same_origin);
  void AddBodyVectors(int j);

  Graph& graph_;
  const Robot& robot_;
  bool motion_;
  std::deque<Vector> pool_;
  std::vector<Step> step_;                   // by half frame
  std::vector<Vec> p_;                       // origin of link j seen from the one before, in axes 2j - 1
  std::vector<Vector*> omega_, alpha_;       // of link j
  std::vector<Vector*> a_;                   // acceleration of its origin, gravity included; one where origins coincide
  std::vector<Vector*> z_;                   // direction of joint i; zero if prismatic
  std::vector<std::vector<Vector*>> lever_;  // [i][j]: z_i x (origin j - origin i); a prismatic joint's direction
  std::vector<std::vector<Vector*>> force_;  // per unit of first moment: columns of U = [alpha]x + [w]x[w]x
  std::vector<std::vector<Vector*>> moment_;  // per unit of Ixx Ixy Ixz Iyy Iyz Izz
  std::map<std::tuple<int, Vector*, int>, Vector*> cross_;
};

}  // namespace armcal::codegen
