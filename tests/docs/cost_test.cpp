// tests - README's table of costs shows the accepted figures of toolchains/budgets.toml, which come from one run of the
// target `budgets` for each core.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <toml++/toml.h>
#include <fstream>

namespace armcal::tests {
namespace {

struct CostLine {
  const char *what, *kind, *name, *modelled;
};
constexpr CostLine kLines[] = {{"`ForgettingFilter`", "filters", "forgetting_60", "forgetting_60"},
                               {"`KalmanFilter`, block form", "filters", "kalman_block_60", "kalman_block_60"},
                               {"`KalmanFilter`", "filters", "kalman_dense_60", "kalman_dense_60"},
                               {"`ExtendedKalmanFilter`", "filters", "ekf_60", "ekf_60"},
                               {"the model's rows (`er20_like`)", "regressors", "er20_like", "er20_like"}};

std::string Table(const toml::table& budgets) {
  const auto figure = [&](const char* core, const char* kind, const char* name, const char* key) {
    const auto value = budgets[core][kind][name][key].value<double>();
    EXPECT_TRUE(value) << core << " " << kind << " " << name << " " << key;
    return value.value_or(0.0);
  };
  std::string table;
  for (const CostLine& line : kLines) {
    const double flash = figure("cortex-m4f", line.kind, line.name, "text_bytes");
    table += fmt::format("| {} | {:.1f} KB | ", line.what, flash / 1000);
    if (line.kind == std::string("filters"))
      table += fmt::format("{:.1f} KB", figure("cortex-m4f", line.kind, line.name, "state_bytes") / 1000);
    else table += "-";
    for (const char* core : {"cortex-m4f", "cortex-m7"}) {
      const double cycles = figure(core, "modelled", line.modelled, "cycles");
      const double us = cycles / budgets["clock_MHz"][core].value_or(0.0);
      table += fmt::format(" | {:.1f} k | {:.1f} k | {:.0f} us",
                           figure(core, line.kind, line.name, "instructions") / 1000, cycles / 1000, us);
    }
    table += " |\n";
  }
  return table;
}

TEST(Docs, ReadmesTableOfCosts_ShowsTheAcceptedFigures) {
  std::ifstream in("README.md");
  const std::string readme(std::istreambuf_iterator<char>(in), {});
  const toml::table budgets = toml::parse_file("toolchains/budgets.toml");
  const std::string table = Table(budgets);
  EXPECT_NE(readme.find(table), std::string::npos) << "the lines that README must have:\n" << table;
}

// A figure that changes must change the table.
TEST(Docs, TableOfCosts_FollowsTheFigures) {
  toml::table budgets = toml::parse_file("toolchains/budgets.toml");
  const std::string before = Table(budgets);
  budgets["cortex-m7"]["modelled"]["kalman_dense_60"].as_table()->insert_or_assign("cycles", 96000);
  const std::string after = Table(budgets);
  EXPECT_NE(before, after);
  EXPECT_NE(after.find("| 96.0 k | 200 us |"), std::string::npos) << after;
}

}  // namespace
}  // namespace armcal::tests
