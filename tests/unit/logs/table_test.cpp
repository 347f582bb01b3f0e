// logs tests - recordings and tables with empty cells become logs.
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/data/files/csv.hpp"
#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/data/logs/resample.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::logs {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;

const std::filesystem::path kRecordings = "tests/unit/bags/recordings";

const std::string kJointStates = R"(
joints = 3
names = ["shoulder", "elbow", "wrist"]
[q]
column = "/joint_states/{joint}/position"
unit = "rad"
[tau]
column = "/joint_states/{joint}/effort"
unit = "N*m"
)";

Eigen::MatrixXd Drive() { return files::ReadCsv(kRecordings / "drive.csv").values; }  // t q1 q2 q3 tau1 tau2 tau3

TEST(RecordedLog, HoldsTheNumbersOfTheDrive) {
  const TemporaryFolder folder;
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", kJointStates));
  const Eigen::MatrixXd drive = Drive();
  for (const char* name : {"joint_states_lz4.mcap", "plain.db3.zst", "split"}) {
    const Log log = ReadLog(kRecordings / name, map);
    EXPECT_EQ(log.q, drive.middleCols(1, 3)) << name;
    EXPECT_EQ(log.tau, drive.middleCols(4, 3)) << name;
    // Stamps are whole nanoseconds; the sum of two doubles near 2 s adds less than one more.
    EXPECT_LE((log.t.array() - (drive.col(0).array() - drive(0, 0))).abs().maxCoeff(), 2e-9) << name;
    EXPECT_EQ(log.notes, std::vector<std::string>{"/joint_states: time is header.stamp"}) << name;
  }
}

TEST(RecordedLog, WithoutAMapOrAColumn_IsRefusedInOneLine) {
  const TemporaryFolder folder;
  const auto path = kRecordings / "plain.db3.zst";
  EXPECT_EQ(ErrorOf([&] { ReadLog(path); }),
            path.string() +
                ": expected a channel map (--channels), because this is no CSV file; armcal "
                "channels writes one");
  std::string text = kJointStates;
  text.replace(text.find("effort"), 6, "torque");
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", text));
  EXPECT_EQ(ErrorOf([&] { ReadLog(path, map); }),
            path.string() + ": no column '/joint_states/shoulder/torque', which the channel map " +
                (folder / "map.toml").string() +
                " names; its topics are /joint_states "
                "(sensor_msgs/msg/JointState)");
}

TEST(RecordedLog, OfJointsWithOtherNames_SaysWhichItHas) {
  const TemporaryFolder folder;
  std::string text = kJointStates;
  const auto names = text.find("names"), end = text.find('\n', names);
  text.replace(names, end - names, "names = [\"a\", \"b\", \"c\"]");
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", text));
  const std::string error = ErrorOf([&] { ReadLog(kRecordings / "plain.db3.zst", map); });
  EXPECT_NE(error.find("no column '/joint_states/a/position'"), error.npos) << error;
  EXPECT_NE(error.find("/joint_states/shoulder/position"), error.npos) << error;
  EXPECT_NE(error.find("armcal channels"), error.npos) << error;
}

TEST(RecordedLog, TopicsOfDifferentRates_AreInterpolated) {
  // Torque comes from /ft at half the rate, so its times count. Positions come from /tcp, which has these times, too.
  const TemporaryFolder folder;
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", R"(
joints = 1
[q]
column = "/tcp/twist/linear/y"
unit = "rad"
[tau]
column = "/ft/wrench/force/z"
unit = "N*m"
[qref]
column = "/array/data[1]"
unit = "rad"
)"));
  const Log log = ReadLog(kRecordings / "types.db3.zst", map, 100);
  const Eigen::MatrixXd drive = Drive();
  // /array has the recorder's time: from its first message on, 1 to 3 ms after the header's stamps of the others.
  ASSERT_EQ(log.samples(), 119);
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    ASSERT_EQ(log.q(k, 0), drive(2 * k + 2, 2));
    ASSERT_EQ(log.tau(k, 0), drive(2 * k + 2, 6));
    const double before = drive(2 * k + 1, 2), now = drive(2 * k + 2, 2);
    ASSERT_GE(log.qref(k, 0), std::min(before, now));
    ASSERT_LE(log.qref(k, 0), std::max(before, now));
  }
  EXPECT_TRUE(log.notes[3].ends_with("interpolated at the times of /ft (62.5 Hz)")) << log.notes[3];
}

// As PlotJuggler exports topics: a row for each time, cells without a message are empty.
TEST(EmptyCells, OfTopicsWithDifferentRates_AreInterpolated) {
  const TemporaryFolder folder;
  std::string text = "__time,/js/a/position,/js/a/effort,/temp,/other\n";
  const double begin = 1700000000;
  for (int k = 0; k < 1000; ++k) {
    char line[200];
    const double t = begin + 0.001 * k;
    if (k % 4 == 0) std::snprintf(line, sizeof line, "%.6f,%.9f,%.9f,,\n", t, 0.5 * k, std::sin(0.1 * k));
    else if (k % 4 == 1) std::snprintf(line, sizeof line, "%.6f,,,%.9f,\n", t, 20.0 + 0.25 * k);
    else std::snprintf(line, sizeof line, "%.6f,,,,%d\n", t, k);
    text += line;
  }
  const auto path = folder.Write("export.csv", text);
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", R"(
joints = 1
[q]
column = "/js/a/position"
unit = "rad"
[tau]
column = "/js/a/effort"
unit = "N*m"
[temp]
column = "/temp"
unit = "degC"
)"));
  const Log log = ReadLog(path, map);
  ASSERT_EQ(log.samples(), 249);  // the first row is before the first temperature
  for (Eigen::Index k = 0; k < log.samples(); ++k) {
    const double row = 4.0 * static_cast<double>(k + 1);
    ASSERT_EQ(log.q(k, 0), 0.5 * row);
    ASSERT_NEAR(log.tau(k, 0), std::sin(0.1 * row), 1e-9);  // as many digits as the file has
    ASSERT_NEAR(log.temp(k, 0), 20 + 0.25 * row, 1e-8);
    ASSERT_NEAR(log.t[k] - log.t[0], 0.001 * (row - 4), 1e-6);
  }
  EXPECT_EQ(log.notes.at(0),
            "column '/temp' (250 Hz): interpolated at the times of column '/js/a/position' and 1 more (250 Hz)");
}

TEST(TimeSince1970, KeepsItsNanoseconds) {
  const TemporaryFolder folder;
  std::string seconds = "stamp,p,f\n", nanoseconds = seconds;
  for (int k = 0; k < 9; ++k) {
    const std::string part = std::to_string(900000001 + 40000003 * k);  // ns, of which the last ones pass a second
    const bool next = part.size() == 10;
    seconds += (next ? "1700000001." : "1700000000.") + part.substr(next) + ",0,0\n";
    nanoseconds += (next ? "1700000001" : "1700000000") + part.substr(next) + ",0,0\n";
  }
  for (const auto& [text, unit] : {std::pair{seconds, "s"}, {nanoseconds, "ns"}}) {
    const std::string map = "joints = 1\n[time]\ncolumn = \"stamp\"\nunit = \"" + std::string(unit) +
                            "\"\n[q]\ncolumn = \"p\"\nunit = \"rad\"\n[tau]\ncolumn = \"f\"\nunit = \"N*m\"\n";
    const Log log = ReadLog(folder.Write("log.csv", text), ReadChannelMap(folder.Write("map.toml", map)), 2);
    ASSERT_EQ(log.samples(), 9);
    for (Eigen::Index k = 0; k < 9; ++k)
      EXPECT_NEAR(log.t[k] - log.t[0], 0.040000003 * static_cast<double>(k), 1e-12) << unit;  // a double near 1 s
  }
}

Series Line(const std::string& name, std::vector<double> t, double slope) {
  Series out{name, Eigen::Map<Eigen::VectorXd>(t.data(), static_cast<Eigen::Index>(t.size())), {}};
  out.numbers.names = {name};
  out.numbers.values = slope * out.t;
  return out;
}

TEST(CommonTimes, SlowestMainColumn_GivesTheTimes) {
  const Series fast = Line("fast", {0, 1, 2, 3, 4, 5, 6}, 1), slow = Line("slow", {0.5, 2.5, 4.5}, 10);
  const Series other = Line("other", {0, 5}, 100);
  const Common common = OnCommonTimes({fast, slow, other}, {"fast", "slow"}, {});
  EXPECT_EQ(common.grid, 1u);
  EXPECT_EQ(common.numbers.values, (Eigen::Matrix3d() << 0.5, 5, 50, 2.5, 25, 250, 4.5, 45, 450).finished());
}

TEST(CommonTimes, GapsAndEnds_HaveNoNumber_AndAreSaid) {
  const Series grid = Line("grid", {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}, 1);
  const Series ended = Line("ended", {1.5, 2.5, 3.5, 4.5, 11.5, 12.5}, 1);
  const Common common = OnCommonTimes({grid, ended}, {"grid"}, {});
  for (Eigen::Index k = 0; k < 14; ++k) {
    const bool number = (k >= 2 && k <= 4) || k == 12;
    EXPECT_EQ(std::isnan(common.numbers.values(k, 1)), !number) << k;
    if (number) {
      EXPECT_EQ(common.numbers.values(k, 1), static_cast<double>(k));
    }
  }
  EXPECT_EQ(common.notes,
            (std::vector<std::string>{
                "ended (1 Hz): interpolated at the times of grid (1 Hz)",
                "ended: 1 gap, the longest 7 s, 3 s after its first time; nothing is interpolated there"}));
}

TEST(CommonTimes, OfAColumnThatIsOftenEmpty_AreSaid) {
  files::NumericTable table{{"q", "tau"}, Eigen::MatrixXd::Ones(10, 2), {}};
  for (int k = 1; k < 10; k += 2) table.values(k, 1) = NAN;
  const Common common =
      OnCommonTimes(SplitByEmptyCells(table, Eigen::VectorXd::LinSpaced(10, 0, 0.9)), {"q", "tau"}, {});
  EXPECT_EQ(common.numbers.values.rows(), 5);
  EXPECT_EQ(common.notes,
            std::vector<std::string>{"column 'q': of its 10 times the 5 count at which column 'tau' has numbers, too"});
}

TEST(CommonTimes, HeldColumn_KeepsItsLastValue_AndEqualTimesAreNotInterpolated) {
  const Series grid = Line("grid", {0, 1, 2}, 1), flag = Line("flag", {0, 0.75, 1.5, 2.25}, 4);
  const Series same = Line("same", {0, 1, 2}, 0.1);
  const Common common = OnCommonTimes({grid, flag, same}, {"grid"}, {"flag"});
  EXPECT_EQ(common.numbers.values.col(1), Eigen::Vector3d(0, 3, 6));
  EXPECT_EQ(common.numbers.values.col(2), same.numbers.values);
  EXPECT_EQ(common.notes.size(), 1u);
}

}  // namespace
}  // namespace armcal::logs
