// generator - the parts of the rigid torque as roots of one tape, so that what they share is computed once.
#include "codegen/src/generator/arm_torque.hpp"

#include "codegen/src/generator/dynamics.hpp"

namespace armcal::codegen {

ArmTorque::ArmTorque(const Model& model) : joints_(model.joints()) {
  const Robot& robot = model.robot();
  std::vector<Expr> roots;
  const auto add = [&](const BodyRows& rows) {
    for (int i = 0; i < joints_; ++i) roots.push_back(BaseTorque(graph_, rows, model.base_columns(), i));
  };
  add(BodyRegressor(graph_, robot));
  add(BodyRegressor(graph_, robot, false));
  for (int j = 0; j < joints_; ++j) add(AccelerationRows(graph_, robot, j));
  for (int axis = 0; axis < 3; ++axis) {
    Robot tilted = robot;
    tilted.gravity_mps2 = {};
    tilted.gravity_mps2[axis] = 1;
    add(BodyRegressor(graph_, tilted, false));
  }
  tape_ = std::make_unique<Tape>(graph_, roots);
}

TorqueParts ArmTorque::Evaluate(const Signals& s, std::span<const double> base) const {
  const int n = joints_, samples = s.samples();
  std::vector<Binding> bindings;
  for (const std::string& input : graph_.inputs()) {
    const auto digits = input.find_first_of("0123456789");
    const std::string quantity = input.substr(0, digits);
    const int number = std::stoi(input.substr(digits));
    Binding b;
    if (quantity == "base") b.value = base[static_cast<std::size_t>(number)];
    else b.column = (quantity == "q" ? s.q : quantity == "qd" ? s.qd : s.qdd).col(number - 1).data();
    bindings.push_back(b);
  }
  TorqueParts out;
  out.rigid.resize(samples, n), out.gravity.resize(samples, n);
  out.mass.assign(n, std::vector<Eigen::VectorXd>(n, Eigen::VectorXd(samples)));
  out.tilt.assign(n, std::vector<Eigen::VectorXd>(3, Eigen::VectorXd(samples)));
  std::vector<double*> target;
  for (int i = 0; i < n; ++i) target.push_back(out.rigid.col(i).data());
  for (int i = 0; i < n; ++i) target.push_back(out.gravity.col(i).data());
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) target.push_back(out.mass[i][j].data());
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < n; ++i) target.push_back(out.tilt[i][axis].data());
  tape_->Evaluate(bindings, samples, target);
  return out;
}

}  // namespace armcal::codegen
