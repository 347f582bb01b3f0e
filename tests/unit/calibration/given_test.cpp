// calibration tests - a table's numbers, taken as they are, predict the torque of KDL's arm and of drives that are off.
#include "host_sim/identify/calibration/given.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::calibration {
namespace {

// A drive that multiplies by 0.8 to get the torque has measured 1.25 times the torque, and so has the log.
TEST(GivenByTable, TheTrueArm_PredictsWhatItsDrivesMeasure) {
  tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 3);
  const codegen::Model& model = arm.model();
  Dataset d = arm.Run(5, 4);
  TableFile table = DefaultTable(model);
  for (int k = 0; k < model.body_parameters(); ++k) table.row[static_cast<std::size_t>(k)].mean = arm.bodies()[k];
  for (int c = 0; c < model.front(); ++c)
    table.row[static_cast<std::size_t>(model.table_index(c))].mean = arm.truth()[c];
  d.tau.col(0) *= 1.25, d.tau.col(1) *= 0.5;
  table.joint[0].torque_scale = 0.8, table.joint[1].torque_scale = 2;
  const Given given = GivenByTable(model, table, "table.toml");
  EXPECT_TRUE(given.missing.empty());
  const Eigen::VectorXd left = Rms(d, d.tau - Predict(model, d, given.x, given.eta), true);
  EXPECT_NEAR(left[0] / (1.25 * arm.noise_Nm(0)), 1, 0.15);  // 4 / sqrt(2 x 500) and turns
  EXPECT_NEAR(left[1] / (0.5 * arm.noise_Nm(1)), 1, 0.15);
}

TEST(Given, ByTableAndByJson_NamesWhatTheLogsSaidLittleOf) {
  const codegen::Model model(codegen::ReadRobot("codegen/robots/two_link.toml"), tests::Records());
  TableFile table = DefaultTable(model);
  nlohmann::json json{{"columns", nlohmann::json::array()}};
  for (TableRow& row : table.row) {
    row.from_prior = row.name == "m2" || row.name == "Fv1";
    json["table"].push_back({{"name", row.name}, {"mean", row.mean}, {"from_prior", row.from_prior}});
  }
  const std::vector<std::string> expected{"m2", "Fv1"};
  EXPECT_EQ(GivenByTable(model, table, "table.toml").from_prior, expected);
  const files::test::TemporaryFolder folder;
  EXPECT_EQ(GivenByFile(model, folder.Write("identified.json", json.dump())).from_prior, expected);
}

}  // namespace
}  // namespace armcal::calibration
