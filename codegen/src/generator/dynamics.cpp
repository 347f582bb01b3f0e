// generator - makes M, V and G from the body rows at chosen speeds and accelerations.
#include "codegen/src/generator/dynamics.hpp"

#include "codegen/src/generator/arm_vectors.hpp"
#include "codegen/src/generator/derivative.hpp"

namespace armcal::codegen {
namespace {

// The rows with one quantity of every joint at zero, of joint `unit` at one (-1: of none).
BodyRows At(Graph& g, BodyRows rows, Quantity quantity, int unit) {
  std::unordered_map<int, Expr> at;
  for (int j = 0; j < static_cast<int>(rows.size()); ++j)
    at.emplace(g.Input({quantity, j}).id(), g.Constant(j == unit));
  for (auto& row : rows)
    for (Expr& e : row) e = Substitute(e, at);
  return rows;
}

Robot Weightless(Robot robot) {
  robot.gravity_mps2 = {};
  return robot;
}

Expr BaseValue(Graph& g, int d) { return g.Input({.quantity = Quantity::kBaseParameter, .parameter = d}); }

}  // namespace

Expr BaseTorque(Graph& g, const BodyRows& rows, const std::vector<int>& base_columns, int i) {
  Expr sum = g.Constant(0);
  for (std::size_t d = 0; d < base_columns.size(); ++d)
    sum = sum + rows[i][base_columns[d]] * BaseValue(g, static_cast<int>(d));
  return sum;
}

Expr LoadTorque(Graph& g, const BodyRows& rows, const std::vector<int>& base_columns,
                const std::vector<RotorInertia>& rotors, int i) {
  Expr sum = BaseTorque(g, rows, base_columns, i);
  for (std::size_t j = 0; j < rotors.size(); ++j) {
    const Expr row = rows[i][kBodyBlock * j + kBodyBlock - 1];
    if (row.IsZero()) continue;
    Expr inertia = g.Constant(rotors[j].rest);
    for (int d = 0; d < rotors[j].share.size(); ++d)
      if (rotors[j].share[d] != 0) inertia = inertia + rotors[j].share[d] * BaseValue(g, d);
    sum = sum - inertia * row;
  }
  return sum;
}

BodyRows AccelerationRows(Graph& g, const Robot& robot, int joint) {
  return At(g, At(g, BodyRegressor(g, Weightless(robot)), Quantity::kSpeed, -1), Quantity::kAcceleration, joint);
}

Flange FlangeOf(Graph& g, const Robot& robot) {
  const ArmVectors arm(g, robot, false, LocalFrames(robot));
  const auto at_base = [&](const Vec& v, int axis) {  // the robot file's base, not the first joint's
    const double* const row = robot.base_rotation.data() + 3 * axis;
    return row[0] * v[0] + row[1] * v[1] + row[2] * v[2] + g.Constant(robot.base_xyz_m[axis]);
  };
  const Vec here = arm.PointOnFlange(0), there = arm.PointOnFlange(1);
  Flange out;
  for (int axis = 0; axis < 3; ++axis)
    out.position[axis] = at_base(here, axis), out.approach[axis] = at_base(there, axis) - out.position[axis];
  return out;
}

Dynamics MakeDynamics(Graph& g, const Robot& robot, const std::vector<int>& base_columns) {
  const int n = robot.joints();
  const BodyRows moving = BodyRegressor(g, Weightless(robot)), resting = BodyRegressor(g, robot, false);
  const BodyRows steady = At(g, moving, Quantity::kAcceleration, -1), still = At(g, moving, Quantity::kSpeed, -1);
  Dynamics out;
  for (int j = 0; j < n; ++j) {
    const BodyRows column = At(g, still, Quantity::kAcceleration, j);
    out.mass.emplace_back();
    for (int i = 0; i <= j; ++i) out.mass[j].push_back(BaseTorque(g, column, base_columns, i));
    out.velocity.push_back(BaseTorque(g, steady, base_columns, j));
    out.gravity.push_back(BaseTorque(g, resting, base_columns, j));
  }
  return out;
}

}  // namespace armcal::codegen
