// logs tests - read channel maps: foreign names, units and zero points.
#include "host_sim/data/logs/channels.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "host_sim/data/logs/log.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::logs {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;

const std::string kMap = R"(
joints = 2
[time]
column = "ms"
unit = "ms"
[q]
column = "pos{}"
unit = ["deg", "mm"]
scale = [1, 2]
offset = [90, 0]
[tau]
column = ["motor", "force"]
unit = ["N*m", "kN"]
scale = [-100, 1]
[temp]
column = "T{}"
unit = "K"
optional = true
)";

TEST(Channels, ForeignLog_ArrivesInOurUnits) {
  const TemporaryFolder folder;
  std::string text = "ms,pos1,pos2,motor,force,note\n";
  for (int k = 0; k < 5; ++k) text += std::to_string(4 * k) + ",-180,250,0.5,0.25,x\n";
  const Log log = ReadLog(folder.Write("log.csv", text), ReadChannelMap(folder.Write("map.toml", kMap)), 2);
  ASSERT_EQ(log.joints, 2);
  EXPECT_DOUBLE_EQ(log.t[1], 0.004);
  EXPECT_DOUBLE_EQ(log.q(0, 0), -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(log.q(0, 1), 0.5);
  EXPECT_DOUBLE_EQ(log.tau(0, 0), -50);
  EXPECT_DOUBLE_EQ(log.tau(0, 1), 250);
  EXPECT_EQ(log.temp.size(), 0);
}

TEST(Channels, OptionalQuantityInTheLog_IsRead) {
  const TemporaryFolder folder;
  std::string text = "ms,pos1,pos2,motor,force,T1,T2\n";
  for (int k = 0; k < 5; ++k) text += std::to_string(4 * k) + ",0,0,0,0,293.15,300\n";
  const Log log = ReadLog(folder.Write("log.csv", text), ReadChannelMap(folder.Write("map.toml", kMap)), 2);
  ASSERT_EQ(log.temp.cols(), 2);
  EXPECT_NEAR(log.temp(0, 0), 20.0, 1e-9);
}

TEST(Channels, MissingForeignColumn_IsNamedAsInTheLog) {
  const TemporaryFolder folder;
  const auto path = folder.Write("log.csv", "ms,pos1,motor,force\n0,1,2,3\n4,1,2,3\n");
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", kMap));
  EXPECT_EQ(ErrorOf([&] { ReadLog(path, map, 2); }), path.string() + ":1: no column 'pos2', which the channel map " +
                                                         (folder / "map.toml").string() +
                                                         " names; it names all others");
}

TEST(Channels, TimeInNanoseconds_IsReadAsSeconds) {
  const TemporaryFolder folder;
  std::string map = kMap, text = "ms,pos1,pos2,motor,force\n";
  map.replace(map.find("\"ms\"\n[q]"), 4, "\"ns\"");
  for (int k = 0; k < 5; ++k) text += std::to_string(4000000 * k) + ",0,0,0.5,0.25\n";
  EXPECT_DOUBLE_EQ(ReadLog(folder.Write("log.csv", text), ReadChannelMap(folder.Write("map.toml", map)), 2).t[1],
                   0.004);
}

// Motor 1 turns joint 1. Motor 2 turns joint 2, and is turned along by joint 1: motor 2 = joint 2 + 0.5 joint 1. So
// joint 2 = motor 2 - 0.5 motor 1, and the torque of joint 1 is that of motor 1 + 0.5 of motor 2.
const std::string kCoupled = R"(
joints = 2
[time]
column = "t"
unit = "s"
[q]
column = "motor{}"
unit = "rad"
scale = [0.5, 0.25]
matrix = [[1, 0], [-0.5, 1]]
[qd]
column = "speed{}"
unit = "rad/s"
matrix = [[1, 0], [-0.5, 1]]
[tau]
column = "current{}"
unit = "N*m"
scale = [2, 10]
matrix = [[1, 0.5], [0, 1]]
[tau_link]
column = "sensor{}"
unit = "mN*m"
)";

std::string CoupledLog() {
  std::string text = "t,motor1,motor2,speed1,speed2,current1,current2,sensor1,sensor2\n";
  for (int k = 0; k < 5; ++k)
    text +=
        "0." + std::to_string(k) + ",4," + std::to_string(16 + k) + ",3,7,1,0.2," + std::to_string(900 + k) + ",800\n";
  return text;
}

TEST(Channels, CoupledMotors_ArriveAsJoints) {
  const TemporaryFolder folder;
  const Log log = ReadLog(folder.Write("log.csv", CoupledLog()), ReadChannelMap(folder.Write("map.toml", kCoupled)), 2);
  // motors at 2 and 4 rad, 3 and 7 rad/s, with 2 and 2 N m
  EXPECT_DOUBLE_EQ(log.q(0, 0), 2);
  EXPECT_DOUBLE_EQ(log.q(0, 1), 4 - 0.5 * 2);
  EXPECT_DOUBLE_EQ(log.qd(0, 0), 3);
  EXPECT_DOUBLE_EQ(log.qd(0, 1), 7 - 0.5 * 3);
  EXPECT_DOUBLE_EQ(log.tau(0, 0), 2 + 0.5 * 2);
  EXPECT_DOUBLE_EQ(log.tau(0, 1), 2);
}

TEST(Channels, OfTwoTorques_TheNamedOneIsRead) {
  const TemporaryFolder folder;
  const auto path = folder.Write("log.csv", CoupledLog());
  const Log log = ReadLog(path, ReadChannelMap(folder.Write("map.toml", "torque = \"tau_link\"\n" + kCoupled)), 2);
  EXPECT_DOUBLE_EQ(log.tau(0, 0), 0.9);  // a sensor behind the gear: not mixed
  EXPECT_DOUBLE_EQ(log.tau(0, 1), 0.8);
  EXPECT_EQ(log.ignored, (std::vector<std::string>{"current1", "current2"}));
  const Log motors = ReadLog(path, ReadChannelMap(folder.Write("m.toml", "torque = \"tau\"\n" + kCoupled)), 2);
  EXPECT_DOUBLE_EQ(motors.tau(0, 1), 2);
  const std::string unused = "tau_link of the channel map is not read; torque = \"tau_link\" in the map takes it";
  EXPECT_EQ(motors.notes.back(), unused);
}

TEST(Channels, NumbersFromZeroAndNames_StandForTheJoints) {
  const TemporaryFolder folder;
  std::string text = kMap, names = "names = [\"base\", \"arm\"]\nmessages = [\"msg/A.msg\"]\n";
  text.replace(text.find("pos{}"), 5, "pos{0}");
  text.replace(text.find("T{}"), 3, "{joint}/T");
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", names + text));
  EXPECT_EQ(map.quantities[0].joint[0].column, "pos0");
  EXPECT_EQ(map.quantities[0].joint[1].column, "pos1");
  EXPECT_EQ(map.quantities[2].joint[1].column, "arm/T");
  EXPECT_EQ(map.definitions, std::vector<std::filesystem::path>{folder / "msg/A.msg"});
  const auto error = [&](const std::string& before) {
    const auto path = folder.Write("bad.toml", before + text);
    return ErrorOf([&] { ReadChannelMap(path); }).substr(path.string().size());
  };
  EXPECT_EQ(error(""), ": temp.column: {joint} needs the joints' names, as in names = [\"base\", \"elbow\"]");
  EXPECT_EQ(error("names = [\"a\"]\n"), ": names: expected a list of 2 names, one a joint");
  EXPECT_EQ(error("names = \"a\"\n"), ": names: expected a list of texts");
  EXPECT_EQ(error("messages = [1]\n"), ": messages: expected a list of texts");
}

TEST(Channels, MapWithoutTime_TakesTheColumnOfPlotJuggler) {
  const TemporaryFolder folder;
  std::string text = kMap;
  text.erase(text.find("[time]"), text.find("[q]") - text.find("[time]"));
  const ChannelMap map = ReadChannelMap(folder.Write("map.toml", text));
  EXPECT_EQ(map.time.column, "__time");
  EXPECT_EQ(map.time.gain, 1);
}

TEST(Channels, BadMatrixOrTorque_NamesKeyAndExpected) {
  const TemporaryFolder folder;
  const auto error = [&folder](const std::string& from, const std::string& to) {
    std::string text = "torque = \"tau\"" + kCoupled;
    text.replace(text.find(from), from.size(), to);
    const auto path = folder.Write("map.toml", text);
    const std::string message = ErrorOf([&] { ReadChannelMap(path); });
    return message.starts_with(path.string()) ? message.substr(path.string().size()) : message;
  };
  const std::string rows = "expected 2 rows of 2 numbers, one row a joint";
  EXPECT_EQ(error("[[1, 0], [-0.5, 1]]", "[[1, 0]]"), ": q.matrix: " + rows);
  EXPECT_EQ(error("[[1, 0], [-0.5, 1]]", "[[1, 0], [-0.5, \"a\"]]"), ": q.matrix: " + rows);
  EXPECT_EQ(error("[[1, 0], [-0.5, 1]]", "[1, 0, -0.5, 1]"), ": q.matrix: " + rows);
  EXPECT_EQ(error("[[1, 0], [-0.5, 1]]", "[[1, 2], [-0.5, -1]]"),
            ": q.matrix: expected rows that are independent: each motor turns some joint");
  EXPECT_EQ(error("[[1, 0.5], [0, 1]]", "[[1, -0.5], [0, 1]]").substr(0, 36), ": tau.matrix: expected the transpose");
  EXPECT_EQ(error("[time]", "[time]\nmatrix = [[1]]"),
            ": time.matrix: only positions, speeds, accelerations and torques take a matrix");
  EXPECT_EQ(error("\"tau\"", "\"link\""), ": torque: expected \"tau\" or \"tau_link\", the torque to use");
  EXPECT_EQ(error("[tau_link]", "[tau_sensor]"),
            ": tau_sensor: unknown key, expected joints, names, title, messages, time, torque or a quantity");
  EXPECT_EQ(error("mN*m", "mN"), ": tau_link.unit: 'mN' is no unit of torque, expected N*m, mN*m, kN*m, kgf*m, N, kN");
}

TEST(Channels, BadMap_NamesKeyAndExpected) {
  const TemporaryFolder folder;
  const auto error = [&folder](const std::string& from, const std::string& to) {
    std::string text = kMap;
    text.replace(text.find(from), from.size(), to);
    const auto path = folder.Write("map.toml", text);
    const std::string message = ErrorOf([&] { ReadChannelMap(path); });
    return message.starts_with(path.string()) ? message.substr(path.string().size()) : message;
  };
  EXPECT_EQ(error("joints = 2", "joints = 0"), ": joints: expected a number of joints, 1 to 64");
  EXPECT_EQ(error("[time]", "[clock]"),
            ": clock: unknown key, expected joints, names, title, messages, time, torque or a quantity");
  EXPECT_EQ(error("unit = \"ms\"", "unit = \"min\""), ": time.unit: 'min' is no unit of time, expected s, ms, us, ns");
  EXPECT_EQ(error("\"mm\"]", "\"mm\", \"m\"]"), ": q.unit: expected one text or a list of 2");
  EXPECT_EQ(error("[1, 2]", "[1, \"two\"]"), ": q.scale: expected a list of numbers");
  EXPECT_EQ(error("\"pos{}\"", "\"pos\""), ": q.column: 'pos' is used for two joints");
  EXPECT_EQ(error("offset", "ofset"),
            ": q.ofset: unknown key, expected column, unit, scale, offset, optional or matrix");
  EXPECT_EQ(error("[tau]", "[qref]").substr(0, 5), ": tau");
  EXPECT_EQ(error("joints = 2", "joints = = 2").substr(0, 9), ": line 2,");
}

}  // namespace
}  // namespace armcal::logs
