// end-to-end tests - write a finding that no model can hold: --model-out says so and writes no effect.
#include <algorithm>
#include <iomanip>
#include <numbers>
#include <random>
#include <regex>
#include <set>
#include <sstream>

#include "host_sim/data/logs/log.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {
namespace {

using calibration::Dataset;
using Change = std::function<void(Dataset&)>;

class ModelOut : public testing::Test {
 protected:
  // Logs of a small arm whose measurement underwent this; what diagnose said, and the new file generated from.
  void Diagnose(const std::string& name, const Change& train, const Change& test,
                const std::vector<std::string>& options = {}) {
    folder_ = FreshFolder("model_out_" + name);
    SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 9);
    Write(arm.Run(20, 90), train, "train.csv");
    Write(arm.Run(20, 91), test, "test.csv");
    std::vector<std::string> words{"diagnose",        "--robot", "two_link",           "--train",
                                   Path("train.csv"), "--test",  Path("test.csv"),     "--model-out",
                                   Path("new.toml"),  "--json",  Path("verdict.json"), "--report",
                                   Path("page.html")};
    words.insert(words.end(), options.begin(), options.end());
    said_ = Tool(words);
    ASSERT_EQ(said_.code, 0) << said_.err << said_.out;
    verdict_ = ReadJson(Path("verdict.json"));
    const Outcome generated = Tool({"generate", "--robot", Path("new.toml"), "--out", Path("generated")});
    ASSERT_EQ(generated.code, 0) << generated.err;
  }
  // The first term is of this record, with its remedy wherever the verdict is read; tables are what a model can hold.
  void ExpectARemedyFor(const std::string& record) {
    if (HasFatalFailure()) return;
    ASSERT_FALSE(verdict_.at("terms").empty()) << said_.out;
    const nlohmann::json& t = verdict_.at("terms")[0];
    EXPECT_EQ(t.at("record"), record) << said_.out;
    EXPECT_FALSE(t.at("in_model").get<bool>());
    const std::string remedy = t.at("remedy"), file = ReadText(Path("new.toml"));
    EXPECT_NE(file.find(remedy), std::string::npos);
    EXPECT_NE(said_.out.find(remedy), std::string::npos) << said_.out;
    EXPECT_NE(ReadText(Path("page.html")).find("no model can hold it: "), std::string::npos);
    EXPECT_NE(file.find(" +- "), std::string::npos);
    EXPECT_NE(file.find("train.csv (sha256 "), std::string::npos);
    int held = 0, tables = 0;
    for (const auto& term : verdict_.at("terms")) held += term.at("in_model").get<bool>();
    const std::string table = "\n[[effect]]\nname = ", friction = table + "\"coulomb_viscous\"";
    for (auto at = file.find(table); at != file.npos; at = file.find(table, at + 1))
      tables += file.compare(at, friction.size(), friction) != 0;
    EXPECT_EQ(tables, held);
    EXPECT_EQ(verdict_.at("model").at("by_table").get<bool>(), held == 0);
    EXPECT_EQ(said_.out.find("as comments: no model can hold it") != std::string::npos, held == 0) << said_.out;
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_;
  Outcome said_;
  nlohmann::json verdict_;

 private:
  void Write(Dataset d, const Change& change, const std::string& name) const {
    if (change) change(d);
    logs::Log log;
    log.joints = d.joints();
    log.t = d.s.t, log.q = d.s.q, log.tau = d.tau;
    logs::WriteLog(Path(name), log);
  }
};

TEST_F(ModelOut, OfATorqueThatIsReadLate_SaysByHowMuch) {
  const auto late = [](Dataset& d) {  // half a sample of 8 ms
    const Eigen::MatrixXd tau = d.tau;
    for (int k = 1; k < d.samples(); ++k) d.tau.row(k) = 0.5 * (tau.row(k) + tau.row(k - 1));
  };
  Diagnose("late", late, late);
  ExpectARemedyFor("time_delay");
  EXPECT_NEAR(verdict_["terms"][0]["parameters"]["time_delay.d"].get<double>(), 0.004, 0.0008);
}

// All keys of a JSON, at any depth.
void AddKeys(const nlohmann::json& json, std::set<std::string>& keys) {
  for (const auto& [key, value] : json.items()) {
    if (json.is_object()) keys.insert(key);
    if (value.is_structured()) AddKeys(value, keys);
  }
}

// Programs of users read these keys.
TEST_F(ModelOut, Json_HasEveryKeyThatThePageOfDiagnosisLists) {
  Diagnose(
      "gain", [](Dataset& d) { d.tau.col(1) *= 1.25; }, [](Dataset& d) { d.tau.col(1) *= 1.25; });
  std::set<std::string> keys;
  AddKeys(verdict_, keys);
  std::istringstream page(ReadText("docs/diagnosis.md"));
  const std::regex name("`(?:terms\\[\\]\\.)?([a-zA-Z0-9_]+)`");
  const std::set<std::string> where_they_apply{"unconfirmed", "refuted", "tracking"};
  int listed = 0;
  bool table = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("| in the JSON |")) table = true;
    else if (!line.starts_with("|")) table = false;
    const std::string cell = line.substr(0, line.find('|', 1));
    for (std::sregex_iterator it(cell.begin(), cell.end(), name), end; table && it != end; ++it, ++listed)
      EXPECT_TRUE(keys.contains((*it)[1]) || where_they_apply.contains((*it)[1])) << (*it)[1];
  }
  EXPECT_GT(listed, 50);
}

TEST_F(ModelOut, OfATorqueThatStopsAtALimit_SaysWhere) {
  double limit = 0;
  const auto clamped = [&](Dataset& d) {
    if (limit == 0) limit = 0.9 * d.tau.col(0).cwiseAbs().maxCoeff();
    for (int k = 0; k < d.samples(); ++k)  // the reading goes on to flicker: one that stands still is refused as dead
      d.tau(k, 0) = std::clamp(d.tau(k, 0), -limit, limit) + 0.1 * std::sin(2.7 * k);
  };
  Diagnose("limit", clamped, clamped);
  ExpectARemedyFor("torque_saturation");
}

TEST_F(ModelOut, OfATorqueWithAWrongScale_SaysWhichNumberIsOff) {
  const auto scaled = [](Dataset& d) { d.tau.col(1) *= 1.25; };
  Diagnose("gain", scaled, scaled);
  ExpectARemedyFor("torque_gain_error");
}

// What the held-out log refutes is in no model, and text, JSON and page say who got worse, and by how much.
TEST_F(ModelOut, OfATermThatTheHeldOutLogRefutes_SaysWhichJointRefutesIt) {
  Diagnose("refuted", [](Dataset& d) { d.tau.col(1).array() += 0.1; }, {});
  ASSERT_EQ(verdict_.at("terms").size(), 1u) << said_.out;
  const nlohmann::json why = verdict_["terms"][0].at("refuted");
  EXPECT_EQ(why.at("joint"), 2);
  EXPECT_EQ(why.at("without_it"), "the declared model");
  EXPECT_GT(why.at("factor").get<double>(), 1.005);
  EXPECT_NEAR(why["rms_without"][1].get<double>(), verdict_["before_moving"][1].get<double>(), 1e-12);
  EXPECT_EQ(verdict_["after_moving"], verdict_["before_moving"]);
  std::ostringstream figures;
  figures << std::setprecision(4) << why["rms_with"][1].get<double>() << " instead of "
          << why["rms_without"][1].get<double>() << " N m";
  const std::string words = "joint 2 is predicted worse with it than by the declared model: " + figures.str();
  EXPECT_NE(said_.out.find("refuted on the held-out log: " + words), std::string::npos) << said_.out;
  EXPECT_NE(ReadText(Path("page.html")).find(words), std::string::npos);
  EXPECT_EQ(ReadText(Path("new.toml")).find("[[effect]]"), std::string::npos);
}

// Noise of the positions is in the derived accelerations and their columns, unless the derivation ends below it.
TEST_F(ModelOut, OfANoisyPosition_SaysThatLeastSquaresIsBiased_UntilTheCutoffIsLower) {
  const auto noisy = [](Dataset& d) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> noise(0, 2e-5);
    for (double& q : d.s.q.reshaped()) q += noise(random);
  };
  for (const double cutoff_Hz : {49.0, 5.0}) {  // motion ends at 0.5 Hz; its turns, where friction jumps, do not
    Diagnose("noisy", noisy, noisy, {"--cutoff", std::to_string(cutoff_Hz)});
    if (HasFatalFailure()) return;
    EXPECT_EQ(verdict_.at("cutoff_Hz"), nlohmann::json({{cutoff_Hz, cutoff_Hz}}));
    EXPECT_TRUE(verdict_.at("terms").empty() && verdict_.at("torque_channel").empty()) << said_.out;
    const nlohmann::json e = verdict_.at("exogeneity");
    const bool biased = cutoff_Hz > 20;
    EXPECT_EQ(e.at("instruments"), "smoothed positions");
    EXPECT_EQ(e.at("passed").get<bool>(), !biased) << said_.out;
    ASSERT_EQ(e.at("joints").size(), 2u);
    for (const auto& j : e["joints"]) EXPECT_TRUE(j.at("told").get<bool>());
    const std::string page = ReadText(Path("page.html"));
    for (const std::string& text : {said_.out, page}) {
      EXPECT_EQ(text.find("FAILS on joint") != text.npos, biased) << text;
      EXPECT_EQ(text.find("armcal identify --method instrumental_variable") != text.npos, biased) << text;
    }
  }
}

// The command that tells a ripple from its runner-up can be run as it stands, and searches for the ripple that was
// found.
TEST_F(ModelOut, OfARipple_TheCommandThatSeparatesIt_TakesWhatWasFound) {
  const auto ripple = [](Dataset& d) {
    for (int k = 0; k < d.samples(); ++k) d.tau(k, 1) += 0.3 * std::cos(12 * d.s.q(k, 1));
  };
  Diagnose("ripple", ripple, ripple);
  if (HasFatalFailure()) return;
  ASSERT_FALSE(verdict_.at("terms").empty()) << said_.out;
  const nlohmann::json& t = verdict_["terms"][0];
  EXPECT_EQ(t.at("record"), "torque_ripple");
  EXPECT_EQ(t.at("joints"), nlohmann::json({2}));
  EXPECT_NEAR(t.at("unknowns").at("k").get<double>(), 12, 0.1);
  std::string command;
  for (const auto& s : t.at("separate")) command = s.at("command").get<std::string>();
  ASSERT_NE(command.find(" --found " + Path("verdict.json")), std::string::npos) << said_.out;
  std::vector<nlohmann::json> accuracy;
  for (const std::string& shell : {command, std::regex_replace(command, std::regex(" --found [^ ]*"), "")}) {
    std::string words = std::regex_replace(shell, std::regex("^armcal"), ARMCAL_TOOL);
    words = std::regex_replace(words, std::regex("separate.csv"), Path("separate.csv"));
    const Outcome o = RunProgram(
        {"sh", "-c", words + " --no-slow --starts 1 --harmonics 10 --search-seconds 60 --json " + Path("excite.json")});
    ASSERT_EQ(o.code, 0) << o.err;
    accuracy.push_back(ReadJson(Path("excite.json")).at("accuracy"));
  }
  EXPECT_NE(accuracy[0], accuracy[1]);  // one search, one seed: only the ripple's k differs
  const std::string never = Path("never.csv");
  const auto refused = [&](const std::string& effects, const std::string& verdict, const std::string& named) {
    ExpectOneLine(Tool({"excite", "--robot", "two_link", "--separate", effects, "--found", verdict, "--out", never}), 2,
                  named);
    EXPECT_FALSE(fs::exists(never));
  };
  refused("stribeck:1,viscous_cuberoot:1", Path("verdict.json"), "among stribeck:1, viscous_cuberoot:1");
  refused("torque_ripple:2", Path("train.csv"), "train.csv: expected a verdict");
  refused("torque_ripple:2", Path("absent.json"), "absent.json");
}

// A contact says nothing about another log: it is named, stands apart, and moves no error there.
TEST_F(ModelOut, OfAContactInTheTrainingLog_StandsApart) {
  Diagnose("contact",
           [](Dataset& d) {
             for (int k = 0; k < d.samples(); ++k)
               for (const double from : {5.2, 13.1})
                 if (const double u = (d.s.t[k] - from) / 0.4; u > 0 && u < 1)
                   d.tau(k, 1) += 1.5 * std::sin(std::numbers::pi * u);
           },
           {});
  ExpectARemedyFor("external_contact");
  EXPECT_TRUE(verdict_["terms"][0]["training_only"].get<bool>());
  EXPECT_NE(said_.out.find("in the training log only"), std::string::npos) << said_.out;
  for (int j = 0; j < 2; ++j) {
    const double before = verdict_["before_moving"][j], after = verdict_["after_moving"][j];
    EXPECT_LE(after, 1.005 * before);
    EXPECT_LE(after, 1.15 * verdict_["noise_floor"][j].get<double>());
  }
}

}  // namespace
}  // namespace armcal::tests
