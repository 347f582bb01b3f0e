// logs tests - read what was written, and get one line for each kind of bad file.
#include "host_sim/data/logs/log.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::logs {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;

// One joint, ten rows; the third row can be replaced.
std::string Small(const std::string& header, const std::string& third = "") {
  std::string text = header + "\n";
  for (int k = 0; k < 10; ++k) {
    const bool planted = k == 2 && !third.empty();
    text += (planted ? third : std::to_string(0.004 * k) + ",0.5,-2e1") + "\n";
  }
  return text;
}

std::string ErrorFor(const std::string& text, int min_samples = 2) {
  const TemporaryFolder folder;
  const auto path = folder.Write("log.csv", text);
  const std::string message = ErrorOf([&] { ReadLog(path, min_samples); });
  return message.starts_with(path.string()) ? message.substr(path.string().size()) : message;
}

Log SixJoints(Eigen::Index samples) {
  Log log;
  log.joints = 6;
  log.t = Eigen::VectorXd::LinSpaced(samples, 100.0, 100.0 + 0.004 * static_cast<double>(samples - 1));
  const auto block = [samples](double size) { return (size * Eigen::MatrixXd::Random(samples, 6)).eval(); };
  log.q = block(3), log.tau = block(800), log.qd = block(2), log.qdd = block(9);
  log.qref = block(3), log.tauff = block(800);
  log.flags = Eigen::MatrixXi::Constant(samples, 6, 3);
  return log;
}

// A status word of 32 bits, as a program writes it that knows no sign: bit 31, saturated, and bit 0.
TEST(Log, AWordOfFlags_KeepsItsBits) {
  const TemporaryFolder folder;
  std::string text = "t,q1,tau1,flag1\n";
  for (int k = 0; k < 9; ++k)
    text += std::to_string(0.004 * k) + ",0.1,1," + (k == 4 ? "2147483653" : "-2147483643") + "\n";
  const Log log = ReadLog(folder.Write("log.csv", text), 2);
  ASSERT_EQ(log.flags.rows(), 9);
  for (int k = 0; k < 9; ++k) EXPECT_EQ(log.flags(k, 0) & 7, 5) << k;
}

TEST(Log, WrittenAndRead_IsTheSameToNineDigits) {
  const TemporaryFolder folder;
  const Log log = SixJoints(500);
  for (const char* name : {"log.csv", "log.csv.gz"}) {
    WriteLog(folder / name, log);
    const Log back = ReadLog(folder / name);
    EXPECT_EQ(back.joints, 6);
    // Half a unit of the last digit written: 12 digits of 100 s, 9 digits of the largest value.
    EXPECT_LE((back.t - log.t).cwiseAbs().maxCoeff(), 0.5e-9);
    EXPECT_LE((back.q - log.q).cwiseAbs().maxCoeff(), 0.5e-8);
    EXPECT_LE((back.tau - log.tau).cwiseAbs().maxCoeff(), 0.5e-6);
    EXPECT_LE((back.qdd - log.qdd).cwiseAbs().maxCoeff(), 0.5e-8);
    EXPECT_EQ(back.flags, log.flags);
    EXPECT_EQ(back.temp.size(), 0);
    EXPECT_EQ(back.ext.size(), 0);
    EXPECT_TRUE(back.gaps.empty());
    EXPECT_NEAR(back.step_s(), 0.004, 1e-9);
  }
}

TEST(Log, ColumnsInAnyOrder_BlanksCrlfAndByteOrderMark_AreRead) {
  const TemporaryFolder folder;
  std::string text = "\xEF\xBB\xBFtau1, remark ,t,q1\r\n";
  for (int k = 0; k < 10; ++k) text += "1.5,some text, " + std::to_string(0.01 * k) + " ,+0.25\r\n";
  const Log log = ReadLog(folder.Write("log.csv", text + "\r\n"), 2);
  EXPECT_EQ(log.joints, 1);
  EXPECT_EQ(log.samples(), 10);
  EXPECT_EQ(log.q(9, 0), 0.25);
  EXPECT_EQ(log.tau(0, 0), 1.5);
  EXPECT_EQ(log.ignored, std::vector<std::string>{"remark"});
}

// A double holds such a time to a quarter of a microsecond. The file has all its digits.
TEST(Log, TimeSince1970_CountsFromTheFirstWholeSecond) {
  const TemporaryFolder folder;
  std::string text = "t,q1,tau1\n";
  for (int k = 0; k < 10; ++k) text += fmt::format("1763980000.{:07},0,1\n", 1234567 + 2500 * k);
  const Log log = ReadLog(folder.Write("log.csv", text), 2);
  for (int k = 0; k < 10; ++k) EXPECT_NEAR(log.t[k], 0.1234567 + 0.00025 * k, 1e-12);
}

TEST(Log, GapsInTime_AreListed) {
  const TemporaryFolder folder;
  Log log = SixJoints(300);
  log.t.tail(200).array() += 0.004;
  log.t.tail(50).array() += 1.0;
  WriteLog(folder / "log.csv", log);
  EXPECT_EQ(ReadLog(folder / "log.csv").gaps, (std::vector<int>{99, 249}));
}

TEST(Log, TooSmallNumber_IsZero) {
  const TemporaryFolder folder;
  EXPECT_EQ(ReadLog(folder.Write("log.csv", Small("t,q1,tau1", "0.008,1e-999,-1.5e-323")), 2).q(2, 0), 0.0);
}

TEST(Log, BadFile_NamesLineColumnAndExpected) {
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1")), "");
  EXPECT_EQ(ErrorFor(""), ": is empty, expected a header line with column names");
  EXPECT_EQ(ErrorFor(Small("t;q1;tau1")), ":1: columns are separated by ';', expected ',' (and '.' in numbers)");
  EXPECT_EQ(ErrorFor(Small("t\tq1\ttau1")), ":1: columns are separated by tabs, expected ','");
  EXPECT_EQ(ErrorFor(Small("0.008,-0.1,2")), ":1: '0.008' is a number, expected a header line with column names");
  EXPECT_EQ(ErrorFor(Small("PK\x03\x04")), ":1: is no text, expected a CSV file");
  EXPECT_EQ(ErrorFor(Small("t,q1,q1")), ":1: column 'q1' appears twice, expected a name for each column");
  EXPECT_EQ(ErrorFor(Small("t,q1,")), ":1: column 3 has no name");
  EXPECT_EQ(ErrorFor(Small("time,q1,tau1")),
            ":1: no column 't', expected t, q1..qn, tau1..taun (other names need a channel map: --channels)");
  EXPECT_EQ(
      ErrorFor(Small("t,q1,torque1")),
      ":1: no column 'tau1'; if it is a trajectory, armcal record plays it; expected t, q1..qn, tau1..taun (other "
      "names need a channel map: --channels)");
  EXPECT_EQ(ErrorFor(Small("t,q2,tau2")),
            ":1: no column 'q1', expected t, q1..qn, tau1..taun (other names need a channel map: --channels)");
  EXPECT_EQ(ErrorFor(Small("t,pos,torque")),
            ":1: no column 'q1', expected t, q1..qn, tau1..taun (other names need a channel map: --channels)");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1", "0.008,1")), ":4: has 2 fields, expected 3 as in the header");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1", "0.008,1,2,3")), ":4: has 4 fields, expected 3 as in the header");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1", "0.008,1,two")), ":4: column 'tau1': 'two', expected a number");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1", "0.008,1,2 3")), ":4: column 'tau1': '2 3', expected a number");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1", "0.008,1,-inf")), ":4: column 'tau1': '-inf', expected a finite number");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1", "0.008,1,1e999")), ":4: column 'tau1': '1e999', expected a finite number");
  EXPECT_EQ(ErrorFor(Small("t,q1,tau1"), kMinSamples), ": has 10 samples, expected at least 200");
  EXPECT_EQ(ErrorFor("t,q1,tau1\n0,0,0\n\n1,0,0\n"), ":4: follows a blank line, expected the end of the file");
}

}  // namespace
}  // namespace armcal::logs
