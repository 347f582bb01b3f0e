// plant - reads a scenario file. host_sim/scenarios/README.md describes its keys.
#include "host_sim/machine/plant/scenario.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "codegen/src/io/file_kind.hpp"
#include "host_sim/machine/plant/frame_keys.hpp"

namespace armcal::plant {
namespace {

constexpr int kMostJoints = 16;  // an upper bound for any robot; Arm checks the number of this robot

// A factor 1 - spread must stay positive, or friction and torque constants could vanish.
double ReadSpread(const io::TomlReader& keys, const std::string& key, double fallback) {
  const double value = keys.NotNegative(key, fallback);
  if (value >= 1) keys.Fail(key, "a number from 0 to below 1");
  return value;
}

Thermal ReadThermal(const io::TomlReader& keys) {
  Thermal thermal;
  thermal.ambient_degC = keys.Number("ambient_degC", thermal.ambient_degC);
  thermal.start_degC = keys.NumberOrNumbers("start_degC", {thermal.ambient_degC});
  thermal.rise_KpW = keys.NumberOrNumbers("rise_KpW", thermal.rise_KpW);
  thermal.time_constant_s = keys.NumberOrNumbers("time_constant_s", thermal.time_constant_s);
  for (const double value : thermal.rise_KpW)
    if (value < 0) keys.Fail("rise_KpW", "numbers not below 0");
  for (const double value : thermal.time_constant_s)
    if (value <= 0) keys.Fail("time_constant_s", "numbers above 0");
  keys.Finish();
  return thermal;
}

PayloadStep ReadPayload(const io::TomlReader& keys) {
  PayloadStep payload;
  payload.body.mass_kg = keys.Positive("mass_kg");
  const auto center = keys.Numbers("center_m", 3);
  const auto inertia = keys.Numbers("inertia_kgm2", 6);
  std::copy(center.begin(), center.end(), payload.body.center_m.begin());
  std::copy(inertia.begin(), inertia.end(), payload.body.inertia_kgm2.begin());
  if (!IsPhysical(payload.body)) keys.Fail("inertia_kgm2", "xx xy xz yy yz zz of a physical body about its centre");
  payload.from_s = keys.NotNegative("from_s", 0);
  payload.until_s = keys.Number("until_s", std::numeric_limits<double>::infinity());
  if (payload.until_s <= payload.from_s) keys.Fail("until_s", "a time after from_s");
  return payload;
}

void ReadEffect(const io::TomlReader& keys, Scenario& scenario) {
  const std::string kind = keys.Text("kind");
  if (kind == "payload_step") {
    if (scenario.payload) keys.Fail("kind", "payload_step only once");
    scenario.payload = ReadPayload(keys);
  } else if (kind == "base_tilt") {
    if (scenario.tilted()) keys.Fail("kind", "base_tilt only once");
    scenario.tilt_roll_rad = keys.Number("roll_deg", 0) * kRadPerDeg;
    scenario.tilt_pitch_rad = keys.Number("pitch_deg", 0) * kRadPerDeg;
  } else {
    const int joint = static_cast<int>(keys.Integer("joint", 1, kMostJoints)) - 1;
    const double from_s = keys.NotNegative("from_s", 0);
    scenario.joint_effects.push_back({kind, joint, ReadJointEffect(kind, keys), from_s});
  }
  keys.Finish();
}

}  // namespace

std::vector<Undeclared> Scenario::undeclared() const {
  std::vector<Undeclared> list;
  for (const PlacedJointEffect& placed : joint_effects) list.push_back({placed.kind, std::to_string(placed.joint + 1)});
  if (payload) list.push_back({"payload_step", "flange"});
  if (tilted()) list.push_back({"base_tilt", "base"});
  return list;
}

Scenario ReadScenario(const std::string& path) {
  const toml::table table = io::ParseToml(path);
  io::RequireKind(table, path, io::FileKind::kScenario);
  const io::TomlReader keys(table, path);
  Scenario scenario;
  scenario.path = path;
  scenario.title = keys.Text("title");
  scenario.robot = keys.Text("robot", "");
  scenario.truth_seed = static_cast<std::uint64_t>(keys.Integer("truth_seed", 0, INT64_MAX));
  scenario.noise_seed = static_cast<std::uint64_t>(keys.Integer("noise_seed", 0, INT64_MAX));
  scenario.stick_ratio = keys.Number("stick_ratio", scenario.stick_ratio);
  if (scenario.stick_ratio < 1) keys.Fail("stick_ratio", "a number not below 1");
  scenario.current_time_constant_s = keys.Positive("current_time_constant_s", scenario.current_time_constant_s);
  const std::string command = keys.Text("command", "held");
  if (command != "held" && command != "ramp") keys.Fail("command", "\"held\" or \"ramp\"");
  scenario.command_ramps = command == "ramp";
  scenario.substeps = static_cast<int>(keys.Integer("substeps", 1, 64, scenario.substeps));
  scenario.start_rad = keys.NumberOrNumbers("start_rad", {});
  if (keys.Has("flange")) scenario.flange = ReadFrame(keys.Table("flange"));
  if (keys.Has("thermal")) scenario.thermal = ReadThermal(keys.Table("thermal"));
  if (keys.Has("truth")) {
    const io::TomlReader truth = keys.Table("truth");
    scenario.spread.inertial = ReadSpread(truth, "inertial_spread", scenario.spread.inertial);
    scenario.spread.friction = ReadSpread(truth, "friction_spread", scenario.spread.friction);
    scenario.spread.torque_constant = ReadSpread(truth, "torque_constant_spread", scenario.spread.torque_constant);
    scenario.spread.unstated = ReadSpread(truth, "unstated_share", scenario.spread.unstated);
    truth.Finish();
  }
  if (keys.Has("sensors")) {
    const io::TomlReader sensors = keys.Table("sensors");
    scenario.torque_noise_scale = sensors.NotNegative("torque_noise_scale", scenario.torque_noise_scale);
    scenario.temperature_noise_degC = sensors.NotNegative("temperature_noise_degC", scenario.temperature_noise_degC);
    sensors.Finish();
  }
  for (const io::TomlReader& effect : keys.Tables("effect")) ReadEffect(effect, scenario);
  keys.Finish();
  return scenario;
}

}  // namespace armcal::plant
