// practice - writes the declared model of a case as a robot file of armcal.
//   practice_robot CASE_DIR ROBOTS_DIR > robot.toml
#include <fmt/core.h>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>

namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;
// The format states neither; both only scale: full speed within a quarter of a second, noise as weights' first guess.
constexpr double kReachSpeed_s = 0.25, kNoiseOfLimit = 0.005;

json Read(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  return json::parse(in);
}

std::string List(const json& numbers) {
  std::string out;
  for (const json& v : numbers) out += fmt::format("{}{:.9g}", out.empty() ? "" : ", ", v.get<double>());
  return "[" + out + "]";
}

void PrintJoint(const json& robot, int j, double v_min) {
  const json &dh = robot["mdh"], &link = robot["links"][j];
  const double speed = robot["vmax"][j], torque = robot["tau_max"][j];
  fmt::print("\n[[joint]]\nname = \"axis {}\"\ntype = \"revolute\"\n", j + 1);
  fmt::print("alpha_deg = {:.12g}\na_m = {:.12g}\nd_m = {:.12g}\noffset_deg = {:.12g}\n",
             dh["alpha"][j].get<double>() * kDegPerRad, dh["a"][j].get<double>(), dh["d"][j].get<double>(),
             dh["theta_offset"][j].get<double>() * kDegPerRad);
  fmt::print("position_limit_deg = [{:.9g}, {:.9g}]\nspeed_limit_degps = {:.9g}\nacceleration_limit_radps2 = {:.9g}\n",
             robot["q_lo"][j].get<double>() * kDegPerRad, robot["q_hi"][j].get<double>() * kDegPerRad,
             speed * kDegPerRad, speed / kReachSpeed_s);
  fmt::print("torque_limit_Nm = {:.9g}\ntorque_noise_Nm = {:.9g}\nv_min_radps = {:.9g}\n", torque,
             kNoiseOfLimit * torque, v_min);
  fmt::print("link = {{ mass_kg = {:.9g}, center_m = {}, inertia_kgm2 = {} }}\n", link["m"].get<double>(),
             List(link["com"]), List(link["inertia"]));
}

void PrintEffect(const char* name, int joints) {
  json numbers;
  for (int j = 1; j <= joints; ++j) numbers.push_back(j);
  fmt::print("\n[[effect]]\nname = \"{}\"\njoints = {}\n", name, List(numbers));
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: practice_robot CASE_DIR ROBOTS_DIR > robot.toml");
  const json one = Read(std::string(argv[1]) + "/case.json");
  const std::string name = one["robot"];
  const json robot = Read(std::string(argv[2]) + "/" + name + ".json"), declared = one["declared_model"];
  const double width = declared.value("coulomb_smoothing_velocity", 0.0), rate_Hz = one["fs"];
  fmt::print("name = \"{}\"\nsource = \"practice case\"\ngravity_mps2 = {}\ndh = \"modified\"\n", name,
             List(robot["gravity"]));
  if (width > 0) fmt::print("sign_law = \"tanh\"\nsign_width_radps = {:.9g}\n", width);
  fmt::print("tick_rate_Hz = {:.9g}\nsample_ticks = 1\n", rate_Hz);
  const int joints = static_cast<int>(robot["links"].size());
  for (int j = 0; j < joints; ++j) PrintJoint(robot, j, width > 0 ? width : 0.002 * robot["vmax"][j].get<double>());
  if (declared.value("rotor_inertia", false)) PrintEffect("rotor_inertia", joints);
  if (declared.value("offset", false)) PrintEffect("torque_offset", joints);
  return 0;
} catch (const std::exception& e) {
  std::cerr << e.what() << "\n";
  return 2;
}
