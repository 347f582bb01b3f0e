// end-to-end tests - draws the kinds' sizes and places, and sets each size by the plant's own torque along a motion.
#include "tests/e2e/drawn_kinds.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/unit/plant/bench.hpp"

namespace armcal::tests {
namespace {

using plant::Random;

constexpr int kRounds = 4, kSampleTicks = 8;
constexpr double kLook_s = 12, kLookLonger_s = 26;  // along the motion, without and with an event
constexpr double kFirst_s = 14;                     // after switch-on, when an event begins
constexpr double kSpeedLimit[] = {2.97, 2.88, 2.97, 6.28, 6.28, 10.47}, kGear[] = {121, 153, 141, 80, 75, 50},
                 kCoulomb[] = {60, 60, 50, 12, 10, 8};  // of the arm

const std::vector<int> kAny{1, 2, 3, 4, 5, 6}, kLoaded{2, 3}, kBase{1, 2, 3};

using Names = std::vector<std::string>;
const Names kSlow{"stribeck",        "viscous_cuberoot", "friction_exponential", "friction_sech_tanh",
                  "presliding_dahl", "presliding_lugre", "hysteresis",           "unknown"};
const Names kSpeed{"viscous_quadratic", "viscous_cubic"};
const Names kPosition{"position_torque", "cable_pack", "gravity_spring"};
const Names kOffset{"torque_offset", "coulomb_asymmetry"};
const Names kPresliding{"presliding_dahl", "presliding_lugre", "hysteresis", "backlash"};
const Names kElastic{"belt_elasticity", "joint_compliance", "time_delay"};

Names With(Names names, const Names& more) {
  names.insert(names.end(), more.begin(), more.end());
  return names;
}

double PerMotorTurn(Random& r, int joint) { return r.Uniform(15, 80) / kGear[joint - 1]; }

// A share of the joint's speed limit.
double Speed(Random& r, int joint, double least, double most) {
  return r.Uniform(least, most) * kSpeedLimit[joint - 1];
}

int Other(Random& r, int joint) {
  const int other = 1 + static_cast<int>(r.Uniform(0, 4.999));
  return other < joint ? other : other + 1;
}

// What the joint's link weighs on it: the largest inertia of some poses, kg m^2.
double LinkInertia(int joint) {
  static const std::vector<double> all = [] {
    plant::Arm arm(plant::bench::MakeScenario("", "er20_like"), kDrawnArm);
    std::vector<double> inertia(6);
    Eigen::VectorXd q, qd;
    for (int k = 0; k < 50; ++k) {
      plant::bench::Wave::At(0.2 * k, q, qd);
      const Eigen::MatrixXd mass = arm.Mass(q);
      for (int j = 0; j < 6; ++j) {
        const auto& data = arm.robot().joint[static_cast<std::size_t>(j)];
        const double rotor = data.gear_ratio * data.gear_ratio * data.rotor_inertia_kgm2;
        inertia[static_cast<std::size_t>(j)] = std::max(inertia[static_cast<std::size_t>(j)], mass(j, j) - rotor);
      }
    }
    return inertia;
  }();
  return all[static_cast<std::size_t>(joint - 1)];
}

std::string Spring(int joint, double frequency_Hz, double damping) {
  const double w = 2 * std::numbers::pi * frequency_Hz, inertia = LinkInertia(joint);
  return fmt::format("stiffness_Nmprad = {}\ndamping_Nmsprad = {}\n", w * w * inertia, 2 * damping * w * inertia);
}

std::string UnequalDirections(Random&, int, double s) {
  return fmt::format("forward_ratio = {}\nbackward_ratio = {}\n", 1 + 0.1 * s, std::max(0.0, 1 - 0.1 * s));
}

std::vector<DrawnKind> FrictionKinds() {
  return {
      {"coulomb_viscous",
       {},
       kAny,
       [](Random& r, int, double s) {
         return fmt::format("level_Nm = {}\nviscous_Nmsprad = {}\n", s, s * r.Uniform(0, 1));
       }},
      {"stribeck", kSlow, kAny,
       [](Random& r, int j, double s) {
         return fmt::format("excess_Nm = {}\nspeed_radps = {}\n", s, Speed(r, j, 0.04, 0.1));
       }},
      {"stribeck_basis", kSlow, kAny,
       [](Random& r, int j, double s) {
         return fmt::format("excess_Nm = {}\nspeed_radps = {}\n", s, Speed(r, j, 0.05, 0.15));
       }},
      {"friction_exponential", kSlow, kAny,
       [](Random& r, int j, double s) {
         return fmt::format("excess_Nm = {}\nfalls_radps = {}\nlate_Nm = {}\ncomes_radps = {}\n", s,
                            Speed(r, j, 0.03, 0.1), -0.4 * s, Speed(r, j, 0.2, 0.4));
       }},
      {"friction_sech_tanh", kSlow, kAny,
       [](Random& r, int j, double s) {
         return fmt::format("excess_Nm = {}\nrises_radps = {}\nfalls_radps = {}\n", s, Speed(r, j, 0.005, 0.01),
                            Speed(r, j, 0.06, 0.12));
       }},
      {"friction_table", With(kSlow, kSpeed), kAny,
       [](Random& r, int j, double s) {
         const double a = r.Uniform(1.5, 2), b = r.Uniform(0.5, 1), v = kSpeedLimit[j - 1], level = kCoulomb[j - 1];
         return fmt::format("speeds_radps = [0.0, {}, {}, {}, {}]\nlevels_Nm = [{}, {}, {}, {}, {}]\n", 0.03 * v,
                            0.1 * v, 0.3 * v, v, level + 2 * a * s, level + a * s, level + b * s, level + 0.8 * b * s,
                            level + s);
       }},
      {"viscous_cuberoot", With(kSlow, kSpeed), kAny,
       [](Random&, int, double s) { return fmt::format("drag_at_1radps_Nm = {}\n", 2 * s); }},
      {"viscous_quadratic", kSpeed, kAny,
       [](Random&, int, double s) { return fmt::format("drag_at_1radps_Nm = {}\n", s); }},
      {"viscous_cubic", kSpeed, kAny,
       [](Random& r, int, double s) {
         return fmt::format("drag_at_1radps_Nm = {}\nexponent = {}\n", s, r.Uniform(2.5, 3));
       }},
      {"viscous_asymmetry", With({"viscous_asymmetry", "viscous_quadratic"}, kOffset), kAny, UnequalDirections},
      {"coulomb_asymmetry", kOffset, kAny, UnequalDirections},
      {"load_friction",
       {"load_friction", "position_friction"},
       kLoaded,
       [](Random& r, int, double s) { return fmt::format("mu = {}\npreload_Nm = {}\n", 0.02 * s, r.Uniform(0, 40)); }},
      {"temp_coulomb",
       {"temp_coulomb", "temp_viscous", "time_varying_coulomb", "unknown"},
       kAny,
       [](Random&, int, double s) { return fmt::format("softening_K = {}\nreference_degC = 25.0\n", 40 / s); }},
      {"temp_viscous",
       {"temp_viscous", "temp_coulomb", "time_varying_viscous"},
       kAny,
       [](Random&, int, double s) {
         return fmt::format("vogel_b_K = {}\nvogel_degC = -90.0\nreference_degC = 25.0\n", 200 * s);
       }},
      {"time_varying_coulomb",
       {"time_varying_coulomb", "temp_coulomb", "time_varying_viscous"},
       kAny,
       [](Random& r, int, double s) {
         return fmt::format("change = {}\ntime_constant_s = {}\n", 0.2 * s, r.Uniform(10, 30));
       }},
      {"time_varying_viscous",
       {"time_varying_viscous", "temp_viscous", "time_varying_coulomb"},
       kAny,
       [](Random& r, int, double s) {
         return fmt::format("change = {}\nhalf_time_s = {}\n", 0.2 * s, r.Uniform(10, 40));
       }},
      {"meshing_friction",
       {"meshing_friction"},
       kAny,
       [](Random& r, int j, double s) {
         return fmt::format("per_motor_turn = {}\ndepth = {}\nphase_rad = {}\n", PerMotorTurn(r, j),
                            std::min(1.0, 0.1 * s), r.Uniform(0, 6));
       }},
      {"position_friction",
       {"position_friction", "load_friction"},
       kAny,
       [](Random& r, int, double s) {
         return fmt::format("level_Nm = {}\nat_rad = {}\nwidth_rad = {}\n", s, r.Uniform(-0.5, 0.5),
                            r.Uniform(0.2, 0.6));
       }},
      {"position_viscous",
       {"position_viscous", "position_friction"},
       kAny,
       [](Random& r, int, double s) {
         return fmt::format("eccentricity = {}\nat_rad = {}\n", 1 - 1 / (1 + 0.1 * s), r.Uniform(-1, 1));
       }},
      {"presliding_dahl", With(kPresliding, {"stribeck"}), kAny,
       [](Random&, int, double s) { return fmt::format("length_rad = {}\n", 0.002 * s); }},
      {"presliding_lugre", With(kPresliding, {"stribeck"}), kAny,
       [](Random& r, int j, double s) {
         return fmt::format("length_rad = {}\nbreakaway_ratio = {}\nspeed_radps = {}\ndamping_s = 0.002\n", 0.002 * s,
                            r.Uniform(1.2, 1.6), Speed(r, j, 0.04, 0.1));
       }},
      {"hysteresis", kPresliding, kAny,
       [](Random& r, int, double s) {
         const double first = r.Uniform(0.002, 0.01);
         return fmt::format("level_Nm = {}\nlengths_rad = [{}, {}, {}, {}]\n", 2 * s, first, 3 * first, 9 * first,
                            20 * first);
       }},
  };
}

std::vector<DrawnKind> TorqueKinds() {
  return {
      {"torque_offset", kOffset, kAny, [](Random&, int, double s) { return fmt::format("torque_Nm = {}\n", s); }},
      {"torque_ripple",
       {"torque_ripple"},
       kAny,
       [](Random& r, int j, double s) {
         return fmt::format("per_motor_turn = {}\nfirst_Nm = {}\nsecond_Nm = {}\nphase_rad = {}\n", PerMotorTurn(r, j),
                            s, 0.2 * s, r.Uniform(0, 6));
       }},
      {"cable_pack", kPosition, kAny,
       [](Random& r, int, double s) {
         return fmt::format("stiffness_Nmprad = {}\nneutral_rad = {}\nstiffening_rad = {}\n", s, r.Uniform(-0.5, 0.5),
                            r.Uniform(0.8, 2));
       }},
      {"gravity_spring", kPosition, kLoaded,
       [](Random& r, int, double s) {
         return fmt::format("rate_Npm = {}\ncrank_m = {}\nanchor_m = {}\nfree_length_m = {}\ntop_rad = {}\n", 200 * s,
                            r.Uniform(0.2, 0.35), r.Uniform(0.45, 0.8), r.Uniform(0.1, 0.3), r.Uniform(-0.5, 0.5));
       }},
      {"position_torque", With(kPosition, {"unknown"}), kAny,
       [](Random& r, int, double s) {
         return fmt::format("torque_at_1rad_Nm = {}\nfrom_rad = {}\n", 4 * s, r.Uniform(-0.3, 0.3));
       }},
      {"load_linear",
       {},
       kLoaded,
       [](Random& r, int, double) { return fmt::format("share = {}\n", r.Uniform(0.05, 0.15)); },
       false,
       kUnscaled,
       kUnscaled},
      {"rotor_inertia",
       {},
       kAny,
       [](Random&, int j, double s) { return fmt::format("inertia_kgm2 = {}\n", (j > 3 ? 0.02 : 0.5) * s); }},
      {"coupled_friction",
       {"coupled_friction", "wrist_coupling"},
       kAny,
       [](Random& r, int j, double s) {
         return fmt::format("of_joint = {}\nlevel_Nm = {}\nviscous_Nmsprad = {}\n", Other(r, j), s,
                            s * r.Uniform(0, 1));
       }},
      {"wrist_coupling",
       {"wrist_coupling", "coupled_friction"},
       {4, 5, 6},
       [](Random& r, int j, double s) {
         return fmt::format("of_joint = {}\nratio = {}\nlevel_Nm = {}\nviscous_Nmsprad = {}\n", j == 6 ? 5 : j + 1,
                            r.Uniform(0.3, 1.2), s, s * r.Uniform(0.3, 1));
       }},
      {"cross_ripple",
       {"cross_ripple"},
       kAny,
       [](Random& r, int j, double s) {
         const int other = Other(r, j);
         return fmt::format("of_joint = {}\nper_motor_turn = {}\nfirst_Nm = {}\nphase_rad = {}\n", other,
                            PerMotorTurn(r, other), s, r.Uniform(0, 6));
       }},
      {"velocity_product",
       {"velocity_product", "coupled_friction"},
       kAny,
       [](Random& r, int j, double s) { return fmt::format("of_joint = {}\ninertia_kgm2 = {}\n", Other(r, j), s); }},
      {"unknown",
       {"unknown"},
       {1, 4, 5, 6},
       [](Random& r, int, double s) {
         return fmt::format(
             "of_joint = {}\nover = \"load\"\nacts = \"dry\"\nat = [-600.0, 0.0, 600.0]\n"
             "torque_Nm = [{}, 0.0, {}]\n",
             r.Uniform(0, 1) < 0.5 ? 2 : 3, 2 * s, 2 * s);
       }},
  };
}

std::vector<DrawnKind> ArmKinds() {
  return {
      {"belt_elasticity", kElastic, kBase,
       [](Random& r, int j, double) {
         const double frequency_Hz = r.Uniform(5, 9);
         return Spring(j, frequency_Hz, r.Uniform(0.03, 0.1));
       },
       false, kUnscaled, kUnscaled},
      {"joint_compliance", With(kElastic, kPosition), kLoaded,
       [](Random& r, int j, double) { return Spring(j, r.Uniform(8, 14), 0.3); }, false, kUnscaled, kUnscaled},
      {"backlash", With(kPresliding, {"belt_elasticity"}), kBase,
       [](Random& r, int j, double) {
         const double frequency_Hz = r.Uniform(20, 30);
         return Spring(j, frequency_Hz, 0.3) + fmt::format("gap_rad = {}\n", r.Uniform(0.004, 0.015));
       },
       false, kUnscaled, kUnscaled},
      {"base_tilt",
       {"base_tilt"},
       {},
       [](Random& r, int, double s) {
         const double about = r.Uniform(0, 6.28);
         return fmt::format("roll_deg = {}\npitch_deg = {}\n", 0.3 * s * std::cos(about), 0.3 * s * std::sin(about));
       }},
      {"payload_step",
       {"payload_step"},
       {},
       [](Random& r, int, double s) {
         return fmt::format(
             "mass_kg = {}\ncenter_m = [{}, {}, {}]\ninertia_kgm2 = [0.002, 0.0, 0.0, 0.002, 0.0, 0.001]\n"
             "from_s = {}\n",
             0.3 * s, r.Uniform(-0.05, 0.05), r.Uniform(-0.05, 0.05), r.Uniform(0.05, 0.15), kFirst_s + 4);
       },
       true},
      {"flange_hose",
       {"flange_hose"},
       {},
       [](Random& r, int, double s) {
         return fmt::format("anchor_m = [{}, {}, {}]\nrate_Npm = {}\nfree_length_m = {}\nmass_kg = 0.5\n",
                            r.Uniform(-0.5, 0.5), r.Uniform(-0.5, 0.5), r.Uniform(1.5, 2.2), 5 * s,
                            r.Uniform(0.2, 0.6));
       },
       true},
      {"flange_contact",
       {"external_contact", "payload_step"},
       {},
       [](Random& r, int, double s) {
         return fmt::format(
             "at_m = [0.0, 0.0, {}]\nnormal = [0.0, 0.0, 1.0]\nrate_Npm = {}\ndamping_Nspm = {}\n"
             "friction = 0.3\nfrom_s = {}\nfor_s = 3.0\n",
             r.Uniform(0.9, 1.3), 10 * s, s, kFirst_s);
       },
       true},
      {"external_contact",
       {"external_contact", "payload_step"},
       kAny,
       [](Random& r, int, double s) {
         const double about = r.Uniform(0, 6.28);
         return fmt::format(
             "point_m = [0.2, 0.1, 0.1]\nforce_N = [{}, {}, {}]\nfrom_s = {}\nfor_s = {}\nrise_s = 0.2\n",
             20 * s * std::cos(about), 20 * s * std::sin(about), 10 * s, kFirst_s, r.Uniform(1, 3));
       },
       true},
      {"torque_gain_error",
       {},
       kLoaded,
       [](Random& r, int, double) { return fmt::format("error = {}\n", r.Uniform(0.03, 0.15)); },
       false,
       kUnscaled,
       kUnscaled},
      {"torque_drift",
       {"torque_drift", "torque_offset"},
       kAny,
       [](Random& r, int, double s) {
         return fmt::format("torque_Nm = {}\ntime_constant_s = {}\nswing_Nm = {}\nswing_s = {}\n", s, r.Uniform(10, 30),
                            0.5 * s, r.Uniform(15, 40));
       }},
      {"current_ripple",
       {"torque_ripple"},
       kAny,
       [](Random& r, int j, double s) {
         return fmt::format("pole_pairs = {}\nzero_Nm = {}\nscale_error = 0.01\n", r.Uniform(0.3, 1), (j > 0) * s);
       }},
      {"torque_saturation",
       {"torque_saturation", "torque_gain_error", "load_friction"},
       kLoaded,
       [](Random&, int j, double s) { return fmt::format("limit_Nm = {}\n", (j == 2 ? 1500 : 500) / (1 + 0.2 * s)); }},
      {"time_delay",
       {"time_delay", "belt_elasticity"},
       {},
       [](Random&, int, double s) { return fmt::format("late_s = {}\n", 0.002 * s); },
       true,
       1.5,
       3},
      {"torque_filter",
       {"time_delay", "belt_elasticity"},
       {},
       [](Random&, int, double s) { return fmt::format("lag_s = {}\nstages = 1\n", 0.002 * s); },
       true},
  };
}

std::string ScenarioText(const DrawnKind& kind, int joint, std::uint64_t seed, double strength) {
  Random random(1000 + seed);
  // A table takes the place of the Coulomb level; where that is as declared, the size is that of the curve.
  const std::string truth = kind.kind == "friction_table" ? "[truth]\nfriction_spread = 0.0\n" : "";
  const std::string at = joint > 0 ? fmt::format("joint = {}\n", joint) : "";
  return fmt::format(
      "title = \"{0}\"\nrobot = \"er20_like\"\ntruth_seed = {1}\nnoise_seed = {1}\ncommand = \"ramp\"\n"
      "{4}[thermal]\nrise_KpW = [0.05, 0.05, 0.06, 0.3, 0.8, 0.4]\ntime_constant_s = 25.0\n"
      "[[effect]]\nkind = \"{0}\"\n{2}{3}",
      kind.kind, seed, at, kind.keys(random, joint, strength), truth);
}

// RMS over the ticks of the motion in which the effect is there.
double SizeOf(const std::string& text, const trajectory::TrajectorySpline& motion) {
  plant::Arm arm(plant::ReadScenario(plant::bench::WriteText("drawn.toml", text)), kDrawnArm);
  const Eigen::VectorXd start = motion.Position(0);
  arm.Place({start.data(), 6});
  plant::bench::PdLoop loop(arm, {60000, 80000, 40000, 4000, 3000, 1500}, {1500, 2000, 1000, 60, 45, 20});
  const bool event = text.find("from_s") != std::string::npos;
  Eigen::VectorXd square = Eigen::VectorXd::Zero(6);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(6);
  int there = 0, summed = 0;
  while (arm.time_s() < (event ? kLookLonger_s : kLook_s)) {
    loop.Tick(motion.Position(arm.time_s()), motion.Speed(arm.time_s()));
    const Eigen::VectorXd torque = arm.undeclared_torque_Nm();
    if (event && torque.cwiseAbs().maxCoeff() < 1e-9) continue;
    sum += torque;
    if (++summed % kSampleTicks != 0) continue;
    square += (sum / kSampleTicks).cwiseAbs2(), ++there;
    sum.setZero();
  }
  double most = 0;
  for (int j = 0; j < 6; ++j) {
    const double noise = arm.robot().joint[static_cast<std::size_t>(j)].torque_noise_Nm / std::sqrt(8.0);
    most = std::max(most, std::sqrt(square[j] / std::max(1, there)) / noise);
  }
  return most;
}

}  // namespace

const std::vector<DrawnKind>& DrawnKinds() {
  static const std::vector<DrawnKind> kinds = [] {
    std::vector<DrawnKind> all = FrictionKinds();
    for (const auto& more : {TorqueKinds(), ArmKinds()}) all.insert(all.end(), more.begin(), more.end());
    return all;
  }();
  return kinds;
}

DrawnScenario DrawScenario(const DrawnKind& kind, std::uint64_t seed, const trajectory::TrajectorySpline& motion) {
  Random random(seed);
  DrawnScenario drawn;
  if (!kind.joints.empty())
    drawn.joint = kind.joints[static_cast<std::size_t>(random.Uniform(0, static_cast<double>(kind.joints.size())))];
  const double wanted = random.Uniform(kind.smallest, kind.largest);
  double strength = 1;
  for (int round = 0; round < kRounds; ++round) {
    drawn.text = ScenarioText(kind, drawn.joint, seed, strength);
    drawn.size = SizeOf(drawn.text, motion);
    if (wanted == kUnscaled || std::abs(drawn.size / wanted - 1) < 0.15) break;
    strength *= std::clamp(wanted / std::max(drawn.size, 1e-6), 0.1, 10.0);
  }
  return drawn;
}

}  // namespace armcal::tests
