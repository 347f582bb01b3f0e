// bags tests - MATLAB files that SciPy wrote (recordings/write.py).
#include "host_sim/data/bags/mat.hpp"

#include <gtest/gtest.h>

#include <random>

#include "host_sim/data/bags/whole_mat.hpp"
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
      ErrorOf([] {
        ReadMat(kMatFolder / "kinds.mat", {"single", "whole", "short"});
      }),
      (kMatFolder / "kinds.mat").string() + ": 'short' has 3 numbers and 'single' has 7, expected the same number");
}

// A file that ends between two variables looks whole. Numbers that are read were in the file.
TEST(Mat, CutFile_IsRefusedInOneLine_OrItsFirstVariablesAreRead) {
  const TemporaryFolder folder;
  for (const char* name : {"drive_5.mat", "kinds.mat", "drive_4.mat", "kinds_4.mat", "drive_73.mat"}) {
    const std::string bytes = files::test::ReadBytes(kMatFolder / name);
    const files::NumericTable whole = ReadMat(kMatFolder / name, {});
    int refused = 0;
    for (int part = 1; part < 24; ++part) {
      const auto path = folder.Write("cut.mat", bytes.substr(0, bytes.size() * part / 24));
      files::NumericTable cut;
      const std::string error = ErrorOf([&] { cut = ReadMat(path, {}); });
      ASSERT_EQ(error.find('\n'), error.npos);
      refused += !error.empty();
      for (std::size_t c = 0; c < cut.names.size(); ++c) {
        const auto same = std::find(whole.names.begin(), whole.names.end(), cut.names[c]);
        if (same == whole.names.end()) continue;  // of a length that was not the usual one
        const Eigen::VectorXd expected = whole.values.col(same - whole.names.begin());
        for (int k = 0; k < expected.size(); ++k)
          EXPECT_TRUE(cut.values(k, c) == expected[k] || std::isnan(expected[k])) << name << " " << part;
      }
    }
    EXPECT_GE(refused, 15) << name;
  }
}

TEST(Mat, DamagedFile_IsRefusedInOneLine_OrRead) {
  const TemporaryFolder folder;
  const std::string whole = files::test::ReadBytes(kMatFolder / "kinds.mat");
  std::mt19937 random(7);
  int refused = 0;
  for (int k = 0; k < 20; ++k) {
    std::string bytes = whole;
    for (int place = 0; place < 3; ++place) bytes[random() % bytes.size()] = static_cast<char>(random());
    const auto path = folder.Write("bad.mat", bytes);
    const std::string error = ErrorOf([&] { ReadMat(path, {}); });
    ASSERT_EQ(error.find('\n'), error.npos);
    refused += !error.empty();
  }
  EXPECT_GT(refused, 4);
}

// The array's own size and the number of its bytes contradict each other.
TEST(Mat, ArrayWithFewerNumbersThanItsSizeSays_IsRefused) {
  const TemporaryFolder folder;
  std::string bytes = files::test::ReadBytes(kMatFolder / "kinds.mat");
  const std::size_t size_of_first = 128 + 8 + 16 + 8;  // header, tag of the variable, its flags, tag of its size
  ASSERT_EQ(bytes[size_of_first], 7);
  bytes[size_of_first] = 9;
  const auto path = folder.Write("bad.mat", bytes);
  EXPECT_EQ(ErrorOf([&] { ReadMat(path, {}); }), path.string() + ": the variable at byte 128 is damaged or cut short");
}

TEST(Mat, BigEndianFile_IsLookedAt) {
  std::string bytes(124, ' ');
  bytes += std::string("\1\0MI", 4) + std::string("\0\0\0\16\0\0\0\20", 8) + std::string(8, '\0');
  EXPECT_NE(ErrorOf([&] { CheckWhole(bytes); }), "");
  bytes.resize(128);
  EXPECT_EQ(ErrorOf([&] { CheckWhole(bytes); }), "");
}

}  // namespace
}  // namespace armcal::bags
