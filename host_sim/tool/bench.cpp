// tool - armcal bench: starts the bench program that was compiled for a robot, and prints its ratios.
// It measures nothing itself: code that is compiled with other flags must not meet the code that is timed.
#include <fmt/core.h>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct BenchOptions {
  std::string robot = "er20_like", program, json;
  bool quick = false;
};

// Gravity in frame 0, then alpha, a, d, theta and "is prismatic" of every joint.
std::vector<std::string> Shape(const codegen::Robot& robot) {
  std::vector<std::string> words;
  const auto add = [&words](double v) { words.push_back(fmt::format("{:.17g}", v)); };
  for (int k = 0; k < 3; ++k) {
    double g = 0;
    for (int i = 0; i < 3; ++i) g += robot.base_rotation[3 * i + k] * robot.gravity_mps2[i];
    add(g);
  }
  for (const codegen::Joint& joint : robot.joint) {
    const codegen::JointKinematics& k = joint.kinematics;
    for (const double v : {k.alpha_rad, k.a_m, k.d_m, k.theta_rad}) add(v);
    add(k.type == codegen::JointType::kPrismatic ? 1 : 0);
  }
  return words;
}

void Print(const nlohmann::ordered_json& result) {
  fmt::print("{}: {} columns, {} {}, CPU time of one thread\n\n", result["robot"].get<std::string>(),
             result["columns"].get<int>(), result["compiler"].get<std::string>(), result["flags"].get<std::string>());
  for (const auto& t : result["times"])
    fmt::print("{:>10.1f} ns  {:>9.1f} .. {:<9.1f} {}\n", t["median_ns"].get<double>(), t["min_ns"].get<double>(),
               t["p90_ns"].get<double>(), t["name"].get<std::string>());
  fmt::print("\n{:<32}{:>8}{:>8}{:>9}\n", "ratio of medians", "value", "goal", "stretch");
  for (const auto& r : result["ratios"]) {
    const bool met = r["met"].get<bool>(), stretched = r["stretch_met"].get<bool>();
    fmt::print("{:<32}{:>8.4f}{:>8.4f}{:>9.4f}  {}\n", r["name"].get<std::string>(), r["value"].get<double>(),
               r["goal"].get<double>(), r["stretch"].get<double>(),
               stretched ? "stretch met"
               : met     ? "goal met"
                         : "NOT MET");
  }
}

// What the program says when it ends with a code: {} if its model is another arm's.
std::string WhyFailed(const nlohmann::ordered_json& result, int code, const std::string& robot) {
  if (result.is_object() && result.empty())
    return "its model is not that of " + robot + "; build it for this robot file";
  if (result.is_object() && result.contains("estimates_differ"))
    return fmt::format("its three ways of least squares differ by {:.1g} of the estimate, which is too much",
                       result["estimates_differ"].get<double>());
  return fmt::format("ended with code {} and no result", code);
}

int RunBench(const BenchOptions& o) {
  const codegen::Robot robot = codegen::ReadRobot(RobotPath(o.robot));
  const std::string program = ProgramFor("armcal-bench", robot.name, o.program, "bench program");
  std::vector<std::string> words{program};
  if (o.quick) words.push_back("--quick");
  const auto shape = Shape(robot);
  words.insert(words.end(), shape.begin(), shape.end());
  Background bench(words);
  std::string rest;
  const int code = bench.Wait(&rest);
  const auto result = io::ParseJson(bench.first_line() + rest);
  if (code != 0 || !result.is_object())
    throw io::InputError(fmt::format("{}: {}", program, WhyFailed(result, code, robot.name)));
  Print(result);
  WriteJson(o.json, result);
  return kOk;
}

}  // namespace

void AddBench(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("bench",
                                  "time the generated model and batch least squares against KDL, the C library and "
                                  "Eigen\nexample: armcal bench --json build/bench.json");
  auto o = std::make_shared<BenchOptions>();
  verb->add_option("--robot", o->robot, "robot file or name")->capture_default_str();
  verb->add_option("--program", o->program, "bench program (default: the one built for the robot)");
  verb->add_flag("--quick", o->quick, "few blocks and a short log: to see that it runs");
  verb->add_option("--json", o->json, "write the ratios and times here");
  verb->callback([o, &action] { action = [o] { return RunBench(*o); }; });
}

}  // namespace armcal::tool
