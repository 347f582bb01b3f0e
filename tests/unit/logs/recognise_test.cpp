// logs tests - the map that is proposed for a log: what is recognised, and what is marked as a guess.
#include "host_sim/data/logs/recognise.hpp"

#include <gtest/gtest.h>

#include "host_sim/data/files/csv.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/log.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::logs {
namespace {

using files::test::TemporaryFolder;
using Texts = std::vector<std::string>;
const std::filesystem::path kLogs = "tests/unit/bags/recordings";

// The log as the proposed map reads it.
Log ByProposal(const std::filesystem::path& path, const Texts& recognised) {
  const TemporaryFolder folder;
  const Proposal proposal = Recognise(LookAt(path, {}), "log", {});
  EXPECT_EQ(proposal.recognised, recognised) << path;
  EXPECT_TRUE(proposal.missing.empty()) << path;
  return ReadLog(path, ReadChannelMap(folder.Write("map.toml", proposal.map)));
}

TEST(Recognise, RecordingsAndMatlab_GiveTheLogOfTheDrive) {
  const Eigen::MatrixXd drive = files::ReadCsv(kLogs / "drive.csv").values;  // t q1 q2 q3 tau1 tau2 tau3
  for (const char* name : {"joint_states_zstd.mcap", "robot_json.mcap", "plain.db3.zst", "types.db3.zst", "drive_5.mat",
                           "drive_4.mat", "drive_73.mat"}) {
    const Log log = ByProposal(kLogs / name, {"q", "tau"});
    ASSERT_EQ(log.joints, 3) << name;
    EXPECT_EQ(log.q, drive.middleCols(1, 3)) << name;
    EXPECT_EQ(log.tau, drive.middleCols(4, 3)) << name;
  }
}

TEST(Recognise, UnitsOfNames_AreCertain_OthersAreGuesses) {
  const TemporaryFolder folder;
  std::string text =
      "stamp_ms,note,axis0_pos_deg,axis1_pos_deg,cmd_pos_0,cmd_pos_1,Torque0,Torque1,motorTemp0,motorTemp1\n";
  for (int k = 0; k < 300; ++k) text += std::to_string(4 * k) + ",x," + std::to_string(k) + ",1,0.5,0.5,3,4,20,21\n";
  const auto path = folder.Write("log.csv", text);
  const std::string map = Recognise(LookAt(path, {}), "log.csv", {}).map;
  const auto has = [&map](const std::string& part) { return map.find(part) != map.npos; };
  EXPECT_TRUE(has("joints = 2\n")) << map;
  EXPECT_TRUE(has("[time]\ncolumn = \"stamp_ms\"\nunit = \"ms\"\n")) << map;
  EXPECT_TRUE(has("[q]\ncolumn = \"axis{0}_pos_deg\"\nunit = \"deg\"\n")) << map;
  EXPECT_TRUE(has("[tau]\ncolumn = \"Torque{0}\"\nunit = \"N*m\"  # guess: no unit in the name\n")) << map;
  EXPECT_TRUE(
      has("[qref]\ncolumn = \"cmd_pos_{0}\"\nunit = \"rad\"  # guess: no unit in the name; the largest value is 0.5\n"))
      << map;
  EXPECT_TRUE(has("[temp]\ncolumn = \"motorTemp{0}\"\n")) << map;
}

TEST(Recognise, NamesInQuotes_AreWrittenSoThatTheMapReadsThem) {
  const TemporaryFolder folder;
  std::string text = "\"time\",\"q1\",\"tau1\"\n";
  for (int k = 0; k < 300; ++k) text += std::to_string(0.004 * k) + "," + std::to_string(0.01 * k) + ",3\n";
  const auto path = folder.Write("log.csv", text);
  const Log log = ReadLog(path, ReadChannelMap(folder.Write("map.toml", Recognise(LookAt(path, {}), "log", {}).map)));
  EXPECT_EQ(log.samples(), 300);
  EXPECT_EQ(log.q(7, 0), 0.07);
}

TEST(Recognise, TimeWithoutAUnit_HasTheOneThatGivesAnUsualRate) {
  const TemporaryFolder folder;
  for (const auto& [step, unit] : {std::pair{"0.004", "s"}, {"4", "ms"}, {"4000", "us"}, {"4000000", "ns"}}) {
    std::string text = "time,q1,tau1\n";
    for (int k = 0; k < 9; ++k) text += std::to_string(k * std::stod(step)) + ",0,0\n";
    const std::string map = Recognise(LookAt(folder.Write("log.csv", text), {}), "log.csv", {}).map;
    EXPECT_NE(
        map.find("unit = \"" + std::string(unit) + "\"  # guess: no unit in the name; with it the log has 250 Hz"),
        map.npos)
        << map;
  }
}

TEST(Recognise, WhatIsNotRecognised_IsLeftToTheUser) {
  const TemporaryFolder folder;
  const Proposal proposal = Recognise(LookAt(folder.Write("log.csv", "a,pos1,b\n1,2,3\n2,3,4\n"), {}), "log.csv", {});
  EXPECT_EQ(proposal.missing, Texts{"tau"});
  EXPECT_NE(proposal.map.find("# [time]: not recognised"), std::string::npos);
  EXPECT_NE(proposal.map.find("# [tau]: not recognised"), std::string::npos);
}

TEST(Recognise, MotorCurrents_AreOfferedAsAComment) {
  const TemporaryFolder folder;
  std::string text = "time,current_position_1,current_position_2,current1,current2,current_limit1\n";
  for (int k = 0; k < 300; ++k) text += std::to_string(0.004 * k) + ",1," + std::to_string(k) + ",3,5,9\n";
  const auto path = folder.Write("log.csv", text);
  const Proposal proposal = Recognise(LookAt(path, {}), "log.csv", {});
  EXPECT_EQ(proposal.missing, Texts{"tau"});
  EXPECT_NE(proposal.map.find("[q]\ncolumn = \"current_position_{}\""), std::string::npos) << proposal.map;
  // What is left to do: the marks away, and a number in the place of each question mark.
  std::string map = proposal.map;
  const std::size_t lines = map.find("# [tau]\n");
  ASSERT_NE(lines, std::string::npos) << map;
  for (std::size_t at; (at = map.find("# ", lines)) != map.npos;) map.erase(at, 2);
  for (std::size_t at; (at = map.find('?', lines)) != map.npos;) map.replace(at, 1, "0.5");
  const Log log = ReadLog(path, ReadChannelMap(folder.Write("map.toml", map)));
  EXPECT_EQ(log.tau(0, 0), 1.5) << map;
  EXPECT_EQ(log.tau(1, 1), 2.5) << map;
}

}  // namespace
}  // namespace armcal::logs
