// generator - the parameter table of a model: means, prior deviations, states; knows no output format.
#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {
namespace {

const char* const kBodyUnit[] = {"kg",     "kg*m",   "kg*m",   "kg*m",   "kg*m^2", "kg*m^2",
                                 "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2"};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// m, m c, I about the link origin from mass, centre and I about the centre.
std::array<double, 10> AboutOrigin(const Link& l) {
  const auto& c = l.center_m;
  const auto& I = l.inertia_kgm2;
  const double m = l.mass_kg, x = c[0], y = c[1], z = c[2];
  return {m,
          m * x,
          m * y,
          m * z,
          I[0] + m * (y * y + z * z),
          I[1] - m * x * y,
          I[2] - m * x * z,
          I[3] + m * (x * x + z * z),
          I[4] - m * y * z,
          I[5] + m * (x * x + y * y)};
}

// Prior standard deviations of (m, c, I about the centre).
std::array<double, 10> LinkDeviation(const Robot& r, const Link& l) {
  std::array<double, 10> sd{};
  sd[0] = r.link_relative_sd * l.mass_kg;
  for (int k = 0; k < 3; ++k) sd[1 + k] = std::max(r.link_relative_sd * std::abs(l.center_m[k]), r.center_floor_m);
  const double largest = std::max({l.inertia_kgm2[0], l.inertia_kgm2[3], l.inertia_kgm2[5]});
  for (int k = 0; k < 6; ++k)
    sd[4 + k] = std::max(r.link_relative_sd * std::abs(l.inertia_kgm2[k]), r.inertia_floor_ratio * largest);
  return sd;
}

}  // namespace

void Model::MakeTable() {
  for (int j = 0; j < joints(); ++j) {
    const Joint& joint = robot_.joint[j];
    const std::string number = std::to_string(j + 1);
    // Without a prior every link starts as a small ball: physical, and so wide that it says nothing.
    const Link& link = robot_.has_prior ? joint.link : Link{1, {}, {0.01, 0, 0, 0.01, 0, 0.01}};
    const auto mean = AboutOrigin(link);
    const auto sd = robot_.has_prior ? LinkDeviation(robot_, link)
                                     : std::array<double, 10>{1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3};
    for (int p = 0; p < 10; ++p)
      table_.push_back({kBodyParameterName[p] + number, kBodyUnit[p], mean[p], sd[p], p == 0 ? 0 : -kInfinity,
                        kInfinity, 0, "estimated", 0, j, ""});
    const double rotor = joint.motor.gear_ratio * joint.motor.gear_ratio * joint.motor.rotor_inertia_kgm2;
    table_.push_back({"Ia" + number, "kg*m^2", rotor, robot_.has_prior ? robot_.link_relative_sd * rotor : 1e3, 0,
                      kInfinity, 0, "estimated", 0, j, ""});
  }
  for (std::size_t k = 0; k < effect_column_.size(); ++k) {
    const EffectColumn& c = effect_column(static_cast<int>(k));
    const EffectInstance& e = effect_[effect_column_[k].effect];
    const EffectUse& use = use_[effect_column_[k].effect];
    const int joint = static_cast<int>(k) < front_ ? column_joint_[k] : -1;
    // A record that takes the friction law's place is one, and starts from the same nominal values.
    const bool friction = e.record->friction_law || !e.record->replaces.empty();
    TableParameter p{c.name, c.unit,    c.amplitude,      c.sd,  c.lower,       c.upper,
                     0,      use.state, friction ? 1 : 2, joint, e.record->name};
    if (friction && joint >= 0) {
      const auto it = robot_.joint[joint].nominal.find(c.key);
      if (it != robot_.joint[joint].nominal.end() && it->second > 0)
        p.mean = it->second, p.sd = robot_.friction_relative_sd * it->second;
    }
    if (const auto it = use.mean.find(c.key); it != use.mean.end()) p.mean = it->second;
    if (c.fixed_amplitude) p.state = "fixed";
    if (use.state == "standby") p.mean = 0;
    p.process_noise = c.process_noise * c.sd * c.sd * robot_.sample_ticks / robot_.tick_rate_Hz;
    table_.push_back(p);
  }
  for (std::size_t e = 0; e < effect_.size(); ++e)
    for (const EffectUnknown& u : effect_[e].unknowns) {
      const auto it = use_[e].nonlinear.find(u.key);
      const double mean = it != use_[e].nonlinear.end() ? it->second : u.initial;
      table_.push_back({u.name, u.unit, mean, 0, u.lower, u.upper, 0, "fixed", 2,
                        effect_[e].joints.empty() ? -1 : effect_[e].joints[0], effect_[e].record->name});
    }
}

std::string Model::column_name(int column) const {
  if (!is_rigid(column)) return table_[table_index(column)].name;
  const int p = base_.column[column - front_];
  const auto& map = base_.map.row(column - front_);
  const bool merged = (map.array() != 0).count() > 1;
  return kBodyParameterName[p % kBodyBlock] + std::to_string(p / kBodyBlock + 1) + (merged ? "R" : "");  // R: regrouped
}

std::string Model::column_unit(int column) const {
  return is_rigid(column) ? kBodyUnit[base_.column[column - front_] % kBodyBlock] : table_[table_index(column)].unit;
}

}  // namespace armcal::codegen
