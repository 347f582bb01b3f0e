// tool - armcal demo: closes the loop on the simulated drive, each stage by its own verb, and reports the result.
#include <fmt/core.h>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "host_sim/machine/plant/scenario.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/demo_result.hpp"
#include "host_sim/tool/diagnose.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/process.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;
using nlohmann::ordered_json;

struct DemoOptions {
  std::string scenario = "stribeck", out = "build/demo", json;
  int excite_s = 60, excite_starts = 40;
};

// Whether a confirmed term can be part of a committed model at all.
bool Flashable(const diagnosis::Finding& finding) {
  for (const diagnosis::Term& t : finding.terms)
    if (t.confirmed && t.record->on_target) return true;
  return false;
}

// RMS per joint of measured torque minus what the sensor would have read without noise, over the scored moving samples
// of a recorded log. truth: the drive's truth log; first_tick, decimation: as the recording says.
VectorXd PlantFloor(const std::string& truth, const calibration::Dataset& log, std::uint32_t first_tick,
                    int decimation) {
  const int n = log.joints();
  const std::string bytes = files::ReadWholeFile(truth);
  const std::size_t record = 4 + 8 * static_cast<std::size_t>(n);
  // ticks of one motion follow each other; find the log's first one
  std::size_t at = 0;
  const auto tick_at = [&](std::size_t k) {
    std::uint32_t tick = 0;
    std::memcpy(&tick, bytes.data() + k * record, 4);
    return tick;
  };
  const std::size_t count = bytes.size() / record;
  while (at < count && tick_at(at) != first_tick) ++at;
  const auto needed = static_cast<std::size_t>(log.samples()) * static_cast<std::size_t>(decimation);
  if (at + needed > count || tick_at(at + needed - 1) != first_tick + needed - 1)
    throw io::InputError(truth + ": does not hold the recorded motion");
  Eigen::MatrixXd residual(log.samples(), n);
  for (int k = 0; k < log.samples(); ++k) {
    VectorXd mean = VectorXd::Zero(n);
    for (int i = 0; i < decimation; ++i) {
      VectorXd tau(n);
      std::memcpy(tau.data(), bytes.data() + (at + static_cast<std::size_t>(k) * decimation + i) * record + 4,
                  8 * static_cast<std::size_t>(n));
      mean += tau / decimation;
    }
    residual.row(k) = log.tau.row(k) - mean.transpose();
  }
  return calibration::Rms(log, residual, true);
}

// A joint's error on the drive is at the floor of the plant up to this factor.
constexpr double kAtTheFloor = 1.1;

// What became of an effect that the simulation has: its terms in the verdict decide.
struct Fate {
  std::string text;
  bool in_model = false;
};
Fate Became(const ordered_json& effect, const ordered_json& terms) {
  Fate fate{"missed", false};
  for (const auto& t : terms) {
    const bool whole_arm = effect["joint"].is_string();
    if (!whole_arm && t["joint"] != effect["joint"]) continue;
    bool named = t["kind"] == effect["kind"];
    for (const auto& other : t["also_fits"]) named = named || other == effect["kind"];
    if (!named && (whole_arm || !t["confirmed"].get<bool>())) continue;
    if (!t["confirmed"].get<bool>()) fate = {"seen, not confirmed", false};
    else if (!t["in_model"].get<bool>()) return {"found; no model can hold it", false};
    else if (named) return {"found", true};
    else fate = {fmt::format("found under another name: {}", t["kind"].get<std::string>()), true};
  }
  return fate;
}

// Says for each effect and each joint whether the loop closed there.
void AddOutcome(ordered_json& r) {
  bool closed = true;
  r["effects"] = ordered_json::array();
  for (const auto& u : r["undeclared"]) {
    const Fate fate = Became(u, r["terms"]);
    closed = closed && fate.in_model;
    r["effects"].push_back({{"kind", u["kind"]}, {"joint", u["joint"]}, {"became", fate.text}});
  }
  r["joints"] = ordered_json::array();
  for (std::size_t j = 0; j < r["drive_after"].size(); ++j) {
    const double ratio = r["drive_after"][j].get<double>() / r["plant_floor_after_run"][j].get<double>();
    closed = closed && ratio <= kAtTheFloor;
    r["joints"].push_back({{"joint", j + 1}, {"error_over_floor", ratio}, {"closed", ratio <= kAtTheFloor}});
  }
  r["closed"] = closed;
}

class Demo {
 public:
  explicit Demo(const DemoOptions& o) : o_(o), tool_(OwnProgram()) {
    scenario_ = ScenarioPath(o.scenario);
    io::MakeFolder(o.out);
    for (const char* old : {"drive.nor", "truth_1.bin", "truth_2.bin", "result.json", "report.html"})
      fs::remove(fs::path(o.out) / old);
  }

  int Run() {
    const auto begin = std::chrono::steady_clock::now();
    calibration::WriteTable(File("table_cad.toml"), calibration::DefaultTable(LoadModel(robot_)));
    Stage("excite: trajectories within the limits");
    // A fixed number of searches: the run follows from its seeds, not from how busy the machine is.
    const std::string searches = std::to_string(o_.excite_starts), most_s = std::to_string(o_.excite_s);
    Verb({"excite", "--robot", robot_, "--purpose", "train", "--seed", "1", "--starts", searches, "--search-seconds",
          most_s, "--out", File("train.csv")});
    Verb({"excite", "--robot", robot_, "--purpose", "test", "--seed", "2", "--starts", searches, "--search-seconds",
          most_s, "--out", File("test.csv")});
    Stage("start the simulated drive; flash the CAD table over Modbus");
    StartDrive(robot_, "truth_1.bin");
    Flash("table_cad.toml", robot_, "flash_cad.json");
    Stage("run and record the training motion; the host's estimator listens to the live trace");
    ListenAndRecord();  // the first motion after the table was adopted: host and drive start from the same state
    Stage("run the held-out motion with the CAD table");
    Record("test.csv", "test_cad", robot_);
    Stage("identify the declared model, flash it, run the held-out motion");
    Verb({"identify", "--robot", robot_, "--train", File("train_log.csv.gz"), "--table-out", File("table_before.toml"),
          "--json", File("identify_before.json")},
         "identify_before.txt");
    Flash("table_before.toml", robot_, "flash_before.json");
    Record("test.csv", "test_before", robot_);
    Stage("diagnose: what does the model lack?");
    DiagnoseOptions diagnosis;
    diagnosis.robot = robot_, diagnosis.train = {File("train_log.csv.gz")}, diagnosis.test = File("test_before.csv.gz");
    diagnosis.json = File("verdict.json"), diagnosis.model_out = File("new_model.toml");
    const auto run = RunDiagnosis(diagnosis);
    ordered_json result = run->json;
    std::string path = "nothing was found, so the identified table stays";
    std::string final_robot = robot_, final_flash = "flash_before.json";
    bool confirmed = false;
    for (const auto& t : result["terms"]) confirmed = confirmed || t["confirmed"].get<bool>();
    std::string after_truth = "truth_1.bin";
    if (confirmed) {
      final_robot = File("new_model.toml");
      Stage("fit the model with the effect");
      Verb({"identify", "--robot", final_robot, "--train", File("train_log.csv.gz"), "--table-out",
            File("table_after.toml"), "--json", File("identify_after.json")},
           "identify_after.txt");
      if (result["model"]["by_table"].get<bool>()) {
        path = Flashable(run->diagnosis->finding())
                   ? "the effect was compiled in and on standby; a table switched it on"
                   : "no model can hold what was found; the table stays without it";
      } else {
        Stage("generate the new model, build the drive with it, restart it");
        Verb({"generate", "--robot", final_robot, "--out", File("generated")});
        drive_.reset();
        StartDrive(final_robot, "truth_2.bin");
        after_truth = "truth_2.bin";
        path =
            "the model was generated anew, the drive built with it, restarted and flashed; values carried over by name";
      }
      Stage("flash the table, verify it, run the held-out motion again");
      Flash("table_after.toml", final_robot, "flash_after.json");
      Verb({"verify", "--connect", address_, "--robot", final_robot, "--table", File("table_after.toml")});
      final_flash = "flash_after.json";
    } else {
      Stage("run the held-out motion again");
    }
    Record("test.csv", "test_after", final_robot);
    drive_.reset();

    // The verdict is written; now the truth may be read.
    const plant::Scenario scenario = plant::ReadScenario(scenario_.string());
    result["title"] = scenario.title;
    result["undeclared"] = ordered_json::array();
    for (const auto& u : scenario.undeclared()) {
      ordered_json joint = u.joint;
      if (!u.joint.empty() && u.joint.find_first_not_of("0123456789") == std::string::npos) joint = std::stoi(u.joint);
      result["undeclared"].push_back({{"kind", u.kind}, {"joint", joint}});
    }
    const ordered_json cad = files::ReadJsonFile(File("test_cad.json")),
                       before = files::ReadJsonFile(File("test_before.json")),
                       after = files::ReadJsonFile(File("test_after.json"));
    result["plant_floor"] =
        verdict::ToList(PlantFloor(File("truth_1.bin"), run->test, before["first_tick"], before["decimation"]));
    const LogReader read(*run->model, {});
    result["plant_floor_after_run"] = verdict::ToList(
        PlantFloor(File(after_truth), read.One(File("test_after.csv.gz")), after["first_tick"], after["decimation"]));
    result["drive_cad"] = cad["drive_residual_rms_Nm"], result["drive_before"] = before["drive_residual_rms_Nm"],
    result["drive_after"] = after["drive_residual_rms_Nm"];
    result["tracking_cad_rad"] = cad["tracking_rms_rad"], result["tracking_before_rad"] = before["tracking_rms_rad"],
    result["tracking_after_rad"] = after["tracking_rms_rad"];
    const ordered_json flashed = files::ReadJsonFile(File(final_flash)),
                       estimate = files::ReadJsonFile(File("estimate.json"));
    result["table_crc"] = flashed["table_crc"], result["readback_ok"] = flashed["readback_ok"];
    result["estimate_same_bits"] = estimate["same_bits"];
    result["path"] = path;
    result["stages"] = stages_;
    result["wall_s"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    AddOutcome(result);
    WriteJson(File("result.json"), result);
    WriteJson(o_.json, result);
    WriteDemoPage(File("report.html"), result);
    fmt::print("{}\nresult: {}\nreport: {}\n", DemoText(result), File("result.json"), File("report.html"));
    return result["closed"].get<bool>() ? kOk : kPartial;
  }

 private:
  std::string File(const std::string& name) const { return (fs::path(o_.out) / name).string(); }
  void Stage(const std::string& text) {
    stages_.push_back(text);
    fmt::print("\n== {}. {}\n", stages_.size(), text);
    std::fflush(stdout);
  }
  void Verb(std::vector<std::string> words, const std::string& log = "") {
    std::string line = "armcal";
    for (const std::string& w : words) line += " " + w;
    fmt::print("$ {}\n", line);
    std::fflush(stdout);
    words.insert(words.begin(), tool_);
    const int code = RunProgram(words, log.empty() ? "" : File(log));
    if (code != 0)
      throw io::InputError(line + ": ended with code " + std::to_string(code) +
                           (log.empty() ? "" : ", see " + File(log)));
  }
  // Compiles the drive of a robot that armcal was not built with.
  void StartDrive(const std::string& robot, const std::string& truth) {
    const std::vector<std::string> words{tool_,         "simulate", "--scenario", scenario_.string(), "--robot",
                                         robot,         "--port",   "0",          "--storage",        File("drive.nor"),
                                         "--truth-log", File(truth)};
    drive_ = std::make_unique<Background>(words);
    fmt::print("{}\n", drive_->first_line());
    address_ = drive_->first_line().substr(drive_->first_line().rfind(' ') + 1);
  }
  void Flash(const std::string& table, const std::string& robot, const std::string& json) {
    Verb({"flash", "--connect", address_, "--robot", robot, "--table", File(table), "--json", File(json)});
  }
  void Record(const std::string& trajectory, const std::string& name, const std::string& robot) {
    Verb({"record", "--connect", address_, "--robot", robot, "--trajectory", File(trajectory), "--out",
          File(name + ".csv.gz"), "--samples", File(name + "_samples.csv.gz"), "--json", File(name + ".json")});
  }
  void ListenAndRecord() {
    Background estimate({tool_, "estimate", "--connect", address_, "--robot", robot_, "--json", File("estimate.json"),
                         "--records", File("estimate.bin")});
    Verb({"record", "--connect", address_, "--robot", robot_, "--trajectory", File("train.csv"), "--out",
          File("train_log.csv.gz"), "--json", File("train.json")});
    std::string output;
    const int code = estimate.Wait(&output);
    files::WriteWholeFile(File("estimate.txt"), output);
    const auto last = output.rfind('\n', output.size() - 2);
    fmt::print("{}", output.substr(last == std::string::npos ? 0 : last + 1));
    if (code != 0)
      throw io::InputError("armcal estimate ended with code " + std::to_string(code) + ", see " + File("estimate.txt"));
  }

  DemoOptions o_;
  std::string tool_, robot_ = "er20_like", address_;
  fs::path scenario_;
  std::unique_ptr<Background> drive_;
  std::vector<std::string> stages_;
};

}  // namespace

void AddDemo(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "demo",
      "close the loop on the simulated drive: measure, find what is missing, add it, flash "
      "it, measure again; ends with 6 where the loop did not close\nexample: armcal demo --scenario ripple");
  auto o = std::make_shared<DemoOptions>();
  verb->add_option("--scenario", o->scenario, "scenario file, or a name in host_sim/scenarios")->capture_default_str();
  verb->add_option("--out", o->out, "folder for everything that is made")->capture_default_str()->type_name(kFolder);
  verb->add_option("--excite-seconds", o->excite_s, "at most, for each search of a trajectory")->capture_default_str();
  verb->add_option(
          "--excite-starts", o->excite_starts,
          "searches of each trajectory; if the time is enough for all, the result is the same on every computer")
      ->check(Between(1, 1000))
      ->capture_default_str();
  verb->add_option("--json", o->json, "write a copy of the folder's result.json here");
  verb->callback([o, &action] { action = [o] { return Demo(*o).Run(); }; });
}

}  // namespace armcal::tool
