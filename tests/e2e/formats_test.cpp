// end-to-end tests - armcal channels and armcal convert on the formats that robots record.
#include <fstream>

#include "host_sim/data/files/csv.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

const fs::path kLogs = "tests/unit/bags/recordings";

TEST(Formats, ChannelsThenConvert_GiveTheLogOfTheDrive_ToTheLastBit) {
  const fs::path folder = FreshFolder("formats");
  const Eigen::MatrixXd drive = files::ReadCsv(kLogs / "drive.csv").values;  // t q1 q2 q3 tau1 tau2 tau3
  for (const char* name : {"joint_states_lz4.mcap", "split", "drive_5.mat", "drive.csv"}) {
    const std::string log = (kLogs / name).string(), map = (folder / "map.toml").string(),
                      out = (folder / "out.csv.gz").string();
    const Outcome looked = Tool({"channels", log, "-o", map, "--overwrite"});
    ASSERT_EQ(looked.code, 0) << looked.err;
    EXPECT_NE(looked.out.find("recognised: q, tau"), std::string::npos) << looked.out;
    const Outcome converted = Tool({"convert", log, "--channels", map, "-o", out});
    ASSERT_EQ(converted.code, 0) << converted.err;
    const files::NumericTable table = files::ReadCsv(out);
    EXPECT_EQ(table.names, (std::vector<std::string>{"t", "q1", "q2", "q3", "tau1", "tau2", "tau3"})) << name;
    EXPECT_EQ(table.values.rightCols(6), drive.rightCols(6)) << name;
    EXPECT_LE((table.values.col(0).array() - (drive.col(0).array() - drive(0, 0))).abs().maxCoeff(), 1e-6) << name;
  }
}

TEST(Formats, ChosenTime_IsPrinted) {
  const fs::path folder = FreshFolder("formats_time");
  const std::string log = (kLogs / "plain.db3.zst").string(), map = (folder / "map.toml").string();
  ASSERT_EQ(Tool({"channels", log, "-o", map}).code, 0);
  EXPECT_NE(Tool({"convert", log, "--channels", map, "-o", (folder / "out.csv").string()})
                .err.find("/joint_states: time is header.stamp"),
            std::string::npos);
  ExpectOneLine(Tool({"channels", log, "-o", map}), 2, "--overwrite");
}

TEST(Formats, AMapThatIsPrinted_NamesDefinitionsFromTheCurrentFolder) {
  const fs::path folder = FreshFolder("formats_printed"), type = folder / "Status.msg";
  std::ofstream(type) << "float64 value\n";
  const Outcome o = Tool({"channels", (kLogs / "plain.db3.zst").string(), "--msg", type.string()});
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("messages = [\"" + fs::proximate(type).string() + "\"]"), std::string::npos) << o.out;
}

TEST(Formats, DefinitionOfAMessage_IsTakenByEveryVerbThatReadsLogs) {
  const fs::path folder = FreshFolder("formats_msg");
  const std::string log = (kLogs / "types.db3.zst").string(), map = (folder / "map.toml").string(),
                    other = (folder / "other.db3.zst").string(), type = (folder / "Status.msg").string();
  fs::copy_file(log, other);
  std::ofstream(map) << "joints = 3\n[q]\ncolumn = \"/array/data[{0}]\"\nunit = \"rad\"\n[tau]\n"
                        "column = [\"/array/data[3]\", \"/array/data[4]\", \"/array/data[5]\"]\nunit = \"N*m\"\n"
                        "[flag]\ncolumn = [\"/status/mode\", \"/status/raw[0]\", \"/status/raw[1]\"]\n";
  std::ofstream(type)
      << "float32 bus_voltage\nuint16[3] raw\nint8 mode\nbool ready\nfloat64[<=4] spare\nstring<=20 text\n";
  const std::vector<std::vector<std::string>> verbs = {
      {"identify", "--robot", "er20_like", "--train", log},
      {"identify", "--robot", "er20_like", "--with", log, "--without", log},
      {"diagnose", "--robot", "er20_like", "--train", log, "--test", other},
      {"choose", "--robot", "er20_like", "--train", log, "--test", other},
      {"evaluate", "--robot", "er20_like", log},
      {"replay", "--robot", "er20_like", log},
      {"convert", log, "-o", (folder / "out.csv").string()}};
  for (std::vector<std::string> words : verbs) {
    words.insert(words.end(), {"--channels", map});
    const Outcome without = Tool(words);
    EXPECT_NE(without.code, 0) << words[0];
    EXPECT_NE(without.err.find("no definition of my_robot/msg/Status"), std::string::npos) << words[0] << without.err;
    words.insert(words.end(), {"--msg", type});
    const Outcome with = Tool(words);  // the log has three joints, the robot six
    EXPECT_EQ(with.code == 0, words[0] == "convert") << with.err;
    EXPECT_EQ(with.err.find("no definition"), std::string::npos) << words[0] << with.err;
    EXPECT_EQ(with.err.find("--msg"), std::string::npos) << words[0] << with.err;
  }
}

TEST(Formats, BadLog_IsOneLine_AndLeavesNothing) {
  const fs::path folder = FreshFolder("formats_bad");
  const std::string map = (folder / "map.toml").string(), out = (folder / "out.csv").string();
  ASSERT_EQ(Tool({"channels", (kLogs / "drive_4.mat").string(), "-o", map}).code, 0);
  std::string text = ReadText(kLogs / "joint_states_lz4.mcap");
  std::ofstream(folder / "cut.mcap", std::ios::binary) << text.substr(0, 300);
  ExpectOneLine(Tool({"convert", (folder / "cut.mcap").string(), "--channels", map, "-o", out}), 2, "is cut short");
  ExpectOneLine(Tool({"identify", "--robot", "er20_like", "--train", (kLogs / "drive_4.mat").string()}), 2,
                "expected a channel map (--channels)");
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace armcal::tests
