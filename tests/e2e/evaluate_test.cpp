// end-to-end tests - evaluate and replay judge a given model: figures worked out by hand, and faults that must show.
#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr double kMass = 95, kViscous = 200, kCoulomb = 20, kOffset = -3, kError = 4;

// One axis (codegen/robots/emps.toml) along q = 0.2 + 0.15 sin(2 pi t / 5), 20 s at 500 Hz. The measured force is that
// of the parameters above plus 4 sin(2 pi 20 t) N, which no parameter explains.
fs::path WriteLog(const fs::path& folder) {
  std::ofstream out(folder / "axis.csv");
  out << "t,q1,tau1\n";
  out.precision(12);
  for (int k = 0; k <= 10000; ++k) {
    const double t = k / 500.0, w = 2 * std::numbers::pi / 5;
    const double q = 0.2 + 0.15 * std::sin(w * t), v = 0.15 * w * std::cos(w * t), a = -0.15 * w * w * std::sin(w * t);
    const double force = kMass * a + kViscous * v + (v > 0 ? kCoulomb : -kCoulomb) + kOffset +
                         kError * std::sin(2 * std::numbers::pi * 20 * t);
    out << t << ',' << q << ',' << force << '\n';
  }
  return folder / "axis.csv";
}

fs::path WriteParameters(const fs::path& folder, double coulomb) {
  const nlohmann::json list = {{{"name", "m1R"}, {"value", kMass}},
                               {{"name", "Fv1"}, {"value", kViscous}},
                               {{"name", "Fc1"}, {"value", coulomb}},
                               {{"name", "torque_offset.To1"}, {"value", kOffset}}};
  const fs::path path = folder / ("parameters_" + std::to_string(coulomb) + ".json");
  std::ofstream(path) << nlohmann::json{{"columns", list}};
  return path;
}

// Spread of the force over whole periods, by integration: M a is in quadrature with the rest.
double SpreadOfForce() {
  const double w = 2 * std::numbers::pi / 5, a = kMass * 0.15 * w * w, v = kViscous * 0.15 * w;
  // v and sgn(v) correlate: mean of |cos| is 2 / pi.
  return std::sqrt(0.5 * a * a + 0.5 * v * v + kCoulomb * kCoulomb + 2 * v * kCoulomb * 2 / std::numbers::pi +
                   0.5 * kError * kError);
}

TEST(Evaluate, FiguresAreThoseWorkedOutByHand) {
  const fs::path folder = FreshFolder("evaluate"), log = WriteLog(folder), json = folder / "out.json";
  const Outcome o = Tool({"evaluate", "--robot", "emps", "--table", WriteParameters(folder, kCoulomb).string(),
                          log.string(), "--band", "5", "--json", json.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  const nlohmann::json figures = ReadJson(json).at("logs").at(0);
  const double root = std::sqrt(0.5);
  // Turns are the only place where the derived speed may take the wrong sign: a few samples of 40 N.
  EXPECT_NEAR(figures.at("nrmse")[0].get<double>(), kError * root / SpreadOfForce(), 0.01);
  EXPECT_NEAR(figures.at("r2")[0].get<double>(), 1 - std::pow(kError * root / SpreadOfForce(), 2), 0.003);
  EXPECT_NEAR(figures.at("rms_moving")[0].get<double>(), kError * root, 0.1);
  EXPECT_LT(figures.at("rms_moving_in_band")[0].get<double>(), 0.5);  // 20 Hz is outside of the band
}

TEST(Evaluate, AWrongParameter_ShowsAtItsSize) {
  const fs::path folder = FreshFolder("evaluate_wrong"), log = WriteLog(folder), json = folder / "out.json";
  const Outcome o = Tool({"evaluate", "--robot", "emps", "--table", WriteParameters(folder, kCoulomb + 5).string(),
                          log.string(), "--json", json.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NEAR(ReadJson(json).at("logs").at(0).at("rms_moving")[0].get<double>(), std::sqrt(25 + 0.5 * kError * kError),
              0.1);
}

TEST(Evaluate, TheJsonOfIdentify_GivesItsOwnHeldOutErrors) {
  const fs::path folder = FreshFolder("evaluate_same"), log = WriteLog(folder), fit = folder / "fit.json",
                 json = folder / "out.json";
  ASSERT_EQ(
      Tool({"identify", "--robot", "emps", "--train", log.string(), "--test", log.string(), "--json", fit.string()})
          .code,
      0);
  ASSERT_EQ(Tool({"evaluate", "--robot", "emps", "--table", fit.string(), log.string(), "--json", json.string()}).code,
            0);
  const nlohmann::json expected = ReadJson(fit).at("held_out"), found = ReadJson(json).at("logs").at(0);
  for (const char* key : {"rms", "rms_moving", "relative_moving", "nrmse", "r2"})
    EXPECT_DOUBLE_EQ(found.at(key)[0].get<double>(), expected.at(key)[0].get<double>()) << key;
}

TEST(Evaluate, WhatCannotBeAModelOfThisArm_IsRefusedInOneLine) {
  const fs::path folder = FreshFolder("evaluate_refused"), log = WriteLog(folder);
  ExpectOneLine(Tool({"evaluate", "--robot", "emps", log.string()}), 2, "prior");
  ExpectOneLine(Tool({"evaluate", log.string()}), 2, "--robot");
  const std::string wrong = WriteParameters(folder, kCoulomb).string();
  ExpectOneLine(Tool({"evaluate", "--robot", "two_link", "--table", wrong, log.string()}), 2, "missing");
  std::ofstream(folder / "other.json") << R"({"columns": [{"name": "m1R", "value": 1}, {"name": "Qx", "value": 2}]})";
  ExpectOneLine(Tool({"evaluate", "--robot", "emps", "--table", (folder / "other.json").string(), log.string()}), 2,
                "Qx");
  std::ofstream(folder / "no.json") << "{ this is none";
  ExpectOneLine(Tool({"evaluate", "--robot", "emps", "--table", (folder / "no.json").string(), log.string()}), 2,
                "no.json");
}

TEST(Replay, WritesErrorsAndParametersThatTableTakes) {
  const fs::path folder = FreshFolder("replay"), log = WriteLog(folder), json = folder / "out.json",
                 again = folder / "again.json";
  const Outcome o = Tool({"replay", "--robot", "emps", "--refine", log.string(), "--period", "5", "--segment", "2.5",
                          "--tries", "1", log.string(), "--json", json.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  const nlohmann::json refined = ReadJson(json);
  const Outcome same =
      Tool({"replay", "--robot", "emps", "--table", json.string(), log.string(), "--json", again.string()});
  ASSERT_EQ(same.code, 0) << same.err;
  EXPECT_EQ(ReadJson(again).at("logs"), refined.at("logs"));
  // 4 N at 20 Hz move 95 kg by 4 / 95 / (2 pi 20)^2 = 3 um; friction at the turns is all that can add up: 0.1 N over a
  // second of the 25 moves 95 kg by half a millimetre.
  EXPECT_LT(refined.at("logs").at(0).at("rms")[0].get<double>(), 3e-3);
  ExpectOneLine(Tool({"replay", "--robot", "emps", "--refits", "2", log.string()}), 2, "--refine");
}

// The first log has two seconds: it is left out, and the second one is fitted as if it were alone.
TEST(Replay, ALogThatIsTooShortToTrain_ChangesNothing) {
  const fs::path folder = FreshFolder("replay_short"), log = WriteLog(folder), cut = folder / "short.csv";
  std::ifstream in(log);
  std::ofstream out(cut);
  std::string line;
  for (int k = 0; k <= 1000 && std::getline(in, line); ++k) out << line << '\n';
  out.close();
  const auto refined = [&](std::vector<std::string> train) {
    const fs::path json = folder / "out.json";
    std::vector<std::string> words{"replay",    "--robot", "emps",    "--json", json.string(), log.string(),
                                   "--segment", "2.5",     "--tries", "1",      "--refine"};
    words.insert(words.end(), train.begin(), train.end());
    const Outcome o = Tool(words);
    EXPECT_EQ(o.code, 0) << o.err;
    return ReadJson(json);
  };
  EXPECT_EQ(refined({cut.string(), log.string()}), refined({log.string()}));
}

}  // namespace
}  // namespace armcal::tests
