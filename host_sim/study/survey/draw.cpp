// survey - draws of priors and truths; numbers that every platform makes alike.
#include "host_sim/study/survey/draw.hpp"

#include <cmath>
#include <cstdio>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::survey {
namespace {

double Factor(const PriorError& error, plant::Random& random) {
  const double u = random.Uniform(-1, 1);
  return 1 + error.width * (error.kind == PriorError::kWorst ? std::copysign(1.0, u) : u);
}

bool CanExist(const codegen::Link& link) {
  Eigen::VectorXd centre(10), body = Eigen::VectorXd::Zero(11);
  centre[0] = link.mass_kg;
  for (int k = 0; k < 3; ++k) centre[1 + k] = link.center_m[k];
  for (int k = 0; k < 6; ++k) centre[4 + k] = link.inertia_kgm2[k];
  body.head(10) = calibration::ToOrigin(centre);
  return calibration::IsPhysical(body);
}

codegen::Link DrawLink(const codegen::Link& truth, const PriorError& error, plant::Random& random) {
  codegen::Link link = truth;
  link.mass_kg *= Factor(error, random);
  for (double& c : link.center_m) c *= Factor(error, random);
  for (double& I : link.inertia_kgm2) I *= Factor(error, random);
  return link;
}

}  // namespace

std::string PriorName(const PriorError& error) {
  char text[40];
  std::snprintf(text, sizeof text, "%s +-%.0f %%", error.kind == PriorError::kWorst ? "worst case" : "uniform",
                100 * error.width);
  return text;
}

double RelativeDeviation(const PriorError& error) {
  return error.kind == PriorError::kWorst ? error.width : error.width / std::sqrt(3.0);
}

codegen::Robot DrawPrior(const codegen::Robot& truth, const PriorError& error, std::uint64_t seed) {
  constexpr int kTries = 10000;
  plant::Random random(seed);
  codegen::Robot robot = truth;
  for (codegen::Joint& joint : robot.joint) {
    const codegen::Link link = joint.link;
    int tries = 0;
    do {
      if (++tries > kTries)
        throw io::InputError(robot.path + ": link of " + joint.name + ": expected a body that can exist");
      joint.link = DrawLink(link, error, random);
    } while (!CanExist(joint.link));
    for (auto& [name, value] : joint.nominal) value *= Factor(error, random);
  }
  for (codegen::EffectUse& use : robot.effect) {
    for (auto& [name, value] : use.mean) value *= Factor(error, random);
    for (auto& [name, value] : use.nonlinear) value *= Factor(error, random);
  }
  robot.link_relative_sd = robot.friction_relative_sd = RelativeDeviation(error);
  robot.center_floor_m = robot.inertia_floor_ratio = 0;
  return robot;
}

Stribeck DrawStribeck(int joints, std::uint64_t seed) {
  plant::Random random(seed);
  Stribeck s = SetStribeck(joints);
  for (int j = 0; j < joints; ++j) {
    s.fs_over_fc[j] = random.Uniform(1.1, 1.5);
    s.qs_radps[j] = std::exp(random.Uniform(std::log(0.05), std::log(0.2)));
  }
  return s;
}

Stribeck BelievedStribeck(int joints) {
  Stribeck s = SetStribeck(joints);
  s.fs_over_fc.setConstant(1.25);
  return s;
}

}  // namespace armcal::survey
