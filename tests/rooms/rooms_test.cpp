// rooms - keeps the edges between the rooms, the first lines, the macros and the text of the whole project.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "tests/rooms/house.hpp"

namespace armcal::house {
namespace {

namespace fs = std::filesystem;

const std::string kLib = "lib/armcal/", kCode = "codegen/src/", kHost = "host_sim/";

// clang-format off
const Edges kEdges = {
    // The firmware library. Model and filter meet in estimator only. armcal.hpp is the entry of all.
    {"lib/armcal",             {kLib}},
    {"lib/armcal/core",        {}},
    {"lib/armcal/math",        {}},
    {"lib/armcal/model",       {kLib + "core", kLib + "math"}},
    {"lib/armcal/signal",      {kLib + "math", kLib + "model"}},
    {"lib/armcal/filter",      {kLib + "core", kLib + "math"}},
    {"lib/armcal/physical",    {kLib + "core", kLib + "math", kLib + "model"}},
    {"lib/armcal/feedforward", {kLib + "core", kLib + "model"}},
    {"lib/armcal/monitor",     {kLib + "math"}},
    {"lib/armcal/estimator",   {kLib + "core", kLib + "math", kLib + "model", kLib + "signal", kLib + "filter",
                                kLib + "physical", kLib + "monitor"}},
    {"lib/armcal/hardware",    {kLib + "core"}},
    {"lib/armcal/table",       {kLib + "core", kLib + "hardware"}},
    {"lib/armcal/link",        {kLib + "core", kLib + "hardware", kLib + "table"}},
    {"lib/armcal/controller",  {kLib}},  // introduces the rooms to each other

    // Targets fill the hardware's contracts; a board.hpp gives them the names of the README's example.
    {"port/linux",             {kLib + "core", kLib + "hardware"}},
    {"port/mps2",              {kLib + "core", kLib + "hardware"}},
    {"port/template",          {kLib + "core", kLib + "hardware", kLib + "controller"}},
    {"port/runner",            {"port/mps2"}},  // what a test program needs of its machine
    {"port/mps2/application",  {kLib, kLib + "armcal.hpp", "codegen/generated/", "port/mps2"}},

    // The generator prints includes of lib but uses none; its output sees numbers only.
    {"codegen/generated/",     {kLib + "math", kLib + "model", kLib + "link/registers.hpp"}},
    {"codegen/src/io",         {}},
    {"codegen/src/robot",      {kCode + "io"}},
    {"codegen/src/generator",  {kCode + "io", kCode + "robot"}},
    {"codegen/src/generate",   {kCode + "io", kCode + "generator"}},

    // Data: what is read and what is shown.
    {"host_sim/data/files",    {kCode + "io", kLib + "core"}},
    {"host_sim/data/bags",     {kCode + "io", kHost + "data/files"}},
    {"host_sim/data/logs",     {kCode + "io", kHost + "data/files", kHost + "data/bags"}},
    {"host_sim/data/trajectory", {kCode + "io", kHost + "data/files"}},
    {"host_sim/data/report",   {kCode + "io", kHost + "data/files"}},

    // Identify: parameters from logs, and the motions that show them.
    {"host_sim/identify/search", {kCode + "io"}},  // minimises functions of numbers; the only room that sees pagmo
    {"host_sim/identify/collision", {kCode}},  // distances of solids; the only room that sees FCL and Assimp
    {"host_sim/identify/excitation", {kCode, kHost + "data/trajectory", kHost + "identify/search", kHost + "identify/collision"}},
    {"host_sim/identify/calibration", {kCode, kHost + "data/files", kHost + "data/logs", kLib + "math", kLib + "model"}},
    {"host_sim/identify/methods", {kCode, kHost + "data/logs", kHost + "identify/search", kHost + "identify/calibration"}},
    {"host_sim/identify/description", {kCode, kHost + "identify/calibration"}},  // the identified arm for other programs
    {"host_sim/identify/choice", {kCode, kHost + "identify/calibration", kHost + "identify/methods"}},
    {"host_sim/identify/replay", {kCode, kHost + "data/logs", kHost + "identify/calibration", kHost + "identify/methods"}},

    // Diagnose: causes of what the model leaves, and how a person is told.
    {"host_sim/diagnose/diagnosis", {kCode, kHost + "identify/calibration", kHost + "identify/methods"}},
    {"host_sim/diagnose/verdict", {kCode, kHost + "data/files", kHost + "data/logs", kHost + "data/report",
                                   kHost + "identify/excitation", kHost + "identify/calibration", kHost + "identify/methods",
                                   kHost + "diagnose/diagnosis"}},
    // From logs to the JSON of a verb; from a robot to that of excite.
    {"host_sim/diagnose/analysis", {kCode, kHost + "data/logs", kHost + "identify/collision", kHost + "identify/excitation",
                                    kHost + "identify/calibration", kHost + "identify/methods", kHost + "diagnose/diagnosis",
                                    kHost + "diagnose/verdict"}},
    {"host_sim/diagnose/fleet", {kCode + "io", kHost + "data/files", kHost + "data/report"}},  // verdicts of many arms over time
    {"host_sim/diagnose/health", {kHost + "client"}},  // a drive's statistics -> a verdict

    // Client: what talks to a drive.
    {"host_sim/client",        {kCode, kHost + "data/files", kHost + "data/logs", kHost + "data/trajectory",
                                kHost + "data/report", kLib + "core", kLib + "controller", kLib + "link"}},

    // Machine: the simulated arm, and lib running on a PC. The plant sees neither the generator nor lib: it is the truth
    // that the others are judged by.
    {"host_sim/machine/plant", {kCode + "io"}},
    {"host_sim/machine/drive", {kHost + "machine/plant", kHost + "client/vendor_registers.hpp", kHost + "client/key_file.hpp",
                                kHost + "data/trajectory", "port/linux", kCode + "io",
                                kCode + "robot", kLib}},
    {"host_sim/machine/estimate", {kLib}},

    // Study: the survey's tables and the benchmarks. No user of the product runs them.
    {"host_sim/study/survey",  {kCode, kHost + "data/", kHost + "identify/", kHost + "machine/plant", "codegen/generated/",
                                kLib}},  // its online table judges the firmware's own estimator
    // A program of its own flags: headers that stand alone only.
    {"host_sim/study/bench",   {kHost + "identify/calibration", "codegen/generated/", kLib + "math", kLib + "model"}},
    {"host_sim/tool",          {kHost, kCode, kLib}},
    {"host_sim/python",        {kCode + "io", kCode + "generator", kHost + "data/logs", kHost + "data/trajectory",
                                kHost + "identify/calibration",
                                kHost + "diagnose/verdict", kHost + "diagnose/analysis"}},

    // Tests may look everywhere; nothing may look into tests.
    {"tests/",                 {kLib, kLib + "eigen.hpp", "port/", "codegen/", "host_sim/"}},
};
// clang-format on

const Selected kSelected = {{"model.hpp", "codegen/generated/er20_like/model.hpp"},
                            {"selected_model.hpp", "codegen/generated/er20_like/selected_model.hpp"},
                            {"board.hpp", "port/mps2/application/board.hpp"}};

std::string Lines(const std::vector<std::string>& found) {
  std::string text;
  for (const std::string& line : found) text += "\n  " + line;
  return text;
}

// CTest runs this in the top folder.
fs::path Top() { return fs::current_path(); }

TEST(Rooms, EveryInclude_FollowsAnEdgeOfTheTable) {
  const auto found = CheckIncludes(Top(), kEdges, kSelected);
  EXPECT_TRUE(found.empty()) << Lines(found);
}

TEST(Rooms, EveryEdgeOfTheTable_IsUsed) {
  const auto found = UnusedEdges(Top(), kEdges, kSelected);
  EXPECT_TRUE(found.empty()) << Lines(found);
}

// Where the picture of DESIGN.md draws a room: the first level of host_sim, else the top folder.
std::string Drawn(const std::string& room) {
  if (room == kHost) return "host_sim";
  if (room.rfind(kHost, 0) == 0) return room.substr(0, room.find('/', kHost.size()));
  return room.rfind("codegen/generated", 0) == 0 ? "codegen/generated" : room.substr(0, room.find('/'));
}

TEST(Rooms, ThePicture_ShowsTheEdgesOfTheTable) {
  std::set<std::string> expected, found;
  for (const auto& [room, may] : kEdges)
    for (const std::string& other : may) {
      const std::string from = Drawn(room), to = Drawn(other);
      if (from != to && from != "tests" && to != "host_sim") expected.insert('"' + from + "\" -> \"" + to + '"');
    }
  std::ifstream file("docs/rooms.dot");
  ASSERT_TRUE(file) << "run this in the top folder";
  for (std::string line; std::getline(file, line);) {
    const auto first = line.find('"');
    if (line.find("->") != line.npos) found.insert(line.substr(first, line.find(';') - first));
  }
  EXPECT_EQ(found, expected);
}

TEST(Rooms, FirmwareRooms_UseNoHeaderThatBringsAHeapOrAStream) {
  auto found = CheckSystemHeaders(
      Top(), {"lib/", "codegen/generated/", "port/mps2/", "port/template/"},
      {"array", "atomic", "cmath", "cstddef", "cstdint", "cstring", "limits", "tuple", "type_traits", "utility"});
  // Optional, and included by no other header; a link without a heap proves it.
  EXPECT_EQ(std::erase_if(found,
                          [](const std::string& line) {
                            return line.starts_with("lib/armcal/eigen.hpp:") && line.ends_with("<Eigen/Core>");
                          }),
            1u);
  EXPECT_TRUE(found.empty()) << Lines(found);
}

TEST(Rooms, FirstLine_SaysTheRoomAndWhatTheFileIsFor) {
  const auto found = CheckFirstLines(Top());
  EXPECT_TRUE(found.empty()) << Lines(found);
}

TEST(Rooms, Macros_AreTenAtMost) {
  const auto macros = Macros(Top(), "ARMCAL_");
  EXPECT_LE(macros.size(), 10u) << Lines(macros);
}

// In two halves, so that this file does not name them itself.
std::vector<std::string> Forbidden() {
  const std::pair<const char*, const char*> halves[] = {
      {"/wo", "rk/"},         {"/ro", "ot/"},    {"/ho", "me/"},       {"deb.deb", "ian.org"}, {"pypi", ".org"},
      {"registry.np", "mjs"}, {"cra", "tes.io"}, {"proxy.go", "lang"}, {"artif", "actory"}};
  std::vector<std::string> whole;
  for (const auto& [first, second] : halves) whole.push_back(std::string(first) + second);
  return whole;
}

TEST(Rooms, NoFile_NamesAPathOfAMachineOrAPackageHost) {
  const auto found = CheckText(Top(), Forbidden());
  EXPECT_TRUE(found.empty()) << Lines(found);
}

// A small house in a temporary folder, with one thing wrong in it.
class PlantedViolation : public testing::Test {
 protected:
  PlantedViolation() {
    std::string name = (fs::temp_directory_path() / "armcal_rooms_XXXXXX").string();
    top_ = mkdtemp(name.data());
    Write("lib/armcal/core/status.hpp", "// core - good; knows nothing.\n");
    Write("lib/armcal/filter/kalman.hpp", "// filter - good.\n#include \"armcal/core/status.hpp\"\n");
    Write("host_sim/machine/plant/arm.cpp", "// plant - good.\n#include \"host_sim/machine/plant/arm.hpp\"\n");
  }
  ~PlantedViolation() override { fs::remove_all(top_); }

  void Write(const std::string& name, const std::string& text) {
    fs::create_directories((top_ / name).parent_path());
    std::ofstream(top_ / name) << text;
  }

  fs::path top_;
};

using Found = std::vector<std::string>;

TEST_F(PlantedViolation, None_NothingFound) {
  EXPECT_EQ(CheckIncludes(top_, kEdges), Found{});
  EXPECT_EQ(CheckFirstLines(top_), Found{});
}

TEST_F(PlantedViolation, ForbiddenEdge_IsFound) {
  Write("lib/armcal/filter/bad.hpp", "// filter - bad.\n\n#include \"armcal/model/contract.hpp\"\n");
  Write("host_sim/machine/plant/bad.cpp", "// plant - bad.\n#include \"codegen/src/robot/robot.hpp\"\n");
  Write("codegen/src/generator/bad.cpp", "// generator - bad.\n#include \"tests/rooms/house.hpp\"\n");
  EXPECT_EQ(
      CheckIncludes(top_, kEdges),
      (Found{"codegen/src/generator/bad.cpp:2: codegen/src/generator may not include tests/rooms/house.hpp",
             "host_sim/machine/plant/bad.cpp:2: host_sim/machine/plant may not include codegen/src/robot/robot.hpp",
             "lib/armcal/filter/bad.hpp:3: lib/armcal/filter may not include lib/armcal/model/contract.hpp"}));
}

TEST_F(PlantedViolation, RelativeIncludeOrUnknownRoom_IsFound) {
  Write("lib/armcal/core/bad.hpp", "// core - bad.\n#include \"status.hpp\"\n");
  Write("lib/armcal/cellar/a.hpp", "// cellar - unknown.\n");
  EXPECT_EQ(CheckIncludes(top_, kEdges),
            (Found{"lib/armcal/cellar/a.hpp:1: lies in no room of the table",
                   "lib/armcal/core/bad.hpp:2: includes \"status.hpp\", which is no path from the top"}));
}

TEST_F(PlantedViolation, EdgeThatNoIncludeUses_IsFound) {
  const Edges edges = {{"lib/armcal/core", {}},
                       {"lib/armcal/filter", {"lib/armcal/core", "lib/armcal/math"}},
                       {"host_sim/plant", {"codegen/src/"}}};
  EXPECT_EQ(UnusedEdges(top_, edges), (Found{"host_sim/plant -> codegen/src/: no include uses this edge",
                                             "lib/armcal/filter -> lib/armcal/math: no include uses this edge"}));
}

TEST_F(PlantedViolation, StreamInFirmware_IsFound) {
  Write("lib/armcal/core/bad.hpp", "// core - bad.\n#include <cstdint>\n#include <iostream>\n");
  EXPECT_EQ(CheckSystemHeaders(top_, {"lib/"}, {"cstdint"}),
            (Found{"lib/armcal/core/bad.hpp:3: may not include <iostream>"}));
}

TEST_F(PlantedViolation, FirstLineWithoutTheRoom_IsFound) {
  Write("lib/armcal/core/bad.hpp", "// math - in the wrong room.\n");
  Write("lib/armcal/core/none.hpp", "#pragma once\n");
  EXPECT_EQ(CheckFirstLines(top_).size(), 2u);
}

TEST_F(PlantedViolation, MachinePath_IsFoundWithItsLine) {
  const std::string path = Forbidden().front();
  Write("README.md", "fine\nsee " + path + "shared\n");
  Write("build/cache.txt", path);
  Write(".git/config.txt", path);
  EXPECT_EQ(CheckText(top_, Forbidden()), (Found{"README.md:2: names \"" + path + "\""}));
}

TEST_F(PlantedViolation, EleventhMacro_IsCounted) {
  std::string text = "// core - many.\n";
  for (char c = 'A'; c < 'A' + 11; ++c) text += std::string("#define ARMCAL_") + c + "(x) x\n#define OTHER_" + c + "\n";
  Write("lib/armcal/core/many.hpp", text);
  EXPECT_EQ(Macros(top_, "ARMCAL_").size(), 11u);
}

}  // namespace
}  // namespace armcal::house
