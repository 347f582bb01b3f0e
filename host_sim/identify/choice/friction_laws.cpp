// choice - makes robot variants in memory that differ in their friction law.
#include "host_sim/identify/choice/friction_laws.hpp"

#include <algorithm>

#include "codegen/src/io/input_error.hpp"

namespace armcal::choice {

namespace {

const char* const kPlain = "coulomb_viscous";

struct Listed {
  const char *record, *equation;
};
constexpr Listed kListed[] = {
    {kPlain, "(3)"},     {"viscous_cuberoot", "(8)"},     {"viscous_quadratic", ""},    {"load_friction", ""},
    {"stribeck", "(4)"}, {"friction_exponential", "(5)"}, {"friction_sech_tanh", "(6)"}};

int Parameters(const codegen::EffectRecord& record) {
  return static_cast<int>(record.linear.size() + record.nonlinear.size());
}

}  // namespace

std::vector<FrictionLaw> FrictionLaws(const codegen::Catalogue& records) {
  std::vector<FrictionLaw> laws;
  for (const Listed& one : kListed) {
    const codegen::EffectRecord& record = records.at(one.record);
    const bool beside = std::string(one.record) != kPlain && record.replaces.empty();
    laws.push_back(
        {one.record, one.equation, record.title, Parameters(record) + (beside ? Parameters(records.at(kPlain)) : 0)});
  }
  std::stable_sort(laws.begin(), laws.end(),
                   [](const FrictionLaw& a, const FrictionLaw& b) { return a.parameters < b.parameters; });
  return laws;
}

codegen::Robot WithLaws(const codegen::Robot& robot, const std::vector<FrictionLaw>& law_of_joint) {
  codegen::Robot out = robot;
  for (const codegen::EffectUse& use : robot.effect)
    for (const Listed& one : kListed)
      if (use.effect == one.record && use.state != "standby")
        throw io::InputError(robot.path + ": effect." + use.effect +
                             ": a friction law, and the laws are what is chosen here; leave it out of the robot file");
  for (std::size_t j = 0; j < law_of_joint.size(); ++j) {
    if (law_of_joint[j].name == kPlain) continue;
    codegen::EffectUse use;
    use.effect = law_of_joint[j].name;
    use.joints = {static_cast<int>(j)};
    out.effect.push_back(use);
  }
  return out;
}

}  // namespace armcal::choice
