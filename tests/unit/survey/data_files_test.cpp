// survey tests - the two data files: the limits, and printed figures that must agree with one another.
#include "host_sim/study/survey/data_files.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include <unistd.h>

#include "codegen/src/io/input_error.hpp"

namespace armcal::survey {
namespace {

namespace fs = std::filesystem;

const Levels& LevelFile() {
  static const Levels levels = ReadLevels("host_sim/study/survey/levels.toml");
  return levels;
}
const Printed& Figures() {
  static const Printed printed = ReadPrinted("host_sim/study/survey/printed.toml");
  return printed;
}

TEST(LevelLimits, AreThoseOfTables1To4) {
  const struct {
    const char* index;
    double inside_A, inside_B;  // just below the two limits
  } kTables[] = {{"e_T", 0.0099, 0.099},          {"e_d", 0.199, 0.99},      {"e_f", 0.199, 0.99}, {"J_e", 0.99, 9.9},
                 {"solution_time_s", 59.9, 3599}, {"delta_J_e", 0.099, 0.99}};
  for (const auto& t : kTables) {
    EXPECT_EQ(LevelFile().Of(t.index, t.inside_A), 'A') << t.index;
    EXPECT_EQ(LevelFile().Of(t.index, t.inside_A * 1.02), 'B') << t.index;
    EXPECT_EQ(LevelFile().Of(t.index, t.inside_B), 'B') << t.index;
    EXPECT_EQ(LevelFile().Of(t.index, t.inside_B * 1.02), 'C') << t.index;
    EXPECT_EQ(LevelFile().Of(t.index, std::nan("")), 'C') << t.index << ": no number is no level";
  }
}

// J_e is the sum of the four others (rounded to 4 digits), Delta J_e its relative growth: a typing error breaks this.
TEST(PrintedFigures, EveryRowOfTables8And9_AddsUp) {
  int rows = 0;
  for (const char* table : {"table8", "table9"})
    for (const auto& [method, v] : Figures().number.at(table)) {
      ASSERT_EQ(v.size(), 11u) << table << " " << method;
      for (const std::size_t k : {0u, 5u})
        EXPECT_NEAR(v[k] + v[k + 1] + v[k + 2] + v[k + 3], v[k + 4], 3e-4) << table << " " << method << " " << k;
      EXPECT_NEAR((v[9] - v[4]) / v[4], v[10], 1.5e-3 * (1 + v[10])) << table << " " << method;
      ++rows;
    }
  EXPECT_EQ(rows, 11);
}

TEST(PrintedFigures, SpotChecks_AgainstTheText) {
  const Printed& p = Figures();
  EXPECT_EQ(p.At("table5", "pseudo_inverse", 7), -3.5211);
  EXPECT_EQ(p.At("table5", "set", 0), 25.6083);
  EXPECT_EQ(p.At("table6", "extended_kalman", 12), 5.5823);
  EXPECT_EQ(p.At("table7", "std_Nm", 3), 1.78);
  EXPECT_EQ(p.At("table10", "instrumental_variable", 2), 0.0828);
  EXPECT_EQ(p.At("table12", "eq5", 1), 51.8087);
  EXPECT_EQ(p.At("condition", "nonlinear", 0), 5.7);
  EXPECT_EQ(p.WordAt("table11", "forgetting", 4), "A");
  EXPECT_TRUE(std::isnan(p.At("table8", "map_barrier", 0)));
  EXPECT_EQ(p.WordAt("table11", "map_barrier", 0), "-");
}

TEST(PrintedFigures, Tables5And6_HaveAFigureForEveryParameter) {
  for (const char* table : {"table5", "table6"}) {
    const std::size_t parameters = Figures().words.at(table).at("parameter").size();
    for (const auto& [row, v] : Figures().number.at(table))
      EXPECT_EQ(v.size(), row == "set" ? parameters - 2 : parameters) << table << " " << row;
  }
}

TEST(PrintedFigures, Table10_GrowthFollowsFromItsRows) {
  for (const auto& [method, v] : Figures().number.at("table10"))
    EXPECT_NEAR((v[1] - v[0]) / v[0], v[2], 1e-3) << method;
}

TEST(LevelLimits, WithALimitOutOfOrder_IsRefusedWithFileAndKey) {
  const fs::path path = fs::temp_directory_path() / ("armcal_levels_" + std::to_string(getpid()) + ".toml");
  std::ifstream in("host_sim/study/survey/levels.toml");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto at = text.find("A = 0.01");
  std::ofstream(path) << text.replace(at, 8, "A = 0.50");
  try {
    ReadLevels(path);
    ADD_FAILURE() << "accepted";
  } catch (const io::InputError& e) {
    EXPECT_EQ(std::string(e.what()), path.string() + ": e_T.B: expected a number above A");
  }
  fs::remove(path);
}

}  // namespace
}  // namespace armcal::survey
