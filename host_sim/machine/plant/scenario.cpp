// plant - reads a scenario file. host_sim/scenarios/README.md describes its keys.
#include "host_sim/machine/plant/scenario.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "codegen/src/io/faults.hpp"
#include "codegen/src/io/file_kind.hpp"
#include "host_sim/machine/plant/frame_keys.hpp"

namespace armcal::plant {
namespace {

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

std::vector<std::string> EffectKinds() {
  std::vector<std::string> kinds = {"payload_step",    "base_tilt",        "rotor_inertia",
                                    "belt_elasticity", "joint_compliance", "backlash"};
  const auto add = [&](const auto& readers) {
    for (const auto& [name, reader] : readers) kinds.push_back(name);
  };
  add(AllLinkForces()), add(AllReadingEffects()), add(AllJointEffects());
  return kinds;
}

// Of which family a kind is decides what it acts on.
void ReadEffect(const io::TomlReader& keys, Scenario& scenario) {
  const std::string kind = keys.Text("kind");
  const auto joint = [&] { return ReadJointNumber(keys, "joint"); };
  const auto joint_or_all = [&] { return keys.Has("joint") ? joint() : -1; };
  const auto from_s = [&] { return keys.NotNegative("from_s", 0); };
  if (kind == "payload_step") {
    if (scenario.payload) keys.Fail("kind", "payload_step only once");
    scenario.payload = ReadPayload(keys);
  } else if (kind == "base_tilt") {
    if (scenario.tilted()) keys.Fail("kind", "base_tilt only once");
    scenario.tilt_roll_rad = keys.Number("roll_deg", 0) * kRadPerDeg;
    scenario.tilt_pitch_rad = keys.Number("pitch_deg", 0) * kRadPerDeg;
  } else if (kind == "rotor_inertia") {
    scenario.flywheels.push_back({joint(), keys.Positive("inertia_kgm2")});
  } else if (IsTransmission(kind)) {
    const int at = joint();
    for (const Transmission& other : scenario.transmissions)
      if (other.joint == at) keys.Fail("joint", "one elastic transmission or gap a joint");
    scenario.transmissions.push_back(ReadTransmission(kind, at, keys));
  } else if (const auto reads_force = AllLinkForces().find(kind); reads_force != AllLinkForces().end()) {
    std::shared_ptr<const LinkForce> force = reads_force->second(keys);
    scenario.forces.push_back({kind, force->at_flange() ? -1 : joint(), force, from_s()});
  } else if (const auto reads = AllReadingEffects().find(kind); reads != AllReadingEffects().end()) {
    const bool one_wire = kind == "time_delay" || kind == "torque_filter";
    scenario.readings.push_back({kind, one_wire ? joint_or_all() : joint(), reads->second(keys), from_s()});
  } else if (AllJointEffects().contains(kind)) {
    const int at = joint();
    std::shared_ptr<const JointEffect> effect = ReadJointEffect(kind, keys, at);
    scenario.joint_effects.push_back({kind, at, effect, from_s()});
    if (std::shared_ptr<const JointEffect> there = effect->AtTheOtherJoint())
      scenario.joint_effects.push_back({kind, effect->other_joint(), there, from_s(), true});
  } else {
    const std::vector<std::string> kinds = EffectKinds();
    std::string all;
    for (const std::string& known : kinds) all += (all.empty() ? "" : ", ") + known;
    const std::string nearest = io::Nearest(kind, kinds);
    keys.Fail("kind", nearest.empty() ? "one of: " + all
                                      : "a kind of effect, found \"" + kind + "\"; the nearest is " + nearest);
  }
  keys.Finish();
}

}  // namespace

std::vector<Undeclared> Scenario::undeclared() const {
  std::vector<Undeclared> list;
  const auto number = [](int joint) { return std::to_string(joint + 1); };
  for (const PlacedJointEffect& placed : joint_effects) {
    if (placed.reaction) continue;
    const int other = placed.effect->other_joint(), first = std::min(placed.joint, other);
    list.push_back(
        {placed.kind, other < 0 ? number(placed.joint) : number(first) + "-" + number(std::max(placed.joint, other))});
  }
  for (const Transmission& t : transmissions) list.push_back({t.kind, number(t.joint)});
  for (const Flywheel& wheel : flywheels) list.push_back({"rotor_inertia", number(wheel.joint)});
  for (const PlacedReading& r : readings) list.push_back({r.kind, r.axis < 0 ? "all" : number(r.axis)});
  for (const PlacedForce& f : forces) list.push_back({f.kind, f.link < 0 ? "flange" : number(f.link)});
  if (payload) list.push_back({"payload_step", "flange"});
  if (tilted()) list.push_back({"base_tilt", "base"});
  return list;
}

void RequireRobot(const Scenario& scenario, const std::string& robot, const std::string& robot_path) {
  if (!scenario.robot.empty() && scenario.robot != robot)
    throw io::InputError(scenario.path + ": is of robot \"" + scenario.robot + "\", expected \"" + robot +
                         "\", the robot of " + robot_path +
                         "; give --scenario any, or write one (host_sim/scenarios/README.md)");
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
