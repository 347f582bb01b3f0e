// calibration tests - how often the 95 % interval of a payload holds the truth: two arms, three masses, 100 draws each.
#include <gtest/gtest.h>

#include <fmt/core.h>

#include "host_sim/identify/calibration/payload.hpp"
#include "tests/unit/calibration/laden_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::calibration {
namespace {

using Eigen::VectorXd;
using tests::LadenArm;

constexpr int kCoverageDraws = 100, kAtLeast = 90;

// A cobot of the 10 kg class that nobody sells.
std::string LightArm() {
  static const files::test::TemporaryFolder folder;
  const char* const frame[] = {"0.0, 0.0, 0.13, 0.0",   "90.0, 0.0, 0.0, 90.0", "0.0, 0.6, 0.0, 0.0",
                               "0.0, 0.55, 0.15, 90.0", "90.0, 0.0, 0.11, 0.0", "-90.0, 0.0, 0.1, 0.0"};
  const double mass[] = {7, 12, 5, 2, 2, 0.5}, torque[] = {300, 300, 150, 55, 55, 55},
               noise[] = {2, 2, 1, 0.3, 0.3, 0.3};
  std::string text =
      "name = \"light\"\nsource = \"chosen for this test\"\ndh = \"modified\"\ngravity_mps2 = [0.0, 0.0, -9.81]\n";
  for (int j = 0; j < 6; ++j) {
    double value[4];
    std::sscanf(frame[j], "%lf, %lf, %lf, %lf", &value[0], &value[1], &value[2], &value[3]);
    text += fmt::format(
        "[[joint]]\nname = \"j{}\"\ntype = \"revolute\"\nalpha_deg = {:.1f}\na_m = {}\nd_m = {}\noffset_deg = {:.1f}\n"
        "position_limit_deg = [-170.0, 170.0]\nspeed_limit_degps = 150.0\nacceleration_limit_radps2 = 10.0\n"
        "torque_limit_Nm = {}\ntorque_noise_Nm = {}\nv_min_radps = 0.02\ncoulomb_Nm = {}\nviscous_Nmsprad = {}\n"
        "encoder = {{ counts_per_turn = 131072 }}\n"
        "motor = {{ gear_ratio = 101.0, current_A_per_lsb = 0.001, torque_constant_NmpA = 0.1, "
        "torque_constant_tolerance = 0.03, rotor_inertia_kgm2 = {} }}\n"
        "link = {{ mass_kg = {}, center_m = [{}, 0.01, 0.03], inertia_kgm2 = [{}, 0.0, 0.001, {}, 0.0, {}] }}\n",
        j + 1, value[0], value[1], value[2], value[3], torque[j], noise[j], 0.03 * torque[j], 0.03 * torque[j],
        4e-7 * torque[j], mass[j], j == 1 || j == 2 ? 0.25 : 0.01, 0.01 * mass[j], 0.012 * mass[j], 0.009 * mass[j]);
  }
  return folder.Write("light.toml", text + tests::kTool).string();
}

struct Coverage {
  int held = 0, seen = 0;
  VectorXd half_width = VectorXd::Zero(4);
};

// Both runs are 20 s. The laden one is slow work, or as the bare one.
Coverage Draw(const std::string& path, double mass_kg, bool work) {
  const plant::Body load{mass_kg, {0.03, -0.02, 0.07}, {0.004 * mass_kg, 0, 0, 0.003 * mass_kg, 0, 0.005 * mass_kg}};
  const double truth[] = {mass_kg, 0.03, -0.02, 0.07};
  Coverage c;
  for (int seed = 1; seed <= kCoverageDraws; ++seed) {
    LadenArm arm(static_cast<std::uint64_t>(seed), 0.03, 1, path);
    const Dataset without = arm.Run(20, 1000 + seed, {}), with = arm.Run(20, 2000 + seed, load, {}, work ? 0.2 : 0.5);
    Load found;
    if (!files::test::ErrorOf([&] { found = FindLoad(arm.model(), {{&without}, {&with}}); }).empty()) continue;
    ++c.seen;
    bool held = true;
    for (int i = 0; i < 4; ++i) {
      c.half_width[i] += found.HalfWidth95(i);
      held = held && std::abs(found.body[i] - truth[i]) <= found.HalfWidth95(i);
    }
    c.held += held;
  }
  c.half_width /= std::max(1, c.seen);
  return c;
}

TEST(PayloadInterval, HoldsMassAndCentreAtOnce_In90Of100Draws) {
  const std::pair<const char*, std::string> arms[] = {{"er20_like", tests::RobotWith(tests::kTool)},
                                                      {"light", LightArm()}};
  for (const auto& [name, path] : arms)
    for (const double mass : {0.5, 2.0, 5.0})
      for (const bool work : {false, true}) {
        const Coverage c = Draw(path, mass, work);
        fmt::print("{:9} {:3} kg, {}: seen in {}, held in {}; mass +- {:.3f} kg, centre +- {:.1f} mm\n", name, mass,
                   work ? "slow work " : "excitation", c.seen, c.held, c.half_width[0],
                   1e3 * c.half_width.tail(3).mean());
        EXPECT_GE(c.held, kAtLeast) << name << " " << mass << (work ? " work" : "");
        // Wider would hold more, and say less.
        EXPECT_LT(c.half_width[0], 0.03 + 0.05 * mass) << name << " " << mass;
      }
}

}  // namespace
}  // namespace armcal::calibration
