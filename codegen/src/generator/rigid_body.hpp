// generator - the rigid arm's torque as expressions, linear in the body parameters.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/graph.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

// m, m c (3), I about the frame origin (xx xy xz yy yz zz), rotor inertia (joint side)
inline constexpr int kBodyBlock = 11;
using BodyRows = std::vector<std::vector<Expr>>;  // [joint][kBodyBlock body + parameter]

// Where each dot product is taken. It changes the number of operations and no value, but for the slides: those move the
// origins that the body parameters refer to.
struct FrameChoice {
  // The four dot products in which a link's columns meet a joint's screw. kSpin: Izz; kInertia: the other moments and
  // products; kForce: mass and first moments, force part; kMoment: first moments, moment part.
  enum Part { kSpin, kInertia, kForce, kMoment, kParts };

  std::vector<double> slide_m;                // link frame j is moved by this along its own z
  std::vector<char> lumped;                   // link j's rates in one step from before its run of parallel axes
  std::vector<std::array<int, kParts>> axes;  // [joint * n + body]: half frame (see arm_vectors.hpp)
};

// Dot products in the axes of the body itself, no lumping; slides zero.
FrameChoice LocalFrames(const Robot& robot);

// A deterministic search for the fewest multiplications and additions in the base columns (about 0.2 s for six axes);
// remembered for the life of the program. Any thread.
FrameChoice BestFrames(const Robot& robot);

// The slides of BestFrames. Kinematics alone decide them: one arm, any gravity, parameters about the same origins.
std::vector<double> BestSlides(const Robot& robot);

// Torque of joint i per unit of parameter p of link j: row[i][kBodyBlock j + p]; zero expressions where it has none.
// Parameters are about the slid origins. With motion = false speeds and accelerations are zero (gravity only).
BodyRows BodyRegressor(Graph& graph, const Robot& robot, bool motion, const FrameChoice& choice);

// With BestFrames; without motion there is little to save: local axes, the same slides.
BodyRows BodyRegressor(Graph& graph, const Robot& robot, bool motion = true);

// parameters about the slid origins = S parameters about the file's link frames; 11n x 11n.
Eigen::MatrixXd SlideMap(const Robot& robot, const std::vector<double>& slide_m);
Eigen::MatrixXd SlideMap(const Robot& robot);  // of BestSlides

}  // namespace armcal::codegen
