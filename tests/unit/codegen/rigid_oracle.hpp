// tests - the check that every rigid model must pass: its torque against KDL's for random arms, bodies and states.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include <Eigen/Geometry>

#include "codegen/src/generator/base_parameters.hpp"
#include "codegen/src/generator/tape.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::tests {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A body as it is: mass, centre, inertia about the centre, rotor.
struct Body {
  double m, c[3], I[6], rotor;
};

// The bodies of a robot file, rotors on the joint side.
inline std::vector<Body> BodiesOf(const codegen::Robot& robot) {
  std::vector<Body> bodies;
  for (const auto& joint : robot.joint) {
    const auto& l = joint.link;
    Body b{l.mass_kg, {}, {}, joint.motor.gear_ratio * joint.motor.gear_ratio * joint.motor.rotor_inertia_kgm2};
    std::copy(l.center_m.begin(), l.center_m.end(), b.c);
    std::copy(l.inertia_kgm2.begin(), l.inertia_kgm2.end(), b.I);
    bodies.push_back(b);
  }
  return bodies;
}

// 11 numbers a link: m, m c, I about the link origin, rotor. The test's own formula.
inline VectorXd StandardParameters(const std::vector<Body>& bodies) {
  VectorXd phi(11 * bodies.size());
  for (std::size_t j = 0; j < bodies.size(); ++j) {
    const auto& [m, c, I, rotor] = bodies[j];
    const double x = c[0], y = c[1], z = c[2];
    phi.segment<11>(11 * j) << m, m * x, m * y, m * z, I[0] + m * (y * y + z * z), I[1] - m * x * y, I[2] - m * x * z,
        I[3] + m * (x * x + z * z), I[4] - m * y * z, I[5] + m * (x * x + y * y), rotor;
  }
  return phi;
}

inline std::vector<Body> RandomBodies(int n, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Body> bodies(n);
  for (Body& b : bodies) {
    b.m = 2 + u(random);
    for (double& c : b.c) c = 0.4 * u(random);
    b.I[0] = 1 + 0.5 * u(random), b.I[3] = 1 + 0.5 * u(random), b.I[5] = 1 + 0.5 * u(random);
    b.I[1] = 0.3 * u(random), b.I[2] = 0.3 * u(random), b.I[4] = 0.3 * u(random);
    b.rotor = 1 + 0.5 * u(random);
  }
  return bodies;
}

struct State {
  VectorXd q, qd, qdd;
};
inline State RandomState(int n, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  const auto draw = [&](double scale) -> VectorXd {
    return VectorXd::NullaryExpr(n, [&] { return scale * u(random); });
  };
  State s;
  s.q = draw(3), s.qd = draw(2), s.qdd = draw(5);
  return s;
}

// One value per graph input: a joint's position, speed or acceleration.
inline std::vector<double> InputValues(const codegen::Graph& graph, const State& s) {
  std::vector<double> x;
  for (const codegen::InputId& input : graph.inputs()) {
    const bool position = input.quantity == codegen::Quantity::kPosition;
    const VectorXd& v = position ? s.q : (input.quantity == codegen::Quantity::kSpeed ? s.qd : s.qdd);
    x.push_back(v[input.row]);
  }
  return x;
}

// Of ErrorAgainstKdl by round-off: some thousand operations in double on either side, the map printed with 14 digits.
inline constexpr double kTolerance = 1e-12;

// Something that claims to know the torque of an arm with these bodies.
using TorqueOf = std::function<VectorXd(const State&, const std::vector<Body>&)>;

// The largest error over random bodies and states, relative to the largest torque; NaN counts as infinite.
inline double ErrorAgainstKdl(const codegen::Robot& robot, const TorqueOf& torque, int states, unsigned seed) {
  std::mt19937_64 random(seed);
  const int n = robot.joints();
  double error = 0, scale = 0;
  std::vector<Body> bodies;
  std::unique_ptr<KdlArm> kdl;
  for (int k = 0; k < states; ++k) {
    if (k % 100 == 0) {
      bodies = RandomBodies(n, random);
      for (const int c : robot.parameters.omit)
        if (c % 11 == 10) bodies[c / 11].rotor = 0;  // the file says that this arm's torque holds no rotor
      kdl = std::make_unique<KdlArm>(robot, StandardParameters(bodies));
    }
    const State s = RandomState(n, random);
    const VectorXd expected = kdl->Torque(s.q, s.qd, s.qdd), found = torque(s, bodies);
    const double worst = (found - expected).cwiseAbs().maxCoeff();
    error = std::isfinite(worst) && found.allFinite() ? std::max(error, worst) : INFINITY;
    scale = std::max(scale, expected.cwiseAbs().maxCoeff());
  }
  return error / scale;
}

// The graph's base regressor and map, evaluated in double.
class GraphArm {
 public:
  explicit GraphArm(const codegen::Robot& robot)
      : n_(robot.joints()),
        rows_(codegen::BodyRegressor(graph_, robot)),
        base_(codegen::FindBaseParameters(graph_, rows_, robot)),
        tape_(graph_, Roots()) {}

  const codegen::Graph& graph() const { return graph_; }
  const codegen::BaseParameters& base() const { return base_; }
  std::vector<codegen::Expr> Roots() const {  // [joint][base column]
    std::vector<codegen::Expr> roots;
    for (const auto& row : rows_)
      for (const int c : base_.column) roots.push_back(row[c]);
    return roots;
  }
  MatrixXd Regressor(const State& s) const { return Shaped(tape_.EvaluateAt<double>(InputValues(graph_, s))); }
  MatrixXd Shaped(const std::vector<double>& values) const {
    const auto columns = static_cast<Eigen::Index>(base_.column.size());
    return Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(values.data(), n_, columns);
  }
  TorqueOf Torque() const {
    return [this](const State& s, const std::vector<Body>& bodies) -> VectorXd {
      return Regressor(s) * (base_.map * StandardParameters(bodies));
    };
  }

 private:
  int n_;
  codegen::Graph graph_;
  codegen::BodyRows rows_;
  codegen::BaseParameters base_;
  codegen::Tape tape_;
};

// Random serial arm: revolute and prismatic joints, half of the angles and lengths exact (quarter turns, zeros).
inline codegen::Robot RandomArm(int n, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  const auto angle = [&] { return u(random) < 0 ? M_PI / 2 * std::round(2 * u(random)) : M_PI * u(random); };
  const auto length = [&] { return u(random) < 0 ? 0.0 : u(random); };
  codegen::Robot robot;
  robot.name = "random";
  robot.gravity_mps2 = {3 * u(random), 3 * u(random), 9 * u(random)};
  for (int j = 0; j < n; ++j) {
    codegen::Joint joint;
    joint.kinematics = {u(random) < 0.4 ? codegen::JointType::kRevolute : codegen::JointType::kPrismatic, angle(),
                        length(), length(), angle()};
    robot.joint.push_back(joint);
  }
  return robot;
}

}  // namespace armcal::tests
