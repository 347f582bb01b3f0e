// rooms - keeps the edges between the rooms, the first lines, the macros and the text of the whole project.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/rooms/house.hpp"

namespace armcal::house {
namespace {

namespace fs = std::filesystem;

const std::string kLib = "lib/armcal/";

// clang-format off
const Edges kEdges = {
    // The firmware library. Model and filter meet in estimator only. armcal.hpp is the entry of all.
    {"lib/armcal",             {kLib}},
    {"lib/armcal/core",        {}},
    {"lib/armcal/math",        {}},
    {"lib/armcal/model",       {kLib + "core", kLib + "math"}},
    {"lib/armcal/signal",      {kLib + "math", kLib + "model"}},
    {"lib/armcal/filter",      {kLib + "core", kLib + "math"}},
    {"lib/armcal/physical",    {kLib + "core", kLib + "math"}},
    {"lib/armcal/feedforward", {kLib + "core", kLib + "math", kLib + "model"}},
    {"lib/armcal/monitor",     {kLib + "math"}},
    {"lib/armcal/estimator",   {kLib + "core", kLib + "math", kLib + "model", kLib + "signal", kLib + "filter",
                                kLib + "physical", kLib + "monitor"}},
    {"lib/armcal/port",        {kLib + "core"}},
    {"lib/armcal/table",       {kLib + "core", kLib + "port"}},
    {"lib/armcal/link",        {kLib + "core", kLib + "port", kLib + "table"}},
    {"lib/armcal/controller",  {kLib}},  // introduces the rooms to each other

    // Targets fill the port's contracts; a board.hpp gives them the names of the README's example.
    {"port/linux",             {kLib + "core", kLib + "port"}},
    {"port/mps2",              {kLib + "core", kLib + "port"}},
    {"port/template",          {kLib + "core", kLib + "port", kLib + "controller"}},
    {"port/runner",            {kLib + "core", kLib + "port", "port/mps2"}},  // what a test program needs of its machine
    {"port/mps2/application",  {kLib, kLib + "armcal.hpp", "codegen/generated/", "port/mps2"}},

    // The generator prints includes of lib but uses none; its output sees numbers only.
    {"codegen/generated/",     {kLib + "core", kLib + "math", kLib + "model", kLib + "link/registers.hpp"}},
    {"codegen/src/robot",      {"host_sim/io"}},
    {"codegen/src/generator",  {"codegen/src/robot", "host_sim/io"}},

    // The PC side. The plant sees neither codegen nor lib: it is the truth that the others are judged by.
    {"host_sim/io",            {}},
    {"host_sim/report",        {"host_sim/io"}},
    {"host_sim/plant",         {"host_sim/io"}},
    {"host_sim/client",        {"host_sim/io", kLib + "core", kLib + "link", kLib + "model"}},
    {"host_sim/search",        {}},  // minimises functions of numbers; the only room that sees pagmo
    {"host_sim/excitation",    {"host_sim/io", "host_sim/search", "codegen/src/"}},
    {"host_sim/calibration",   {"host_sim/io", "codegen/src/", kLib + "core", kLib + "math", kLib + "model",
                                kLib + "physical", "host_sim/calibration/methods"}},
    {"host_sim/calibration/methods", {"host_sim/io", "host_sim/search", "codegen/src/", "host_sim/calibration"}},
    {"host_sim/diagnosis",     {"host_sim/io", "codegen/src/", "host_sim/calibration"}},
    {"host_sim/health",        {"host_sim/client", kLib + "link/registers.hpp"}},  // a drive's statistics -> a verdict
    {"host_sim/drive",         {"host_sim/io", "host_sim/plant", "host_sim/excitation", "port/linux",
                                "codegen/src/robot", "codegen/generated/", kLib}},
    {"host_sim/estimate",      {"host_sim/io", "host_sim/client", "host_sim/calibration", "codegen/generated/", kLib}},
    {"host_sim/survey",        {"host_sim/io", "host_sim/report", "host_sim/search", "host_sim/plant", "host_sim/excitation",
                                "host_sim/calibration", "host_sim/calibration/methods", "codegen/src/",
                                "codegen/generated/", kLib}},  // its online table judges the firmware's own estimator
    // Times the model against yardsticks; a program of its own flags, so headers that stand alone only.
    {"host_sim/bench",         {"host_sim/calibration", "codegen/generated/", kLib + "math", kLib + "model"}},
    {"host_sim/cli",           {"host_sim/", "codegen/", "port/linux", kLib}},

    // Tests may look everywhere; nothing may look into tests.
    {"tests/",                 {kLib, "port/", "codegen/", "host_sim/"}},
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

TEST(Rooms, FirmwareRooms_UseNoHeaderThatBringsAHeapOrAStream) {
  const auto found = CheckSystemHeaders(
      Top(), {"lib/", "codegen/generated/", "port/mps2/", "port/template/"},
      {"array", "atomic", "cmath", "cstddef", "cstdint", "cstring", "limits", "tuple", "type_traits", "utility"});
  EXPECT_TRUE(found.empty()) << Lines(found);
}

TEST(Rooms, FirstLine_SaysTheRoomAndWhatItKnows) {
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
    Write("host_sim/plant/arm.cpp", "// plant - good.\n#include \"host_sim/plant/arm.hpp\"\n");
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
  Write("host_sim/plant/bad.cpp", "// plant - bad.\n#include \"codegen/src/robot/robot.hpp\"\n");
  Write("codegen/src/generator/bad.cpp", "// generator - bad.\n#include \"tests/rooms/house.hpp\"\n");
  EXPECT_EQ(CheckIncludes(top_, kEdges),
            (Found{"codegen/src/generator/bad.cpp:2: codegen/src/generator may not include tests/rooms/house.hpp",
                   "host_sim/plant/bad.cpp:2: host_sim/plant may not include codegen/src/robot/robot.hpp",
                   "lib/armcal/filter/bad.hpp:3: lib/armcal/filter may not include lib/armcal/model/contract.hpp"}));
}

TEST_F(PlantedViolation, RelativeIncludeOrUnknownRoom_IsFound) {
  Write("lib/armcal/core/bad.hpp", "// core - bad.\n#include \"status.hpp\"\n");
  Write("lib/armcal/cellar/a.hpp", "// cellar - unknown.\n");
  EXPECT_EQ(CheckIncludes(top_, kEdges),
            (Found{"lib/armcal/cellar/a.hpp:1: lies in no room of the table",
                   "lib/armcal/core/bad.hpp:2: includes \"status.hpp\", which is no path from the top"}));
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
