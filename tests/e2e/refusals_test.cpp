// end-to-end tests - give hostile files, bad tables and a silent link: each ends in its exit code and one line.
#include <fstream>
#include <thread>

#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/vendor_registers.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kBadInput = 2, kLink = 3, kRefused = 4, kMismatch = 5;

// 1.6 GB in a file of 1.6 MB, and a log of 200,000 columns.
TEST(BadFiles, MadeToFillTheMemory_AreRefusedWithinTwoHundredMegabytes) {
  const fs::path folder = FreshFolder("bad_files");
  files::WriteWholeFile(folder / "part.gz", std::string(std::size_t{64} << 20, '0'));
  const std::string part = ReadText(folder / "part.gz");
  std::string bomb, columns = "t";
  for (int k = 0; k < 24; ++k) bomb += part;  // gzip data may follow gzip data
  for (int k = 0; k < 200000; ++k) columns += ",c" + std::to_string(k);
  std::ofstream(folder / "bomb.csv.gz", std::ios::binary) << bomb;
  std::ofstream(folder / "columns.csv") << columns << "\n";
  for (const auto& [log, named] :
       {std::pair{"bomb.csv.gz", "more than 60 times its size"}, std::pair{"columns.csv", "more than 4096 columns"}}) {
    const Outcome o = Tool({"identify", "--robot", "er20_like", "--train", (folder / log).string()});
    ExpectOneLine(o, kBadInput, named);
    EXPECT_LT(o.peak_kB, 200000) << named;
    std::printf("%s: %ld kB\n", named, o.peak_kB);
  }
}

class Flashing : public testing::Test {
 protected:
  Flashing()
      : model_(codegen::ReadRobot("codegen/robots/er20_like.toml"), codegen::ReadCatalogue("codegen/effects")),
        table_(calibration::DefaultTable(model_)) {}
  std::string File(const std::string& name, const calibration::TableFile& t) const {
    calibration::WriteTable(folder_ / name, t);
    return (folder_ / name).string();
  }
  Outcome Verb(const std::string& verb, const std::string& table, const std::string& robot = "er20_like",
               const std::vector<std::string>& more = {}) const {
    fs::remove(folder_ / "out.json");
    std::vector<std::string> words = {verb,      "--connect", drive_.address(),
                                      "--robot", robot,       "--table",
                                      table,     "--json",    (folder_ / "out.json").string()};
    words.insert(words.end(), more.begin(), more.end());
    return Tool(words);
  }
  // Refused with this code, reported as not done, and the table before it is still in force.
  void ExpectFlashRefused(const std::string& table, int code, const std::string& named,
                          const std::string& robot = "er20_like") {
    ExpectOneLine(Verb("flash", table, robot), code, named);
    const nlohmann::json report = ReadJson(folder_ / "out.json");
    EXPECT_FALSE(report.at("readback_ok").get<bool>());
    EXPECT_EQ(report.at("exit_code"), code);
    EXPECT_NE(report.at("error").get<std::string>().find(named), std::string::npos) << report;
    EXPECT_EQ(Verb("verify", good_).code, 0);
  }
  void SetUp() override {
    table_.row[66].mean += 1;  // not what the drive starts with
    good_ = File("good.toml", table_);
    const Outcome o = Verb("flash", good_);
    ASSERT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(ReadJson(folder_ / "out.json").at("readback_ok").get<bool>());
  }

  fs::path folder_ = FreshFolder("flashing");
  RunningDrive drive_{folder_};
  codegen::Model model_;
  calibration::TableFile table_;
  std::string good_;
};

TEST_F(Flashing, TablesThatCannotBe_AreRefusedAndTheOldOneStays) {
  calibration::TableFile t = table_;
  t.row[22 + 4].mean = 1e-6;  // Ixx of link 3, whose Iyy and Izz are not alike
  ExpectFlashRefused(File("unphysical.toml", t), kRefused, "nphysical");
  t = table_;
  t.joint.pop_back();
  ExpectFlashRefused(File("joints.toml", t), kBadInput, "joints.toml");
  t = table_;
  t.row[70].state = "guessed";
  ExpectFlashRefused(File("state.toml", t), kBadInput, "state");
  ExpectFlashRefused((folder_ / "absent.toml").string(), kBadInput, "absent.toml");
}

// The tool refuses them before anything is sent, by the name of the number and with its bound.
TEST_F(Flashing, TablesBeyondTheCeilings_AreRefusedByTheTool) {
  calibration::TableFile t = table_;
  t.joint[1].torque_limit_Nm = 1e30;
  ExpectFlashRefused(File("limit.toml", t), kBadInput,
                     "limit.toml: joint 2: torque_limit_Nm is 1.00000002e+30, expected at most 2200");
  t = table_;
  t.row[66].mean = -99999;
  ExpectFlashRefused(File("friction.toml", t), kBadInput, "friction.toml: " + t.row[66].name + ": mean is -99999");
  t = table_;
  t.row[66].mean = 60, t.row[67].mean = -60;
  ExpectFlashRefused(File("pushes.toml", t), kBadInput, t.row[67].name + ": mean: the joint's friction would push by");
  t = table_;
  t.row[66].mean = 60, t.row[67].mean = -10;  // rises less than in proportion to speed
  EXPECT_EQ(Verb("flash", File("sublinear.toml", t)).code, 0);
}

TEST_F(Flashing, AnotherSchema_IsRefused) {
  const codegen::Model two(codegen::ReadRobot("codegen/robots/two_link.toml"),
                           codegen::ReadCatalogue("codegen/effects"));
  const std::string table = File("two.toml", calibration::DefaultTable(two));
  ExpectFlashRefused(table, kRefused, "schema", "two_link");  // the tool's model is not the drive's
  ExpectFlashRefused(table, kBadInput, "two.toml: is a table of robot two_link, expected one of robot er20_like");
  calibration::TableFile renamed = table_;
  renamed.robot = "er21_like";
  ExpectFlashRefused(File("renamed.toml", renamed), kBadInput, "give --robot er21_like");
}

TEST_F(Flashing, RowsThatTheModelDoesNotHave_AreRefused) {
  calibration::TableFile t = table_;
  t.row[66].name = "FC1";
  ExpectFlashRefused(File("misspelt.toml", t), kBadInput, "the nearest is Fc1");
  t = table_;
  t.row[66].unit = "N*mm";
  ExpectFlashRefused(File("unit.toml", t), kBadInput, "Fc1: unit is N*mm, expected N*m");
  t = table_;
  t.row.push_back(t.row[66]);
  ExpectFlashRefused(File("twice.toml", t), kBadInput, "Fc1 is there twice");
}

TEST_F(Flashing, APartOfATable_KeepsTheRestAndNamesIt) {
  calibration::TableFile t = table_;
  t.row = {table_.row[66]};
  t.row[0].mean += 1;
  const std::string part = File("part.toml", t);
  const std::size_t others = table_.row.size() - 1;
  EXPECT_EQ(Verb("flash", part).code, 0);
  EXPECT_EQ(ReadJson(folder_ / "out.json").at("kept").size(), others);
  EXPECT_EQ(ReadJson(folder_ / "out.json").at("kept")[0], table_.row[0].name);
  EXPECT_EQ(Verb("verify", part).code, 0);
  EXPECT_EQ(ReadJson(folder_ / "out.json").at("same"), true);
  EXPECT_EQ(ReadJson(folder_ / "out.json").at("not_compared").size(), others);
}

// Of a model with an effect that this drive does not have.
TEST_F(Flashing, ATableOfAnotherVersionOfTheModel_IsCarriedOverOnlyIfThatIsSaid) {
  calibration::TableFile t = table_;
  t.schema ^= 1;
  t.row.push_back(t.row[66]);
  t.row.back().name = "stribeck.dFs1";
  ExpectFlashRefused(File("other_version.toml", t), kBadInput, "stribeck.dFs1: not in the model of er20_like");
  Outcome o = Verb("flash", File("other_version.toml", t), "er20_like", {"--leave-out"});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("another version of the model"), std::string::npos) << o.out;
  EXPECT_NE(o.out.find("left out: stribeck.dFs1"), std::string::npos) << o.out;
  t.row = {t.row.back()};
  o = Verb("verify", File("nothing.toml", t), "er20_like", {"--leave-out"});
  EXPECT_EQ(o.code, kMismatch) << o.out;
  EXPECT_NE(o.out.find("no parameter was compared"), std::string::npos) << o.out;
  EXPECT_TRUE(ReadJson(folder_ / "out.json").at("same").is_null());
}

TEST_F(Flashing, ADryRun_NamesWhatWouldChangeAndKeepsNothing) {
  calibration::TableFile t = table_;
  t.row[66].mean += 1;
  const fs::path database = folder_ / "dry.sqlite", json = folder_ / "dry.json";
  const Outcome o =
      Tool({"flash", "--connect", drive_.address(), "--robot", "er20_like", "--table", File("dry.toml", t), "--dry-run",
            "--db", database.string(), "--arm", "left", "--json", json.string()});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("Fc1: "), std::string::npos) << o.out;
  const nlohmann::json told = ReadJson(json);
  EXPECT_TRUE(told.at("dry_run").get<bool>());
  ASSERT_EQ(told.at("changes").size(), 1u) << told;
  EXPECT_EQ(told.at("changes")[0].at("name"), "Fc1");
  EXPECT_NEAR(told.at("changes")[0].at("to").get<double>() - told.at("changes")[0].at("from").get<double>(), 1, 1e-5)
      << "two floats near 60";
  EXPECT_FALSE(fs::exists(database));
  EXPECT_EQ(Verb("verify", good_).code, 0);
}

TEST_F(Flashing, ADifferentTable_DoesNotVerify) {
  calibration::TableFile t = table_;
  t.row[67].mean *= 1.5;
  const Outcome o = Verb("verify", File("other.toml", t));
  EXPECT_EQ(o.code, kMismatch) << o.err;
  EXPECT_NE(o.out.find(t.row[67].name), std::string::npos) << o.out;
}

TEST_F(Flashing, WhileAnAxisIsEnabled_IsRefused) {
  client::DriveClient drive("127.0.0.1", drive_.port());
  const auto command = [&](client::PlayerCommand c) {
    drive.WriteSingle(client::kPlayerCommand, static_cast<std::uint16_t>(c));
    const bool enable = c == client::PlayerCommand::kEnable;
    for (int k = 0; k < 20000 && (drive.ReadStatus().enabled_axes != 0) != enable; ++k) std::this_thread::yield();
    ASSERT_EQ(drive.ReadStatus().enabled_axes != 0, enable);
  };
  calibration::TableFile t = table_;
  t.row[67].mean *= 1.5;
  const std::string other = File("other.toml", t);
  command(client::PlayerCommand::kEnable);
  ExpectFlashRefused(other, kRefused, "nabled");
  command(client::PlayerCommand::kDisable);
  EXPECT_EQ(Verb("flash", other).code, 0);
  EXPECT_EQ(Verb("verify", other).code, 0);
}

// It takes the connection and never says a word.
TEST(Link, ADriveThatDoesNotAnswer_IsALinkError) {
  const fs::path folder = FreshFolder("link");
  const std::string table = (folder / "table.toml").string();
  const codegen::Model model(codegen::ReadRobot("codegen/robots/er20_like.toml"),
                             codegen::ReadCatalogue("codegen/effects"));
  calibration::WriteTable(table, calibration::DefaultTable(model));
  const TakenPort silent(true);
  ExpectOneLine(Tool({"flash", "--connect", silent.address(), "--robot", "er20_like", "--table", table}), kLink,
                silent.address());
  const TakenPort closed(false);
  const std::string json = (folder / "verify.json").string();
  ExpectOneLine(
      Tool({"verify", "--connect", closed.address(), "--robot", "er20_like", "--table", table, "--json", json}), kLink,
      "cannot connect");
  EXPECT_TRUE(ReadJson(json).at("same").is_null());
}

}  // namespace
}  // namespace armcal::tests
