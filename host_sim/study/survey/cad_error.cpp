// survey - draws CAD values around a truth.
#include "host_sim/study/survey/cad_error.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::survey {

using Eigen::VectorXd;

namespace {

constexpr double kCenter_m = 0.01, kProductOfTrace = 0.05, kOddLink = 0.5;
constexpr int kDraws = 10000;

double TraceOf(const codegen::Link& link) { return link.inertia_kgm2[0] + link.inertia_kgm2[3] + link.inertia_kgm2[5]; }

VectorXd BodyOf(const codegen::Link& link) {
  VectorXd centre(10), body = VectorXd::Zero(11);
  centre[0] = link.mass_kg;
  std::copy(link.center_m.begin(), link.center_m.end(), centre.data() + 1);
  std::copy(link.inertia_kgm2.begin(), link.inertia_kgm2.end(), centre.data() + 4);
  body.head(10) = calibration::ToOrigin(centre);
  return body;
}

class Drawer {
 public:
  Drawer(const CadError& error, std::uint64_t seed, int joints)
      : error_(error), random_(seed), odd_(static_cast<int>(random_.Uniform(0, joints))) {}

  codegen::Link Link(const codegen::Link& truth, int joint) {
    codegen::Link link = truth;
    link.mass_kg *= Factor(joint);
    for (double& c : link.center_m) c *= Factor(joint);
    for (double& I : link.inertia_kgm2) I *= Factor(joint);
    if (!error_.has_absolute()) return link;
    for (double& c : link.center_m) c += random_.Uniform(-kCenter_m, kCenter_m);
    for (const std::size_t product : {1U, 2U, 4U})
      link.inertia_kgm2[product] += TraceOf(truth) * random_.Uniform(-kProductOfTrace, kProductOfTrace);
    return link;
  }
  double Factor(int joint) {
    const double u = random_.Uniform(-1, 1), sign = std::copysign(1.0, u);
    switch (error_.kind) {
      case CadError::Kind::kWorst:
        return 1 + error_.width * sign;
      case CadError::Kind::kOneLink:
        return 1 + (joint == odd_ ? kOddLink * sign : error_.width * u);
      default:
        return 1 + error_.width * u;
    }
  }

 private:
  CadError error_;
  plant::Random random_;
  int odd_;
};

}  // namespace

std::string CadErrorName(const CadError& error) {
  constexpr const char* kName[] = {"worst case", "uniform", "added", "one link by half, the others",
                                   "added and uniform"};
  const std::string name = kName[static_cast<int>(error.kind)];
  if (error.width == 0) return name;
  char text[40];
  std::snprintf(text, sizeof text, " +-%.0f %%", 100 * error.width);
  return name + text;
}

codegen::Robot DrawCad(const codegen::Robot& truth, const CadError& error, std::uint64_t seed) {
  codegen::Robot cad = truth;
  Drawer drawer(error, seed, truth.joints());
  for (int j = 0; j < truth.joints(); ++j) {
    codegen::Joint& joint = cad.joint[static_cast<std::size_t>(j)];
    const codegen::Link link = joint.link;
    int tries = 0;
    do {
      if (++tries > kDraws)
        throw io::InputError(truth.path + ": link of " + joint.name + ": expected a body that can exist");
      joint.link = drawer.Link(link, j);
    } while (!calibration::IsPhysical(BodyOf(joint.link)));
    joint.motor.rotor_inertia_kgm2 *= drawer.Factor(j);
  }
  return cad;
}

VectorXd BodiesOf(const codegen::Robot& robot) {
  VectorXd bodies(11 * robot.joints());
  for (int j = 0; j < robot.joints(); ++j)
    bodies.segment(11 * j, 11) = BodyOf(robot.joint[static_cast<std::size_t>(j)].link);
  return bodies;
}

double ScaledBodyError(const codegen::Robot& truth, const VectorXd& bodies) {
  double sum = 0;
  for (int j = 0; j < truth.joints(); ++j) {
    const codegen::Link& link = truth.joint[static_cast<std::size_t>(j)].link;
    const double trace = TraceOf(link);
    double length = std::sqrt(trace / 2 / link.mass_kg);
    if (j + 1 < truth.joints()) {
      const codegen::JointKinematics& next = truth.joint[static_cast<std::size_t>(j) + 1].kinematics;
      length = std::max(length, std::hypot(next.a_m, next.d_m));
    }
    VectorXd scale(10);
    scale << link.mass_kg, VectorXd::Constant(3, length), VectorXd::Constant(6, trace);
    const VectorXd found = calibration::ToCentre(bodies.segment(11 * j, 10)),
                   set = calibration::ToCentre(BodyOf(link).head(10));
    sum += (found - set).cwiseAbs().cwiseQuotient(scale).mean();
  }
  return sum / truth.joints();
}

}  // namespace armcal::survey
