// description - collects the parameters of an arm by their meaning.
#include "host_sim/identify/description/described_arm.hpp"

#include <fmt/format.h>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/body.hpp"

namespace armcal::description {

namespace {

codegen::Link LinkOf(const Eigen::VectorXd& origin) {
  const Eigen::VectorXd c = calibration::ToCentre(origin);
  return {c[0], {c[1], c[2], c[3]}, {c[4], c[5], c[6], c[7], c[8], c[9]}};
}

// The joint whose friction the column is, or -1. A law that takes the declared one's place counts by its keys.
int FrictionOf(const codegen::Model& model, const std::string& name, std::string& key) {
  for (const codegen::EffectInstance& e : model.effects()) {
    if (!e.record->friction_law && e.record->replaces.empty()) continue;
    for (const codegen::EffectColumn& column : e.columns)
      if (column.name == name && (column.key == "Fc" || column.key == "Fv")) return key = column.key, e.joints.front();
  }
  return -1;
}

}  // namespace

DescribedArm Describe(const codegen::Model& model, const calibration::Given& given, const std::string& source) {
  if (given.bodies.size() == 0)
    throw io::InputError(source +
                         ": base parameters only, expected bodies: identify with link data in the robot file "
                         "(no prior = \"none\")");
  DescribedArm arm;
  arm.robot = model.robot();
  arm.source = source;
  arm.schema = codegen::Schema(model);
  for (int j = 0; j < model.joints(); ++j) {
    const Eigen::VectorXd block = given.bodies.segment(codegen::kBodyBlock * j, codegen::kBodyBlock);
    DescribedJoint joint;
    joint.body = LinkOf(block);
    joint.rotor_kgm2 = block[10];
    joint.torque_scale = 1 / (1 + given.x[model.columns() + j]);
    const codegen::Body body{joint.body.mass_kg, Eigen::Vector3d::Zero(), codegen::Symmetric(joint.body.inertia_kgm2)};
    if (const std::string missing = codegen::Impossible(body); !missing.empty())
      throw io::InputError(fmt::format("{}: joint {}: expected to move a body with {}", source,
                                       model.robot().joint[static_cast<std::size_t>(j)].name, missing));
    arm.joint.push_back(joint);
  }
  for (int c = 0; c < model.columns(); ++c) {
    if (model.is_rigid(c)) continue;
    const codegen::TableParameter& p = model.table()[static_cast<std::size_t>(model.table_index(c))];
    std::string key;
    const int j = FrictionOf(model, p.name, key);
    if (j >= 0) (key == "Fc" ? arm.joint[j].coulomb_Nm : arm.joint[j].viscous_Nmsprad) = given.x[c];
    else if (given.x[c] != 0) arm.effect.push_back({p.name, p.unit, given.x[c]});
  }
  if (!arm.effect.empty())
    for (int k = 0; k < model.nonlinear(); ++k)
      arm.effect.push_back({model.unknowns()[static_cast<std::size_t>(k)].name,
                            model.unknowns()[static_cast<std::size_t>(k)].unit,
                            given.eta[static_cast<std::size_t>(k)]});
  return arm;
}

}  // namespace armcal::description
