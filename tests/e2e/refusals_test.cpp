// end-to-end tests - give bad files, tables and links: each ends in its exit code and one line, nothing half written.
#include <cmath>
#include <fstream>
#include <functional>
#include <thread>

#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/vendor_registers.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kBadInput = 2, kLink = 3, kRefused = 4, kMismatch = 5;

// A log that is good but for what `change` does to its cells (row 0 is the header; column 0 is t).
using Cells = std::vector<std::vector<std::string>>;
std::string LogText(int rows, const std::function<void(Cells&)>& change = {}) {
  Cells cells(1, {"t"});
  for (const char* name : {"q", "tau"})
    for (int j = 1; j <= 6; ++j) cells[0].push_back(name + std::to_string(j));
  for (int k = 0; k < rows; ++k) {
    cells.push_back({std::to_string(0.008 * k)});
    for (int j = 0; j < 12; ++j)  // 1.9 rad/s at most: within the arm's limits
      cells.back().push_back(std::to_string((j < 6 ? 0.3 : 1) * std::sin(0.05 * k + j)));
  }
  if (change) change(cells);
  std::string text;
  for (const auto& row : cells)
    for (std::size_t c = 0; c < row.size(); ++c) text += row[c] + (c + 1 < row.size() ? "," : "\n");
  return text;
}

class BadFiles : public testing::Test {
 protected:
  fs::path Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  // identify on this robot and log has to fail naming `named`, and to leave neither JSON nor table behind.
  void ExpectRefused(const std::string& robot, const fs::path& log, const std::string& named) const {
    const fs::path json = folder_ / "out.json", table = folder_ / "out.toml";
    ExpectOneLine(Tool({"identify", "--robot", robot, "--train", log.string(), "--json", json.string(), "--table-out",
                        table.string()}),
                  kBadInput, named);
    EXPECT_FALSE(fs::exists(json)) << named;
    EXPECT_FALSE(fs::exists(table)) << named;
  }
  fs::path folder_ = FreshFolder("bad_files");
};

// 1.6 GB in a file of 1.6 MB, and a log of 200,000 columns.
TEST_F(BadFiles, MadeToFillTheMemory_AreRefusedWithinTwoHundredMegabytes) {
  files::WriteWholeFile(folder_ / "part.gz", std::string(std::size_t{64} << 20, '0'));
  const std::string part = ReadText(folder_ / "part.gz");
  std::string bomb, columns = "t";
  for (int k = 0; k < 24; ++k) bomb += part;  // gzip data may follow gzip data
  for (int k = 0; k < 200000; ++k) columns += ",c" + std::to_string(k);
  for (const auto& [log, named] : {std::pair{Write("bomb.csv.gz", bomb), "more than 60 times its size"},
                                   std::pair{Write("columns.csv", columns + "\n"), "more than 4096 columns"}}) {
    const Outcome o = Tool({"identify", "--robot", "er20_like", "--train", log.string()});
    ExpectOneLine(o, kBadInput, named);
    EXPECT_LT(o.peak_kB, 200000) << named;
    std::printf("%s: %ld kB\n", named, o.peak_kB);
  }
}

TEST_F(BadFiles, RobotFiles_AreRefused) {
  const fs::path log = Write("good.csv", LogText(400));
  ExpectRefused("no_such_robot", log, "no_such_robot");
  ExpectRefused((folder_ / "absent.toml").string(), log, "absent.toml");
  ExpectRefused(Write("broken.toml", "name = \n").string(), log, "broken.toml");
  ExpectRefused(Write("empty.toml", "").string(), log, "empty.toml");
  std::string text = ReadText("codegen/robots/er20_like.toml");
  text.replace(text.find("mass_kg = 32.0"), 14, "mass_kg = true");
  ExpectRefused(Write("typed.toml", text).string(), log, "mass_kg");
}

TEST_F(BadFiles, Logs_AreRefusedNamingTheFile) {
  const auto bad = [&](const std::string& name, int rows, const std::function<void(Cells&)>& change) {
    ExpectRefused("er20_like", Write(name, LogText(rows, change)), name);
  };
  ExpectRefused("er20_like", folder_ / "absent.csv", "absent.csv");
  bad("column.csv", 400, [](Cells& c) { c[0][7] = "torque1"; });
  bad("nan.csv", 400, [](Cells& c) {
    for (int k = 100; k < 200; ++k) c[k][3] = "nan";
  });
  bad("word.csv", 400, [](Cells& c) { c[200][3] = "fast"; });
  bad("time.csv", 400, [](Cells& c) {
    for (int k = 100; k < 200; k += 10) std::swap(c[k][0], c[k + 1][0]);
  });
  bad("same_time.csv", 400, [](Cells& c) {
    for (int k = 100; k < 200; k += 10) c[k][0] = c[k + 1][0];
  });
  bad("milliseconds.csv", 400, [](Cells& c) {
    for (std::size_t k = 1; k < c.size(); ++k) c[k][0] = std::to_string(8 * k);
  });
  bad("short.csv", 50, {});
  bad("ragged.csv", 400, [](Cells& c) { c[200].pop_back(); });
  bad("twice.csv", 400, [](Cells& c) { c[0][2] = "q1"; });
  bad("joints.csv", 400, [](Cells& c) {
    for (auto& row : c) row.erase(row.begin() + 12), row.erase(row.begin() + 6);
  });
}

TEST_F(BadFiles, DiagnoseAndEstimate_RefuseLikeIdentify) {
  const fs::path good = Write("good.csv", LogText(400)), bad = Write("bad.csv", LogText(50));
  const fs::path json = folder_ / "out.json", page = folder_ / "out.html", model = folder_ / "new.toml";
  ExpectOneLine(Tool({"diagnose", "--robot", "er20_like", "--train", bad.string(), "--test", good.string(), "--json",
                      json.string(), "--report", page.string(), "--model-out", model.string()}),
                kBadInput, "bad.csv");
  ExpectOneLine(Tool({"estimate", "--robot", "er20_like", "--log", bad.string(), "--json", json.string()}), kBadInput,
                "bad.csv");
  for (const fs::path& p : {json, page, model}) EXPECT_FALSE(fs::exists(p)) << p;
}

TEST_F(BadFiles, ACutoffThatIsNone_IsRefused) {
  const std::string good = Write("good.csv", LogText(400)).string();  // 125 Hz, 3.2 s
  const std::string held_out = Write("held_out.csv", LogText(420)).string();
  const auto expect = [&](const std::string& cutoff, const std::string& named) {
    ExpectOneLine(Tool({"diagnose", "--robot", "er20_like", "--train", good, "--test", held_out, "--cutoff", cutoff}),
                  kBadInput, named);
    ExpectOneLine(Tool({"identify", "--robot", "er20_like", "--train", good, "--cutoff", cutoff}), kBadInput, named);
  };
  for (const std::string cutoff : {"0", "-20", "nan", "inf", "20Hz", "high"})
    expect(cutoff, "--cutoff " + cutoff + ":");
  expect("63", "half the sample rate, 62.5 Hz");
  expect("1", "good.csv: cut-off 1 Hz, expected above");
}

TEST_F(BadFiles, Scenarios_AreRefused) {
  ExpectOneLine(Tool({"simulate", "--scenario", "no_such_scenario", "--port", "0"}), kBadInput, "no_such_scenario");
  const fs::path bad = Write("bad.toml",
                             "title = \"x\"\nrobot = \"er20_like\"\ntruth_seed = 1\nnoise_seed = 1\n"
                             "[[effect]]\nkind = \"witchcraft\"\njoint = 1\n");
  ExpectOneLine(Tool({"simulate", "--scenario", bad.string(), "--port", "0", "--storage", (folder_ / "n").string()}),
                kBadInput, "effect[1].kind");
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
  Outcome Verb(const std::string& verb, const std::string& table, const std::string& robot = "er20_like") const {
    fs::remove(folder_ / "out.json");
    return Tool({verb, "--connect", drive_.address(), "--robot", robot, "--table", table, "--json",
                 (folder_ / "out.json").string()});
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
  ExpectFlashRefused(good_, kRefused, "schema", "two_link");  // the tool's model is not the drive's
  const codegen::Model two(codegen::ReadRobot("codegen/robots/two_link.toml"),
                           codegen::ReadCatalogue("codegen/effects"));
  ExpectFlashRefused(File("two.toml", calibration::DefaultTable(two)), kBadInput, "two.toml");
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

TEST(Link, ADriveThatDoesNotAnswer_IsALinkError) {
  const fs::path folder = FreshFolder("link");
  const std::string table = (folder / "table.toml").string();
  const codegen::Model model(codegen::ReadRobot("codegen/robots/er20_like.toml"),
                             codegen::ReadCatalogue("codegen/effects"));
  calibration::WriteTable(table, calibration::DefaultTable(model));
  const TakenPort closed(false), silent(true);  // refuses connections; takes them and never says a word
  for (const std::string& address : {closed.address(), silent.address()}) {
    ExpectOneLine(Tool({"flash", "--connect", address, "--robot", "er20_like", "--table", table}), kLink, address);
    if (address == closed.address())
      ExpectOneLine(Tool({"estimate", "--connect", address, "--robot", "er20_like"}), kLink, address);
  }
  ExpectOneLine(Tool({"flash", "--connect", "127.0.0.1", "--robot", "er20_like", "--table", table}), kBadInput,
                "HOST:PORT");
}

TEST(Link, APortInUse_IsBadInput) {
  const fs::path folder = FreshFolder("port");
  const TakenPort taken(true);
  ExpectOneLine(Tool({"simulate", "--scenario", "none", "--port", std::to_string(taken.port()), "--storage",
                      (folder / "drive.nor").string()}),
                kBadInput, std::to_string(taken.port()));
}

}  // namespace
}  // namespace armcal::tests
