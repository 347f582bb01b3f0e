// generator - evaluates the parts of the rigid torque together, so that common terms are computed once.
#include "codegen/src/generator/arm_torque.hpp"

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/generator/dynamics.hpp"

namespace armcal::codegen {

ArmTorque::ArmTorque(const Model& model) : joints_(model.joints()) {
  const Robot& robot = model.robot();
  const auto keep = [&](const InputId& id, Expr value) { part_.push_back({id, value}); };
  const auto add = [&](const BodyRows& rows, const auto& id) {
    for (int i = 0; i < joints_; ++i) keep(id(i), BaseTorque(graph_, rows, model.base_columns(), i));
  };
  const BodyRows moving = BodyRegressor(graph_, robot);
  for (int i = 0; i < joints_; ++i)
    keep({Quantity::kRigidTorque, i}, LoadTorque(graph_, moving, model.base_columns(), model.rotors(), i));
  add(BodyRegressor(graph_, robot, false), [](int i) { return InputId{Quantity::kGravityTorque, i}; });
  for (int j = 0; j < joints_; ++j) {
    const BodyRows rows = AccelerationRows(graph_, robot, j);
    for (int i = 0; i < joints_; ++i)
      keep({Quantity::kMassMatrix, i, j}, LoadTorque(graph_, rows, model.base_columns(), model.rotors(), i));
  }
  for (int axis = 0; axis < 3; ++axis) {
    Robot tilted = robot;
    tilted.gravity_mps2 = {};
    tilted.gravity_mps2[axis] = 1;
    add(BodyRegressor(graph_, tilted, false), [axis](int i) { return InputId{Quantity::kGravitySlope, i, 0, axis}; });
  }
  const int rigid = 0, gravity = joints_;  // where their rows begin
  const auto keep_slopes = [&](Quantity slope, int first, Quantity over) {
    for (int j = 0; j < joints_; ++j)
      for (int i = 0; i < joints_; ++i) {
        const Expr torque = part_[static_cast<std::size_t>(first + i)].value;
        keep({slope, i, j}, Derivative(torque, graph_.Input({over, j})));
      }
  };
  keep_slopes(Quantity::kGravityStiffness, gravity, Quantity::kPosition);
  keep_slopes(Quantity::kTorqueSlope, rigid, Quantity::kPosition);
  keep_slopes(Quantity::kTorqueSpeedSlope, rigid, Quantity::kSpeed);
  const Flange flange = FlangeOf(graph_, robot);
  const auto with_slopes = [&](const std::array<Expr, 3>& v, Quantity itself, Quantity slope) {
    for (int axis = 0; axis < 3; ++axis) {
      keep({itself, 0, 0, axis}, v[axis]);
      for (int i = 0; i < joints_; ++i)
        keep({slope, i, 0, axis}, Derivative(v[axis], graph_.Input({Quantity::kPosition, i})));
    }
  };
  with_slopes(flange.position, Quantity::kFlangePosition, Quantity::kFlangeJacobian);
  with_slopes(flange.approach, Quantity::kApproach, Quantity::kApproachSlope);
}

std::set<InputId> ArmTorque::parts() const {
  std::set<InputId> out;
  for (const Part& p : part_) out.insert(p.id);
  return out;
}

void ArmTorque::Evaluate(const Signals& s, std::span<const double> base, const std::set<InputId>& wanted,
                         TorqueParts& out) const {
  const int n = joints_, samples = s.samples();
  std::vector<Binding> bindings;
  for (const InputId& input : graph_.inputs()) {
    Binding b;
    if (input.quantity == Quantity::kBaseParameter) b.value = base[static_cast<std::size_t>(input.parameter)];
    else if (input.quantity == Quantity::kPosition) b.column = s.q.col(input.row).data();
    else b.column = (input.quantity == Quantity::kSpeed ? s.qd : s.qdd).col(input.row).data();
    bindings.push_back(b);
  }
  out.rigid.resize(samples, n), out.gravity.resize(samples, n);
  out.mass.resize(n, std::vector<Eigen::VectorXd>(n)), out.tilt.resize(n, std::vector<Eigen::VectorXd>(3));
  for (auto* matrix : {&out.stiffness, &out.slope, &out.speed_slope})
    matrix->resize(n, std::vector<Eigen::VectorXd>(n));
  out.flange.resize(3), out.jacobian.resize(n, std::vector<Eigen::VectorXd>(3));
  out.approach.resize(3), out.approach_slope.resize(n, std::vector<Eigen::VectorXd>(3));
  std::vector<double*> place;
  for (int i = 0; i < n; ++i) place.push_back(out.rigid.col(i).data());
  for (int i = 0; i < n; ++i) place.push_back(out.gravity.col(i).data());
  const auto entry = [&](Eigen::VectorXd& v) {
    v.resize(samples);
    place.push_back(v.data());
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) entry(out.mass[i][j]);
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < n; ++i) entry(out.tilt[i][axis]);
  for (auto* slope : {&out.stiffness, &out.slope, &out.speed_slope})
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) entry((*slope)[i][j]);
  for (const auto& [itself, slope] :
       {std::pair{&out.flange, &out.jacobian}, std::pair{&out.approach, &out.approach_slope}})
    for (int axis = 0; axis < 3; ++axis) {
      entry((*itself)[axis]);
      for (int i = 0; i < n; ++i) entry((*slope)[i][axis]);
    }
  std::vector<Expr> roots;
  std::vector<double*> target;
  for (std::size_t k = 0; k < part_.size(); ++k)
    if (wanted.contains(part_[k].id)) roots.push_back(part_[k].value), target.push_back(place[k]);
  Tape(graph_, roots).Evaluate(bindings, samples, target);
}

}  // namespace armcal::codegen
