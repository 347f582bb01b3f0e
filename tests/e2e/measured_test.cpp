// end-to-end tests - compare the verbs on public measured logs with published parameters and a bar of our own.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <numeric>
#include <set>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

// The folder of one measured set; empty if there is none here.
fs::path Measured(const std::string& set) {
  const char* data = std::getenv("ARMCAL_DATA");
  if (data == nullptr) return {};
  const fs::path folder = fs::path(data) / "measured" / set;
  return fs::is_directory(folder) ? folder : fs::path();
}

#define SKIP_WITHOUT(folder, set) \
  if ((folder).empty()) GTEST_SKIP() << "measured logs of " << (set) << ": set ARMCAL_DATA to the folder that has them"

TEST(Measured, Kr300_HeldOutError_StaysWithinATenthOfItsReference) {
  const fs::path data = Measured("kuka_kr300");
  SKIP_WITHOUT(data, "kuka_kr300");
  const fs::path json = FreshFolder("kr300_identify") / "out.json";
  const Outcome o = Tool({"identify", "--robot", "kuka_kr300", "--channels", "host_sim/data/channels/kuka_kr300.toml",
                          "--train", (data / "run_A.csv.gz").string(), (data / "run_B.csv.gz").string(), "--test",
                          (data / "run_C.csv.gz").string(), "--band", "20", "--json", json.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  // Relative error below 20 Hz where the joint moves: this project's own bar for the set, not a published figure.
  const double reference[] = {0.060, 0.058, 0.038, 0.182, 0.080, 0.136};
  const auto band = ReadJson(json).at("held_out").at("relative_moving_in_band").get<std::vector<double>>();
  ASSERT_EQ(band.size(), 6u);
  for (int j = 0; j < 6; ++j) {
    std::printf("joint %d: %.2f %%, reference %.1f %%\n", j + 1, 100 * band[j], 100 * reference[j]);
    EXPECT_LE(band[j], 1.10 * reference[j]) << "joint " << j + 1;
  }
}

// The same arm by hand: a low-pass of 8 Hz over torque and prediction, then least squares. Load friction on joints 2
// and 3 halves their error, friction below linear in speed takes a third off joint 1, and nothing else is worth a term
// there. What friction does near turns looks like the kinds that must not be named.
TEST(Measured, Ur10e_WithDefaultOptions_NamesLoadFrictionAndHysteresis_AndNoBeltOrDelay) {
  const fs::path data = Measured("ur10e");
  SKIP_WITHOUT(data, "ur10e");
  const fs::path json = FreshFolder("ur10e") / "out.json";
  const Outcome o =
      Tool({"diagnose", "--robot", "tests/e2e/ur10e.toml", "--channels", "tests/e2e/ur10e_channels.toml", "--train",
            (data / "ur-20_02_12-50sec_12harm.csv.gz").string(), (data / "ur-20_02_10-30sec_12harm.csv.gz").string(),
            "--test", (data / "ur-20_02_12-40sec_12harm.csv.gz").string(), "--json", json.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  bool below_linear = false;
  int near_turns = 0;
  const std::set<std::string> imitates = {"belt_elasticity",   "time_delay", "external_contact", "backlash",
                                          "torque_gain_error", "base_tilt",  "meshing_friction"};
  std::map<std::string, double> mu;
  const nlohmann::json verdict = ReadJson(json);
  EXPECT_TRUE(verdict.at("payload").is_null());
  for (const auto& term : verdict.at("terms")) {
    const std::string kind = term.at("kind");
    const nlohmann::json& where = term.at("joint");
    const std::string joint = where.is_string() ? where.get<std::string>() : std::to_string(where.get<int>());
    if (kind == "load_friction" && term.at("confirmed")) mu[joint] = term.at("parameters").begin()->get<double>();
    below_linear |=
        joint == "1" && (kind.starts_with("viscous_") || kind == "stribeck" || kind.starts_with("friction_"));
    near_turns += kind == "hysteresis" && term.at("confirmed");
    EXPECT_FALSE(imitates.contains(kind)) << kind << " " << joint;
  }
  EXPECT_TRUE(below_linear);
  EXPECT_GE(near_turns, 5);
  for (const char* joint : {"2", "3"}) {
    ASSERT_TRUE(mu.contains(joint)) << "load friction on joint " << joint;
    EXPECT_NEAR(mu[joint], 0.064, 0.004);  // least squares by hand: 0.0642 and 0.0635
  }
}

// 2.805 kg: the source's figure. By hand the payload comes out as 2.9 to 3.1 kg, because the drive gains of the source
// are 5 to 12 % too large for that mass.
void ExpectPayload(const fs::path& data, const std::vector<std::pair<std::string, std::string>>& runs) {
  const fs::path json = FreshFolder("ur10e_payload_" + std::to_string(runs.size())) / "out.json";
  for (const auto& [train, test] : runs) {
    const Outcome o = Tool({"diagnose", "--robot", "tests/e2e/ur10e.toml", "--channels",
                            "tests/e2e/ur10e_channels.toml", "--train", (data / (train + ".csv.gz")).string(), "--test",
                            (data / (test + ".csv.gz")).string(), "--json", json.string()});
    ASSERT_EQ(o.code, 0) << o.err;
    const nlohmann::json payload = ReadJson(json).at("payload");
    ASSERT_FALSE(payload.is_null()) << test;
    EXPECT_EQ(payload.at("place"), "flange");
    EXPECT_FALSE(payload.at("gain_tolerance_stated"));
    EXPECT_EQ(payload.at("gain_tolerance"), 0.1);
    EXPECT_LE(payload.at("mass_interval_kg")[0].get<double>(), 2.805) << test;
    EXPECT_GE(payload.at("mass_interval_kg")[1].get<double>(), 2.805) << test;
    const auto with = payload.at("relative_with").get<std::vector<double>>(),
               without = payload.at("relative_without").get<std::vector<double>>();
    const double mean = std::accumulate(with.begin(), with.end(), 0.0) / 6;
    std::printf("%s: mean error %.2f %% with the payload of the other half, %.1f %% without it\n", test.c_str(),
                100 * mean, 100 * std::accumulate(without.begin(), without.end(), 0.0) / 6);
    EXPECT_LE(mean, 0.065) << test;
    EXPECT_NE(o.out.find("payload at the flange"), std::string::npos);
    EXPECT_NE(o.out.find("mass is known only up to the torque scale"), std::string::npos);
    EXPECT_NE(o.out.find("without it"), std::string::npos);
  }
}

TEST(Measured, Ur10e_PayloadOfTheHeldOutRun_IsNamedAndItsIntervalHoldsTheMass) {
  const fs::path data = Measured("ur10e");
  SKIP_WITHOUT(data, "ur10e");
  ExpectPayload(data, {{"ur-20_02_19_14harm50sec", "ur-20_02_19_15harm50secLoad"}});
}

TEST(LongMeasured, Ur10e_PayloadOfOtherRuns_IsNamedAndItsIntervalHoldsTheMass) {
  const fs::path data = Measured("ur10e");
  SKIP_WITHOUT(data, "ur10e");
  ExpectPayload(
      data, {{"ur-20_02_19_14harm50sec", "ur-20_02_19_14harm50secLoad"}, {"ur-20_01_31-unload", "ur-20_01_31-load"}});
}

void ExpectNoPayload(const fs::path& data, const std::vector<std::string>& runs) {
  const fs::path json = FreshFolder("ur10e_bare_" + std::to_string(runs.size())) / "out.json";
  for (const std::string& test : runs) {
    const Outcome o =
        Tool({"diagnose", "--robot", "tests/e2e/ur10e.toml", "--channels", "tests/e2e/ur10e_channels.toml", "--train",
              (data / "ur-20_02_12-50sec_12harm.csv.gz").string(), (data / "ur-20_02_10-30sec_12harm.csv.gz").string(),
              "--test", (data / (test + ".csv.gz")).string(), "--json", json.string()});
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(ReadJson(json).at("payload").is_null()) << test;
    EXPECT_EQ(o.out.find("payload at the flange"), std::string::npos) << test;
  }
}

TEST(Measured, Ur10e_RunWithoutAPayload_IsSaidToCarryNone) {
  const fs::path data = Measured("ur10e");
  SKIP_WITHOUT(data, "ur10e");
  ExpectNoPayload(data, {"ur-20_02_19_15harm50sec"});
}

TEST(LongMeasured, Ur10e_OtherRunsWithoutAPayload_AreSaidToCarryNone) {
  const fs::path data = Measured("ur10e");
  SKIP_WITHOUT(data, "ur10e");
  ExpectNoPayload(data, {"ur-20_01_17-ptp_10_points", "ur-20_02_05-20sec_8harm", "ur-20_02_06-20sec_10harm",
                         "ur-20_02_19_14harm50sec", "ur-20_01_31-unload"});
}

TEST(Measured, Emps_GivesThePublishedParameters) {
  const fs::path data = Measured("emps");
  SKIP_WITHOUT(data, "emps");
  const fs::path json = FreshFolder("emps") / "out.json";
  const Outcome o = Tool({"identify", "--robot", "emps", "--channels", "host_sim/data/channels/emps.toml", "--train",
                          (data / "emps_ident.csv.gz").string(), "--json", json.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  struct Published {
    std::string name;
    double value, tolerance;
  };
  const std::vector<Published> published{
      {"m1R", 95.1089, 0.03}, {"Fv1", 203.5034, 0.03}, {"Fc1", 20.3935, 0.03}, {"torque_offset.To1", -3.1648, 0.05}};
  std::size_t found = 0;
  const nlohmann::json identified = ReadJson(json);
  for (const auto& column : identified.at("columns"))
    for (const Published& p : published)
      if (column.at("name") == p.name) {
        ++found;
        std::printf("%s: %.4f, published %.4f\n", p.name.c_str(), column.at("value").get<double>(), p.value);
        EXPECT_NEAR(column.at("value").get<double>(), p.value, p.tolerance * std::abs(p.value)) << p.name;
      }
  EXPECT_EQ(found, published.size());
}

TEST(LongMeasured, Kr300_DiagnosisWritesTheWholeVerdict) {
  const fs::path data = Measured("kuka_kr300");
  SKIP_WITHOUT(data, "kuka_kr300");
  const fs::path folder = FreshFolder("kr300_diagnose");
  const Outcome o = Tool({"diagnose", "--robot", "kuka_kr300", "--channels", "host_sim/data/channels/kuka_kr300.toml",
                          "--train", (data / "run_A.csv.gz").string(), (data / "run_B.csv.gz").string(), "--test",
                          (data / "run_C.csv.gz").string(), "--json", (folder / "out.json").string(), "--report",
                          (folder / "out.html").string(), "--model-out", (folder / "new.toml").string()});
  ASSERT_EQ(o.code, 0) << o.err;
  const nlohmann::json v = ReadJson(folder / "out.json");
  EXPECT_TRUE(v.at("verdict") == "none" || v.at("verdict") == "effect");
  EXPECT_EQ(v.at("joint_base"), 1);
  EXPECT_GE(v.at("seconds").get<double>(), 0);
  for (const char* key : {"before", "after", "before_moving", "after_moving", "moving_share", "noise_floor",
                          "noise_innovation", "smallest_detectable"}) {
    ASSERT_EQ(v.at(key).size(), 6u) << key;
    for (const auto& x : v.at(key)) EXPECT_TRUE(x.is_number() && x.get<double>() > 0) << key;
  }
  for (const auto& term : v.at("terms")) {
    EXPECT_TRUE(term.at("kind").is_string() && term.at("signals").is_array() && term.at("parameters").is_object());
    EXPECT_TRUE(term.at("also_fits").is_array() && term.at("confirmed").is_boolean());
    EXPECT_TRUE(term.contains("joint"));
    std::printf("%s, joint %s, confirmed %s\n", term.at("kind").get<std::string>().c_str(),
                term.at("joint").dump().c_str(), term.at("confirmed").dump().c_str());
  }
  // What worsens a joint of its own, or all joints together, is not confirmed.
  std::set<int> own;
  for (const auto& term : v.at("terms"))
    if (term.at("confirmed").get<bool>())
      for (const auto& j : term.at("joints")) own.insert(j.get<int>());
  double product = 1;
  for (int j = 0; j < 6; ++j) {
    const double change = v.at("after_moving")[j].get<double>() / v.at("before_moving")[j].get<double>();
    if (own.contains(j + 1)) {
      EXPECT_LE(change, 1.005) << j + 1;
    }
    product *= change;
  }
  EXPECT_LE(product, 1.005);
  std::ifstream page(folder / "out.html");
  const std::string report(std::istreambuf_iterator<char>(page), {});
  EXPECT_NE(report.find("</html>"), std::string::npos);
  for (const auto& term : v.at("terms")) EXPECT_NE(report.find(term.at("kind").get<std::string>()), std::string::npos);
  const Outcome again = Tool({"identify", "--robot", (folder / "new.toml").string(), "--channels",
                              "host_sim/data/channels/kuka_kr300.toml", "--train", (data / "run_A.csv.gz").string()});
  EXPECT_EQ(again.code, 0) << again.err;  // the new robot file is one that the tool itself can read
}

// host_sim/findings.sh: every run held out once. docs/findings.md claims nothing. With free bodies a term of the LWR4's
// joint 7 holds.
TEST(LongMeasured, Findings_AreWhatThePageSays) {
  for (const char* set : {"emps", "kuka_kr300", "kuka_lwr4"}) SKIP_WITHOUT(Measured(set), set);
  const fs::path out = FreshFolder("findings");
  const Outcome o =
      RunProgram({"env", std::string("ARMCAL=") + ARMCAL_TOOL, "bash", "host_sim/findings.sh", out.string()});
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  for (const char* model : {"emps", "kuka_kr300", "kuka_lwr4"})
    EXPECT_TRUE(ReadJson(out / (std::string(model) + ".json")).at("holds").empty()) << model;
  for (const auto& held : ReadJson(out / "kuka_lwr4_free.json").at("holds")) EXPECT_EQ(held.at("joint"), "7");
  // Joint 6 of the LWR4: the ripple that runs 1 and 2 confirm lowers its error by a quarter and more.
  const nlohmann::json found = ReadJson(out / "kuka_lwr4.json");
  for (const char* run : {"measurements_1", "measurements_2"}) {
    const auto before = found.at("splits").at(run).at("before_moving"), after = found["splits"][run].at("after_moving");
    EXPECT_LT(after[5].get<double>(), 0.75 * before[5].get<double>()) << run;
  }
  // Runs 1 and 2 are one trajectory: neither is trained on when the other is held out.
  EXPECT_EQ(found.at("splits").at("measurements_1").at("train"), nlohmann::json({"measurements_3"}));
  EXPECT_EQ(found.at("splits").at("measurements_2").at("train"), nlohmann::json({"measurements_3"}));
  for (const char* picture :
       {"emps_errors.svg", "kuka_kr300_errors.svg", "kuka_lwr4_errors.svg", "kuka_lwr4_free_errors.svg"})
    EXPECT_LT(fs::file_size(out / picture), 150000u) << picture;
}

}  // namespace
}  // namespace armcal::tests
