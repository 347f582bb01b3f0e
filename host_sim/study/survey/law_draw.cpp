// survey - the range of each law's parameters, for the plant and for the model.
#include "host_sim/study/survey/law_draw.hpp"

#include <cmath>

#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/study/survey/plant_run.hpp"

namespace armcal::survey {

using Eigen::VectorXd;

namespace {

constexpr double kSeconds = 40;  // of each log

double LogUniform(plant::Random& random, double low, double high) {
  return low * std::pow(high / low, random.Uniform(0, 1));
}

struct OneLaw {
  std::string kind;  // of the plant; empty: nothing beside Coulomb and viscous friction
  toml::table keys;
  std::map<std::string, double> value;  // parameter of the record -> truth
};

// Fc, Fv: of the joint.
OneLaw DrawOne(const std::string& record, double Fc, double Fv, plant::Random& random) {
  const double share = random.Uniform(0, 1);
  if (record == "stribeck") {
    const double excess = (0.2 + 0.5 * share) * Fc, speed = LogUniform(random, 0.05, 0.2);
    return {"stribeck",
            toml::table{{"excess_Nm", excess}, {"speed_radps", speed}, {"exponent", 2.0}},
            {{"dFs", excess}, {"vs", speed}}};
  }
  if (record == "friction_exponential") {
    const double excess = (0.3 + 0.4 * share) * Fc, falls = LogUniform(random, 0.05, 0.15),
                 late = -random.Uniform(0.2, 0.6) * Fc, comes = LogUniform(random, 0.125, 0.5);
    return {"friction_exponential",
            toml::table{{"excess_Nm", excess}, {"falls_radps", falls}, {"late_Nm", late}, {"comes_radps", comes}},
            {{"f1", Fc}, {"f2", -excess}, {"f3", falls}, {"f4", -late}, {"f5", 1 / comes}, {"Fv", Fv}}};
  }
  if (record == "friction_sech_tanh") {
    const double excess = (0.3 + 0.4 * share) * Fc, falls = LogUniform(random, 0.05, 0.2),
                 rises = LogUniform(random, 1.0 / 150, 1.0 / 60);
    return {"friction_sech_tanh",
            toml::table{{"excess_Nm", excess}, {"falls_radps", falls}, {"rises_radps", rises}},
            {{"f1", Fc}, {"f2", excess}, {"f3", 1 / falls}, {"f4", 1 / rises}, {"Fv", Fv}}};
  }
  if (record == "viscous_cuberoot") {
    const double drag = (0.3 + 0.7 * share) * Fc;
    return {"viscous_cuberoot", toml::table{{"drag_at_1radps_Nm", drag}}, {{"f1", drag}}};
  }
  if (record == "viscous_quadratic") {
    const double drag = (0.05 + 0.1 * share) * Fc;
    return {"viscous_cubic", toml::table{{"drag_at_1radps_Nm", drag}, {"exponent", 2.0}}, {{"Fv2", drag}}};
  }
  if (record == "load_friction") {
    const double mu = 0.03 + 0.07 * share;
    return {"load_friction", toml::table{{"mu", mu}}, {{"mu", mu}}};
  }
  return {};
}

}  // namespace

LawDraw DrawLaws(const Settings& settings, const Motions& motions, std::uint64_t seed) {
  plant::Random random(seed);
  const std::vector<choice::FrictionLaw> laws = choice::FrictionLaws(settings.records);
  LawDraw draw;
  PlantSettings plant;
  for (int j = 0; j < settings.robot.joints(); ++j) {
    const codegen::Joint& joint = settings.robot.joint[static_cast<std::size_t>(j)];
    draw.law.push_back(laws[static_cast<std::size_t>(random.Uniform(0, static_cast<double>(laws.size())))]);
    const std::string& record = draw.law.back().name;
    const OneLaw one = DrawOne(record, joint.nominal.at("Fc"), joint.nominal.at("Fv"), random);
    for (const auto& [name, value] : one.value) draw.value[record + "." + name + std::to_string(j + 1)] = value;
    if (!one.kind.empty())
      plant.effects.push_back({one.kind, j, plant::ReadJointEffect(one.kind, io::TomlReader(one.keys, "draw")), 0});
  }
  plant.friction = plant.torque_constant = 0;
  plant.truth_seed = seed, plant.noise_seed = 2 * seed, plant.seconds = kSeconds;
  draw.train = RunPlant(settings.robot, motions.nonlinear.series, plant);
  ++plant.noise_seed;
  draw.test = RunPlant(settings.robot, motions.other, plant);
  return draw;
}

codegen::Model LawModel(const Settings& settings, const LawDraw& draw) {
  return codegen::Model(choice::WithLaws(settings.robot, draw.law), settings.records);
}

VectorXd LawTruth(const codegen::Model& model, const LawDraw& draw) {
  VectorXd z = SetParameters(model);
  for (const auto& [name, value] : draw.value) z[PlaceOf(model, name)] = value;
  return z;
}

VectorXd SampleNoise(const codegen::Robot& robot) {
  VectorXd sigma(robot.joints());
  for (int j = 0; j < sigma.size(); ++j) {
    const codegen::Joint& joint = robot.joint[static_cast<std::size_t>(j)];
    const double step = joint.motor.current_A_per_lsb * joint.motor.gear_ratio * joint.motor.torque_constant_NmpA;
    sigma[j] = std::sqrt((joint.torque_noise_Nm * joint.torque_noise_Nm + step * step / 12) / robot.sample_ticks);
  }
  return sigma;
}

}  // namespace armcal::survey
