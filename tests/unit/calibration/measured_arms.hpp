// tests - the arms whose measured logs are in the folder ARMCAL_DATA, as robot files and channel maps.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::tests {

// A file or folder of the measured logs; empty where there are none.
inline std::filesystem::path MeasuredFile(const std::string& name) {
  const char* data = std::getenv("ARMCAL_DATA");
  if (data == nullptr) return {};
  const std::filesystem::path path = std::filesystem::path(data) / "measured" / name;
  return std::filesystem::exists(path) ? path : std::filesystem::path();
}

inline std::string TextOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

inline codegen::Robot RobotOf(const std::string& text) {
  const files::test::TemporaryFolder folder;
  return codegen::ReadRobot(folder.Write("robot.toml", text));
}

inline std::string Offsets(int joints) {
  std::string list;
  for (int j = 1; j <= joints; ++j) list += (j > 1 ? ", " : "") + std::to_string(j);
  return "\n[[effect]]\nname = \"torque_offset\"\njoints = [" + list + "]\n";
}

// The UR10 with the maker's DH lengths of the UR10e.
inline codegen::Robot Ur10e() {
  std::string text = TextOf("codegen/robots/ur10.toml");
  const std::pair<const char*, const char*> changes[] = {
      {"d_m = 0.1273", "d_m = 0.1807"},    {"a_m = -0.612\n", "a_m = -0.6127\n"}, {"a_m = -0.5723", "a_m = -0.57155"},
      {"d_m = 0.163941", "d_m = 0.17415"}, {"d_m = 0.1157", "d_m = 0.11985"},     {"d_m = 0.0922", "d_m = 0.11655"}};
  for (const auto& [from, to] : changes) text.replace(text.find(from), std::string(from).size(), to);
  return RobotOf(text + Offsets(6));
}

inline logs::ChannelMap Ur10eChannels() {
  const files::test::TemporaryFolder folder;
  return logs::ReadChannelMap(folder.Write("map.toml", R"(
joints = 6
[time]
column = "t_s"
unit = "s"
[q]
column = "q_rad_{}"
unit = "rad"
[qd]
column = "qd_rad_s_{}"
unit = "rad/s"
[tau]
column = "i_A_{}"
unit = "N*m"
scale = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47]
)"));
}

// Kinematics: the data set's README (modified DH).
inline codegen::Robot Panda() {
  struct Axis {
    double alpha_deg, a_m, d_m, lower_deg, upper_deg, speed_degps, torque_Nm;
  };
  constexpr Axis kAxis[] = {{0, 0, .333, -166, 166, 150, 87},        {-90, 0, 0, -101, 101, 150, 87},
                            {90, 0, .316, -166, 166, 150, 87},       {90, .0825, 0, -176, -4, 150, 87},
                            {-90, -.0825, .384, -166, 166, 180, 12}, {90, 0, 0, -1, 215, 180, 12},
                            {90, .088, 0, -166, 166, 180, 12}};
  std::ostringstream text;
  text << "name = \"panda\"\nsource = \"Gaz et al., RA-L 2019\"\ngravity_mps2 = [0.0, 0.0, -9.81]\ndh = \"modified\"\n"
          "tick_rate_Hz = 1000.0\nsample_ticks = 1\nprior = \"none\"\n"
       << std::showpoint;
  int number = 0;
  for (const Axis& a : kAxis)
    text << "\n[[joint]]\nname = \"A" << ++number << "\"\ntype = \"revolute\"\nalpha_deg = " << a.alpha_deg
         << "\na_m = " << a.a_m << "\nd_m = " << a.d_m << "\nposition_limit_deg = [" << a.lower_deg << ", "
         << a.upper_deg << "]\nspeed_limit_degps = " << a.speed_degps
         << "\nacceleration_limit_radps2 = 10.0\ntorque_limit_Nm = " << a.torque_Nm
         << "\ntorque_noise_Nm = 0.1\nv_min_radps = 0.02\n";
  return RobotOf(text.str() + Offsets(7));
}

struct MeasuredSet {
  codegen::Robot robot;
  std::optional<logs::ChannelMap> channels;
  std::vector<std::filesystem::path> files;
};

// Every shared log of an arm that is well.
inline std::vector<MeasuredSet> MeasuredSets() {
  const auto map = [](const std::string& name) {
    return logs::ReadChannelMap("host_sim/data/channels/" + name + ".toml");
  };
  const auto robot = [](const std::string& name) { return codegen::ReadRobot("codegen/robots/" + name + ".toml"); };
  std::vector<MeasuredSet> sets;
  const auto add = [&sets](codegen::Robot arm, std::optional<logs::ChannelMap> channels, const std::string& folder) {
    MeasuredSet set{std::move(arm), std::move(channels), {}};
    if (const auto path = MeasuredFile(folder); !path.empty())
      for (const auto& entry : std::filesystem::directory_iterator(path))
        if (entry.path().extension() == ".gz") set.files.push_back(entry.path());
    std::sort(set.files.begin(), set.files.end());
    sets.push_back(std::move(set));
  };
  add(Ur10e(), Ur10eChannels(), "ur10e");
  add(Panda(), {}, "franka_panda");
  add(robot("kuka_kr300"), map("kuka_kr300"), "kuka_kr300");
  add(robot("kuka_kr300"), {}, "kr300_benchmark");
  add(robot("kuka_lwr4"), map("kuka_lwr4"), "kuka_lwr4");
  add(robot("emps"), map("emps"), "emps");
  return sets;
}

}  // namespace armcal::tests
