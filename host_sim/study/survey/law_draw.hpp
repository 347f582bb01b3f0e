// survey - draws a friction law for each joint, and lets the plant move with these laws.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host_sim/identify/choice/friction_laws.hpp"
#include "host_sim/study/survey/draws.hpp"

namespace armcal::survey {

// The plant's own form of a law is written by hand (host_sim/machine/plant/friction_effects.cpp).
struct LawDraw {
  std::vector<choice::FrictionLaw> law;  // of each joint
  // Value of each parameter of the laws, by its name in the model.
  std::map<std::string, double> value;
  logs::Log train, test;
};

// Each joint gets one of the laws of `armcal choose`, with parameters drawn. The bodies, Coulomb and viscous friction
// are the file's. Train: 40 s along the trajectory for (4); test: 40 s along the one for validation.
LawDraw DrawLaws(const Settings& settings, const Motions& motions, std::uint64_t seed);

// The model with the true laws, and the true parameters in it.
codegen::Model LawModel(const Settings& settings, const LawDraw& draw);
Eigen::VectorXd LawTruth(const codegen::Model& model, const LawDraw& draw);

// Standard deviation of a sample's torque: noise and steps of the current readings that it averages.
Eigen::VectorXd SampleNoise(const codegen::Robot& robot);

}  // namespace armcal::survey
