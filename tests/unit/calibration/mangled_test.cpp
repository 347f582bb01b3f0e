// calibration tests - mangled logs of a simulated and of a measured arm: each ends in one line or is taken with a note.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "host_sim/identify/calibration/body_check.hpp"
#include "host_sim/identify/calibration/column_check.hpp"
#include "host_sim/identify/calibration/log_check.hpp"
#include "tests/unit/calibration/laden_arm.hpp"
#include "tests/unit/calibration/mangled_logs.hpp"
#include "tests/unit/calibration/measured_arms.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::calibration {
namespace {

namespace fs = std::filesystem;
using tests::Mangled;

struct Said {
  std::string refused, notes;
};

// What every verb asks of a log before it is used.
Said Judge(const codegen::Model& model, const std::vector<logs::Log>& read) {
  Said said;
  try {
    std::vector<Dataset> data;
    for (const logs::Log& log : read) {
      const SignalCheck check = CheckSignals(model.robot(), log);
      for (const std::string& note : check.notes) said.notes += note + "\n";
      if (!check.lack.empty()) throw io::InputError(log.source + ": " + check.lack);
      data.push_back(Prepare(model, log));
    }
    for (const std::string& note : CheckColumns(model, Pointers(data))) said.notes += note + "\n";
    for (const std::string& note : CheckRows(model.robot(), Pointers(data))) said.notes += note + "\n";
    for (const Dataset& d : data) (void)CheckAgainstModel(model, d);
  } catch (const io::InputError& e) {
    said.refused = e.what();
  }
  return said;
}

Said Judge(const codegen::Model& model, const fs::path& path) {
  try {
    return Judge(model, {logs::ReadLog(path)});
  } catch (const io::InputError& e) {
    return {e.what(), ""};
  }
}

void ExpectAllSaid(const codegen::Model& model, const logs::Log& good) {
  const files::test::TemporaryFolder folder;
  const fs::path path = folder / "run.csv";
  for (const Mangled& m : tests::SixAxisFaults()) {
    logs::Log log = good;
    if (!m.speeds) log.qd.resize(0, 0);
    m.mangle(log);
    logs::WriteLog(path, log);
    const Said said = Judge(model, path);
    if (m.said.empty()) {
      EXPECT_EQ(said.refused, "") << m.name;
      EXPECT_NE(said.notes.find(m.note), std::string::npos) << m.name << ": " << said.notes;
      EXPECT_EQ(said.notes.find("suspect"), std::string::npos) << m.name << ": " << said.notes;
      continue;
    }
    EXPECT_NE(said.refused.find(m.said), std::string::npos) << m.name << ": " << said.refused << "\n" << said.notes;
    EXPECT_EQ(said.refused.find(path.string()), 0u) << m.name << ": " << said.refused;
    EXPECT_EQ(said.refused.find('\n'), std::string::npos) << m.name;
  }
}

codegen::Robot WithoutLinkData(codegen::Robot robot) {
  robot.has_prior = false;
  return robot;
}

logs::Log LogOf(const Dataset& d) {
  logs::Log log;
  log.joints = d.joints(), log.source = d.source;
  log.t = d.s.t, log.q = d.s.q, log.qd = d.s.qd, log.tau = d.tau;
  return log;
}

TEST(Mangled, SimulatedSixAxes_WithLinkData) {
  tests::SyntheticArm arm(tests::Er20(), 1);
  ExpectAllSaid(arm.model(), LogOf(arm.Run(20, 2)));
}

TEST(Mangled, SimulatedSixAxes_WithoutLinkData) {
  tests::SyntheticArm arm(tests::Er20(), 1);
  const codegen::Model free(WithoutLinkData(tests::Er20()), tests::Records());
  ExpectAllSaid(free, LogOf(arm.Run(20, 2)));
}

TEST(Mangled, MeasuredUr10e_WithoutLinkData) {
  const fs::path file = tests::MeasuredFile("ur10e/ur-20_02_12-50sec_12harm.csv.gz");
  if (file.empty()) GTEST_SKIP() << "set ARMCAL_DATA to the folder of measured logs";
  const codegen::Model model(tests::Ur10e(), tests::Records());
  logs::Log log = logs::ReadLog(file, tests::Ur10eChannels());
  log.qdd.resize(0, 0), log.gaps.clear();
  ExpectAllSaid(model, log);
}

// One of three logs has two columns exchanged: that one is named.
TEST(Mangled, OneOfSeveralLogs_IsTheOneNamed) {
  tests::SyntheticArm arm(tests::Er20(), 1);
  const codegen::Model free(WithoutLinkData(tests::Er20()), tests::Records());
  std::vector<logs::Log> run;
  for (const int k : {1, 2, 3}) {
    run.push_back(LogOf(arm.Run(15, static_cast<std::uint64_t>(k))));
    run.back().qd.resize(0, 0);
    run.back().source = "run" + std::to_string(k) + ".csv";
  }
  EXPECT_EQ(Judge(free, run).refused, "");
  run[1].tau.col(1).swap(run[1].tau.col(2));
  EXPECT_EQ(Judge(free, run).refused.find("run2.csv: columns tau2 and tau3"), 0u) << Judge(free, run).refused;
}

// A joint that rests while the others move is no fault, alone or among others.
TEST(Mangled, RestingJoints_AreNone) {
  tests::SyntheticArm arm(tests::Er20(), 4);
  const codegen::Model free(WithoutLinkData(tests::Er20()), tests::Records());
  for (const std::vector<int>& still : {std::vector<int>{1}, {0, 2}, {3, 4, 5}}) {
    logs::Log log = LogOf(arm.Run(15, 7, {}, 0.5, still));
    log.qd.resize(0, 0);
    for (const codegen::Model* model : {&free, &arm.model()}) {
      const Said said = Judge(*model, {log});
      EXPECT_EQ(said.refused, "") << still[0];
      EXPECT_EQ(said.notes.find("suspect"), std::string::npos) << said.notes;
    }
  }
}

// The drive takes off more friction than there is. What is left drives the joint, by a twentieth of its torque's
// spread.
TEST(Mangled, FrictionThatDrivesAJointALittle_IsSuspect) {
  tests::SyntheticArm arm(tests::Er20(), 4);
  const codegen::Model free(WithoutLinkData(tests::Er20()), tests::Records());
  constexpr int kJoint = 1;
  constexpr double kShare = 0.05;
  const Dataset well = arm.Run(15, 7);
  const Eigen::VectorXd torque = well.tau.col(kJoint);
  const double spread = std::sqrt((torque.array() - torque.mean()).square().mean());
  const double level = arm.Friction("Fc", kJoint) + kShare * spread, viscous = arm.Friction("Fv", kJoint);
  const Dataset fed = arm.Run(15, 7, [=](const tests::State& s) {
    return s.joint == kJoint ? -std::copysign(level, s.qd) - viscous * s.qd : 0;
  });
  for (const codegen::Model* model : {&free, &arm.model()}) {
    const Said said = Judge(*model, {LogOf(fed)});
    EXPECT_EQ(said.refused, "");
    EXPECT_NE(said.notes.find("joint 2: suspect: friction of"), std::string::npos) << said.notes;
    EXPECT_EQ(Judge(*model, {LogOf(well)}).notes.find("suspect"), std::string::npos);
  }
}

// Runs of arms that are well, and yet unlike the usual one.
struct Healthy {
  std::string name;
  std::function<logs::Log(std::uint64_t seed)> make;
};

std::vector<Healthy> HealthyRuns() {
  const auto plain = [](double seconds, double speed, std::vector<int> still, const tests::Effect& effect = {}) {
    return [=](std::uint64_t seed) {
      tests::SyntheticArm arm(tests::Er20(), seed);
      return LogOf(arm.Run(seconds, seed + 1000, effect, speed, still));
    };
  };
  const auto changed = [](const std::function<void(Dataset&, std::uint64_t)>& change) {
    return [=](std::uint64_t seed) {
      tests::SyntheticArm arm(tests::Er20(), seed);
      Dataset d = arm.Run(15, seed + 1000);
      change(d, seed);
      return LogOf(d);
    };
  };
  return {
      {"as it is", plain(15, 0.5, {})},
      {"slow", plain(20, 0.03, {})},
      {"short", plain(5, 0.5, {})},
      {"one joint rests", plain(15, 0.5, {2})},
      {"three joints rest", plain(15, 0.5, {0, 1, 4})},
      {"only the wrist moves", plain(15, 0.5, {0, 1, 2})},
      {"a payload",
       [](std::uint64_t seed) {
         tests::LadenArm arm(seed, 0.05);
         return LogOf(arm.Run(15, seed + 1000, plant::Body{10, {0.04, -0.03, 0.12}, {0.09, 0, 0, 0.08, 0, 0.05}}));
       }},
      {"friction above all", plain(15, 0.5, {},
                                   [](const tests::State& s) {
                                     const double limit_Nm = tests::Er20().joint[s.joint].torque_limit_Nm;
                                     return 0.4 * limit_Nm * (s.qd > 0 ? 1 : -1) + 0.1 * limit_Nm * s.qd;
                                   })},
      {"motor 6 turned by joint 5, too", changed([](Dataset& d, std::uint64_t) {
         for (int k = 0; k < d.samples(); ++k) {
           const double v = d.s.qd(k, 5) + d.s.qd(k, 4), motor_Nm = 4 * (v > 0 ? 1 : -1) + 2 * v;
           d.tau(k, 5) += motor_Nm, d.tau(k, 4) += motor_Nm;
         }
       })},
      {"another torque scale", changed([](Dataset& d, std::uint64_t seed) { d.tau *= seed % 2 ? 0.85 : 1.2; })},
  };
}

// Healthy logs of simulated arms, with link data and without: at most one in 200 is refused or called suspect.
TEST(Mangled, HealthySimulatedLogs_AreTaken) {
  const char* draws = std::getenv("ARMCAL_DRAWS");
  const int each = draws ? std::atoi(draws) : 1;
  const codegen::Model free(WithoutLinkData(tests::Er20()), tests::Records());
  int taken = 0, doubted = 0;
  for (const Healthy& run : HealthyRuns())
    for (int draw = 0; draw < each; ++draw) {
      logs::Log log = run.make(static_cast<std::uint64_t>(draw));
      log.qd.resize(0, 0);
      for (const codegen::Model* model : {&free, &tests::Er20Model()}) {
        const Said said = Judge(*model, {log});
        const bool suspect = said.notes.find("suspect") != std::string::npos;
        ++(said.refused.empty() && !suspect ? taken : doubted);
        if (!said.refused.empty() || suspect)
          std::printf("%s, draw %d, %s link data: %s\n%s", run.name.c_str(), draw, model == &free ? "no" : "with",
                      said.refused.c_str(), said.notes.c_str());
      }
    }
  std::printf("%d healthy logs taken, %d refused or called suspect\n", taken, doubted);
  EXPECT_LE(200 * doubted, taken + doubted + 199);
}

// All healthy logs that are there: at most one in 200 is refused or called suspect.
TEST(Mangled, HealthyMeasuredLogs_AreTaken) {
  if (tests::MeasuredFile("ur10e").empty()) GTEST_SKIP() << "set ARMCAL_DATA to the folder of measured logs";
  int taken = 0, doubted = 0;
  for (const tests::MeasuredSet& set : tests::MeasuredSets()) {
    const codegen::Model model(set.robot, tests::Records());
    for (const fs::path& file : set.files) {
      Said said;
      try {
        said = Judge(model, {set.channels ? logs::ReadLog(file, *set.channels) : logs::ReadLog(file)});
      } catch (const io::InputError& e) {
        said.refused = e.what();
      }
      const bool suspect = said.notes.find("suspect") != std::string::npos;
      ++(said.refused.empty() && !suspect ? taken : doubted);
      if (!said.refused.empty() || suspect) std::printf("%s\n%s", said.refused.c_str(), said.notes.c_str());
    }
  }
  std::printf("%d healthy logs taken, %d refused or called suspect\n", taken, doubted);
  EXPECT_LE(200 * doubted, taken + doubted + 199);
}

}  // namespace
}  // namespace armcal::calibration
