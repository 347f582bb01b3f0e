// generator - the parts of the rigid torque as roots of one tape, so that what they share is computed once.
#include "codegen/src/generator/arm_torque.hpp"

#include "codegen/src/generator/dynamics.hpp"

namespace armcal::codegen {

ArmTorque::ArmTorque(const Model& model) : joints_(model.joints()) {
  const Robot& robot = model.robot();
  const auto add = [&](const BodyRows& rows, const auto& name) {
    for (int i = 0; i < joints_; ++i) part_.push_back({name(i), BaseTorque(graph_, rows, model.base_columns(), i)});
  };
  add(BodyRegressor(graph_, robot), [](int i) { return InputName("tau_rigid", i); });
  add(BodyRegressor(graph_, robot, false), [](int i) { return InputName("tau_gravity", i); });
  for (int j = 0; j < joints_; ++j)
    add(AccelerationRows(graph_, robot, j), [j](int i) { return EntryName("M", i, j); });
  for (int axis = 0; axis < 3; ++axis) {
    Robot tilted = robot;
    tilted.gravity_mps2 = {};
    tilted.gravity_mps2[axis] = 1;
    add(BodyRegressor(graph_, tilted, false), [axis](int i) { return EntryName("G", i, axis); });
  }
}

std::set<std::string> ArmTorque::names() const {
  std::set<std::string> out;
  for (const Part& p : part_) out.insert(p.name);
  return out;
}

void ArmTorque::Evaluate(const Signals& s, std::span<const double> base, const std::set<std::string>& wanted,
                         TorqueParts& out) const {
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
  out.rigid.resize(samples, n), out.gravity.resize(samples, n);
  out.mass.resize(n, std::vector<Eigen::VectorXd>(n)), out.tilt.resize(n, std::vector<Eigen::VectorXd>(3));
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
  std::vector<Expr> roots;
  std::vector<double*> target;
  for (std::size_t k = 0; k < part_.size(); ++k)
    if (wanted.contains(part_[k].name)) roots.push_back(part_[k].value), target.push_back(place[k]);
  Tape(graph_, roots).Evaluate(bindings, samples, target);
}

}  // namespace armcal::codegen
