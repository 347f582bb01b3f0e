// bags tests - MATLAB files that SciPy wrote (recordings/write.py).
#include "host_sim/data/bags/mat.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;
const std::filesystem::path kMatFolder = "tests/unit/bags/recordings";

Eigen::MatrixXd Drive() { return files::ReadCsv(kMatFolder / "drive.csv").values; }

TEST(Mat, MatricesAndStructs_AreColumns) {
  const files::NumericTable table = ReadMat(kMatFolder / "drive_5.mat", {});
  EXPECT_EQ(table.names, (std::vector<std::string>{"t", "q(:,1)", "q(:,2)", "q(:,3)", "log.torque(1,:)",
                                                   "log.torque(2,:)", "log.torque(3,:)"}));
  EXPECT_EQ(table.values, Drive());
}

TEST(Mat, VersionFour_IsRead) {
  const files::NumericTable table = ReadMat(kMatFolder / "drive_4.mat", {"t", "tau(:,2)", "none"});
  EXPECT_EQ(table.names, (std::vector<std::string>{"t", "tau(:,2)"}));
  EXPECT_EQ(table.values, Drive()(Eigen::all, {0, 5}));
  EXPECT_EQ(table.ignored.size(), 5u);
}

TEST(Mat, ClassesOfNumbersAndSimulinkStructs_AreColumns) {
  const files::NumericTable table = ReadMat(kMatFolder / "kinds.mat", {});
  // write.py says what stands in the file.
  const auto column = [&table](const std::string& name) -> Eigen::VectorXd {
    const auto at = std::find(table.names.begin(), table.names.end(), name);
    if (at == table.names.end()) throw std::runtime_error("no column " + name);
    return table.values.col(at - table.names.begin());
  };
  for (int k = 0; k < 7; ++k) {
    EXPECT_EQ(column("single")[k], 0.5 * k);
    EXPECT_EQ(column("whole")[k], -k);
    EXPECT_EQ(column("out.signals(1).values(2,1,:)")[k], 10 * k + 1);
    EXPECT_EQ(column("out.signals(2).values")[k], 100 * k);
  }
  EXPECT_TRUE(std::isnan(column("holes")[2]));
  EXPECT_TRUE(std::isnan(column("holes")[3]));
  EXPECT_EQ(table.names.size(), 6u);
  EXPECT_EQ(table.ignored, std::vector<std::string>{"short"});
  EXPECT_EQ(
      ErrorOf([] { ReadMat(kMatFolder / "kinds.mat", {"single", "whole", "short"}); }),
      (kMatFolder / "kinds.mat").string() + ": 'short' has 3 numbers and 'single' has 7, expected the same number");
}

TEST(Mat, CutOrDamagedFile_IsRefusedInOneLine_OrReadInPart) {
  const TemporaryFolder folder;
  const std::string whole = files::test::ReadBytes(kMatFolder / "kinds.mat");
  std::mt19937 random(7);
  int refused = 0;
  for (std::size_t k = 0; k < 40; ++k) {
    std::string bytes = whole;
    if (k % 2 == 0) bytes.resize(30 * k);
    for (int place = 0; k % 2 == 1 && place < 3; ++place) bytes[random() % bytes.size()] = static_cast<char>(random());
    const auto path = folder.Write("bad.mat", bytes);
    const std::string error = ErrorOf([&] { ReadMat(path, {}); });
    ASSERT_EQ(error.find('\n'), error.npos);
    refused += !error.empty();
  }
  EXPECT_GT(refused, 4);
}

}  // namespace
}  // namespace armcal::bags
