// bags tests - recordings that other people's libraries wrote (recordings/write.py) hold the numbers of drive.csv.
#include <gtest/gtest.h>

#include <cmath>

#include "host_sim/data/bags/recording.hpp"
#include "host_sim/data/bags/unpack.hpp"
#include "host_sim/data/files/csv.hpp"
#include "tests/unit/bags/mcap_bytes.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;
namespace fs = std::filesystem;

const fs::path kFolder = "tests/unit/bags/recordings";
constexpr std::int64_t kStamp_ns = 1700000000123456789;  // as in write.py

const Eigen::MatrixXd& Truth() {
  static const Eigen::MatrixXd values = files::ReadCsv(kFolder / "drive.csv").values;  // t q1 q2 q3 tau1 tau2 tau3
  return values;
}

std::int64_t StampOf(Eigen::Index row) { return kStamp_ns + std::llround(1e9 * (Truth()(row, 0) - Truth()(0, 0))); }

Eigen::VectorXd ColumnOf(const Stream& stream, const std::string& name) {
  const auto at = std::find(stream.names.begin(), stream.names.end(), name);
  if (at == stream.names.end()) throw std::runtime_error("no column " + name);
  return stream.values.col(at - stream.names.begin());
}

const Stream& StreamOf(const Recording& recording, const std::string& topic) {
  for (const Stream& stream : recording.streams)
    if (stream.topic == topic) return stream;
  throw std::runtime_error("no topic " + topic);
}

// The columns are those of drive.csv to the last bit, and the stamps are those of the headers.
void ExpectDrive(const Stream& stream, const std::vector<std::string>& columns, int step = 1) {
  ASSERT_EQ(stream.values.rows(), Truth().rows() / step);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const Eigen::VectorXd found = ColumnOf(stream, columns[c]);
    for (Eigen::Index k = 0; k < found.size(); ++k)
      ASSERT_EQ(found[k], Truth()(step * k, static_cast<Eigen::Index>(c) + 1)) << columns[c] << ", row " << k;
  }
}

void ExpectHeaderStamps(const Stream& stream, int step = 1) {
  EXPECT_FALSE(stream.recorder_time);
  for (std::size_t k = 0; k < stream.stamp_ns.size(); ++k)
    ASSERT_EQ(stream.stamp_ns[k], StampOf(step * static_cast<Eigen::Index>(k)));
}

const std::vector<std::string> kJointStates = {"/joint_states/shoulder/position", "/joint_states/elbow/position",
                                               "/joint_states/wrist/position",    "/joint_states/shoulder/effort",
                                               "/joint_states/elbow/effort",      "/joint_states/wrist/effort"};

TEST(Recordings, JointStatesInChangingOrder_AreThoseOfTheDrive) {
  for (const char* name : {"joint_states_none.mcap", "joint_states_lz4.mcap", "joint_states_zstd.mcap", "plain.db3.zst",
                           "big_endian.db3.zst", "split"}) {
    SCOPED_TRACE(name);
    const Recording recording = ReadRecording(kFolder / name, {kJointStates, {}, false});
    ASSERT_EQ(recording.streams.size(), 1u);
    ExpectDrive(recording.streams[0], kJointStates);
    ExpectHeaderStamps(recording.streams[0]);
    EXPECT_EQ(recording.notes, std::vector<std::string>{"/joint_states: time is header.stamp"});
    EXPECT_EQ(recording.topics, std::vector<std::string>{"/joint_states (sensor_msgs/msg/JointState)"});
  }
}

// rosbag2 may write with a write-ahead log. After it has closed the file, the header still says so.
TEST(Recordings, ADatabaseWithAWriteAheadLog_IsReadWhenItIsPacked) {
  const TemporaryFolder folder;
  std::string bytes = UnpackZstd(files::test::ReadBytes(kFolder / "plain.db3.zst"));
  bytes[18] = bytes[19] = 2;
  const Recording recording =
      ReadRecording(folder.Write("wal.db3.zst", test::ZstdFrame(bytes)), {kJointStates, {}, false});
  ExpectDrive(StreamOf(recording, "/joint_states"), kJointStates);
}

TEST(Recordings, ColumnsThatNobodyAskedFor_AreNamed) {
  const Recording recording =
      ReadRecording(kFolder / "joint_states_zstd.mcap", {{"/joint_states/elbow/effort"}, {}, false});
  EXPECT_EQ(recording.streams.at(0).names, std::vector<std::string>{"/joint_states/elbow/effort"});
  EXPECT_EQ(recording.ignored.size(), 5u);
}

TEST(Recordings, RecorderTime_IsUsedWhereItIsAskedFor) {
  const Recording recording = ReadRecording(kFolder / "joint_states_lz4.mcap", {kJointStates, {}, true});
  const Stream& stream = recording.streams.at(0);
  EXPECT_TRUE(stream.recorder_time);
  for (std::size_t k = 0; k < stream.stamp_ns.size(); ++k) {
    // write.py: 1 to 3 ms after the header's stamp, less than a step of 8 ms
    const std::int64_t late_ns = stream.stamp_ns[k] - StampOf(static_cast<Eigen::Index>(k));
    ASSERT_GE(late_ns, 1000000);
    ASSERT_LT(late_ns, 3000000);
  }
  EXPECT_EQ(recording.notes, std::vector<std::string>{"/joint_states: time is the recorder's, as asked for"});
}

TEST(Recordings, Json_IsRead) {
  const std::vector<std::string> columns = {"robot/joints/a/angle",  "robot/joints/b/angle",  "robot/joints/c/angle",
                                            "robot/joints/a/torque", "robot/joints/b/torque", "robot/joints/c/torque"};
  const Recording recording = ReadRecording(kFolder / "robot_json.mcap", {});
  const Stream& stream = recording.streams.at(0);
  ExpectDrive(stream, columns);
  ExpectHeaderStamps(stream);
  EXPECT_EQ(ColumnOf(stream, "robot/state/enabled")[3], 1);
  EXPECT_EQ(ColumnOf(stream, "robot/state/load[0]")[3], 0.5);
  EXPECT_EQ(stream.names.size(), 8u);
}

TEST(Recordings, TypesWithoutADefinitionInTheBag_AreKnown) {
  const Recording recording = ReadRecording(kFolder / "types.db3.zst", {});
  const Stream& dynamic = StreamOf(recording, "/dynamic");
  ExpectDrive(dynamic, {"/dynamic/shoulder/position", "/dynamic/elbow/position", "/dynamic/wrist/position",
                        "/dynamic/shoulder/effort", "/dynamic/elbow/effort", "/dynamic/wrist/effort"});
  ExpectHeaderStamps(dynamic);
  EXPECT_EQ(dynamic.names.size(), 6u);
  const Stream& array = StreamOf(recording, "/array");
  ExpectDrive(array, {"/array/data[0]", "/array/data[1]", "/array/data[2]", "/array/data[3]", "/array/data[4]",
                      "/array/data[5]"});
  EXPECT_TRUE(array.recorder_time);  // it has no header
  const Stream& tcp = StreamOf(recording, "/tcp");
  ExpectDrive(tcp, {"/tcp/twist/linear/x", "/tcp/twist/linear/y", "/tcp/twist/linear/z"});
  EXPECT_EQ(ColumnOf(tcp, "/tcp/twist/angular/y")[7], 5);
  const Stream& ft = StreamOf(recording, "/ft");
  ASSERT_EQ(ft.values.rows(), 120);
  for (Eigen::Index k = 0; k < 120; ++k) ASSERT_EQ(ColumnOf(ft, "/ft/wrench/force/z")[k], Truth()(2 * k, 6));
  EXPECT_EQ(ColumnOf(ft, "/ft/wrench/torque/x")[7], 1);
  ExpectHeaderStamps(ft, 2);
}

TEST(Recordings, UnknownType_NeedsItsFile) {
  const TemporaryFolder folder;
  const fs::path bag = kFolder / "types.db3.zst";
  const std::string no_definition =
      "topic /status (my_robot/msg/Status): no definition of my_robot/msg/Status; give its file with --msg";
  EXPECT_EQ(ErrorOf([&] { ReadRecording(bag, {{"/status/mode"}, {}, false}); }), bag.string() + ": " + no_definition);
  const Recording all = ReadRecording(bag, {});  // a topic that nobody named may be unknown
  EXPECT_EQ(std::count(all.notes.begin(), all.notes.end(), no_definition), 1);

  const fs::path file = folder.Write(
      "Status.msg",
      "# a comment\nint8 MODE_OFF=0\nfloat32 bus_voltage 48.0 # default\nuint16[3] raw\nint8 mode\nbool ready\n"
      "float64[<=4] spare\nstring<=20 text\n");
  const Recording recording =
      ReadRecording(bag, {{"/status/mode", "/status/raw[2]", "/status/spare[0]"}, {file}, false});
  const Stream& stream = recording.streams.at(0);
  EXPECT_EQ(ColumnOf(stream, "/status/mode")[5], -3);
  EXPECT_EQ(ColumnOf(stream, "/status/raw[2]")[5], 65535);
  for (Eigen::Index k = 0; k < 240; ++k) ASSERT_EQ(ColumnOf(stream, "/status/spare[0]")[k], Truth()(k, 4));
}

TEST(Recordings, AreToldByTheirContent) {
  const TemporaryFolder folder;
  EXPECT_TRUE(IsRecording(kFolder / "joint_states_none.mcap"));
  EXPECT_TRUE(IsRecording(kFolder / "plain.db3.zst"));
  EXPECT_TRUE(IsRecording(kFolder / "split" / "split_0.db3"));
  EXPECT_TRUE(IsRecording(kFolder / "split"));
  EXPECT_FALSE(IsRecording(kFolder / "drive.csv"));
  EXPECT_FALSE(IsRecording(folder.Write("empty.mcap", "")));
}

}  // namespace
}  // namespace armcal::bags
