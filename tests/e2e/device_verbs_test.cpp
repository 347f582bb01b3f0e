// end-to-end tests - the verbs for a technician at a drive, and a port that may only be read.
#include <fcntl.h>
#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "codegen/src/generator/load.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/client/loopback_proxy.hpp"

namespace armcal::tests {
namespace {

// Carries what comes. `look` sees it first, and may change it. False: the connection ends.
using Look = std::function<bool(std::span<char> bytes, bool replies)>;
test::LoopbackProxy::Move Seen(Look look) {
  return [look = std::move(look)](int from, int to, bool replies) {
    char bytes[512];
    const ssize_t count = ::recv(from, bytes, sizeof bytes, 0);
    return count > 0 && look({bytes, static_cast<std::size_t>(count)}, replies) &&
           ::send(to, bytes, static_cast<std::size_t>(count), MSG_NOSIGNAL) == count;
  };
}
// A request that holds the command "save".
bool IsSave(std::span<const char> bytes, bool replies) {
  return !replies && std::string_view(bytes.data(), bytes.size()).find("evas") != std::string_view::npos;
}

class DeviceVerbs : public testing::Test {
 protected:
  Outcome Ask(std::vector<std::string> words, const std::string& address = "") {
    words.insert(words.end(), {"--connect", address.empty() ? drive_.address() : address, "--json",
                               (folder_ / "out.json").string()});
    return Tool(words);
  }
  nlohmann::json Json() const { return ReadJson(folder_ / "out.json"); }

  fs::path folder_ = FreshFolder("device_verbs");
  RunningDrive drive_{folder_};
};

TEST_F(DeviceVerbs, Info_SaysWhatTheDriveIsAndWhoMayWrite) {
  const Outcome o = Ask({"info"});
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_NE(o.out.find("Without a key anyone who reaches the line may write within the ceilings."), std::string::npos);
  EXPECT_EQ(Json()["axes"], 6);
  EXPECT_EQ(Json()["map"], "1.6");
  EXPECT_EQ(Json()["library"].get<std::string>() + "\n", Tool({"--version"}).out);
  EXPECT_EQ(Json()["writer"], "free");
}

TEST_F(DeviceVerbs, GetAndSet_GoByNameAndKeepTheRange) {
  ASSERT_EQ(Ask({"set", "scratch[3]", "0x1F"}).code, 0);
  EXPECT_EQ(Json()["reads"], 31);
  ASSERT_EQ(Ask({"get", "scratch[3]"}).code, 0);
  EXPECT_EQ(Json()["value"], 31);
  ASSERT_EQ(Ask({"get", "residual_rms"}).code, 0);
  EXPECT_EQ(Json()["value"].size(), 6u);
  ASSERT_EQ(Ask({"set", "learning_hold", "1"}).code, 0) << "it takes the writer's seat itself, and leaves it";
  EXPECT_EQ(Json()["reads"], 1);
  ExpectOneLine(Ask({"set", "learning_hold", "2"}), 2, "expected 0 to 1");
  ExpectOneLine(Ask({"set", "generation", "2"}), 2, "can only be read");
  ExpectOneLine(Ask({"get", "no_such"}), 2, "armcal map");
  EXPECT_EQ(Json()["exit_code"], 2);
  ExpectOneLine(Ask({"set", "residual_select", "9"}), 4, "OutOfRange");
  EXPECT_EQ(Json()["exit_code"], 4);
}

TEST_F(DeviceVerbs, ABackup_ComesBackWordForWord_AndADamagedOneIsRefused) {
  const std::string file = (folder_ / "backup.json").string();
  ExpectOneLine(Ask({"backup", file}), 4, "no valid table");
  const auto write = [&](const std::vector<std::uint16_t>& words, std::uint32_t crc) {
    std::ofstream(file) << nlohmann::json{
        {"armcal_backup", 1}, {"table_crc", fmt::format("{:08X}", crc)}, {"words", words}};
  };
  auto words = calibration::EncodeTable(calibration::DefaultTable(codegen::LoadModel("er20_like")));
  const std::uint32_t crc = core::Crc32Words(words.data(), words.size());
  write(words, crc + 1);
  ExpectOneLine(Ask({"restore", file}), 2, "table_crc");
  write(words, crc);
  ASSERT_EQ(Ask({"restore", file}).code, 0);
  EXPECT_EQ(Ask({"diff", file}).code, 0);
  fs::remove(file);
  ASSERT_EQ(Ask({"backup", file}).code, 0);
  EXPECT_EQ(ReadJson(file)["words"].get<std::vector<std::uint16_t>>(), words);
  words[17] ^= 1;
  write(words, core::Crc32Words(words.data(), words.size()));
  EXPECT_EQ(Ask({"diff", file}).code, 5);
  EXPECT_EQ(Json()["differ"][0]["word"], 17);
  const Outcome named = Ask({"diff", file, "--robot", "er20_like"});
  EXPECT_EQ(named.code, 5);
  EXPECT_EQ(named.out.rfind("joint 1 sigma_Nm: drive ", 0), 0u) << named.out;
  ASSERT_EQ(Json()["values"].size(), 1u);
  EXPECT_EQ(Json()["values"][0]["name"], "joint 1 sigma_Nm");
  ExpectOneLine(Ask({"diff", file, "--robot", "puma560"}), 4, "schema");
  words[1] ^= 1;
  write(words, core::Crc32Words(words.data(), words.size()));
  ExpectOneLine(Ask({"diff", file, "--robot", "er20_like"}), 2, "of robot er20_like");
}

TEST_F(DeviceVerbs, ABackupOfAnotherDrive_IsRestoredOnlyIfThatIsSaid) {
  const std::string file = (folder_ / "backup.json").string(), table = (folder_ / "table.toml").string();
  calibration::WriteTable(table, calibration::DefaultTable(codegen::LoadModel("er20_like")));
  ASSERT_EQ(Ask({"flash", "--robot", "er20_like", "--table", table}).code, 0);
  ASSERT_EQ(Ask({"backup", file}).code, 0);
  nlohmann::json backup = ReadJson(file);
  const auto serial_number = backup["serial_number"].get<std::uint32_t>();
  ASSERT_EQ(Ask({"diff", file}).code, 0);
  EXPECT_EQ(Json()["another_drive"], false);
  backup["serial_number"] = serial_number + 1;
  std::ofstream(file) << backup;
  const Outcome o = Ask({"restore", file});
  ExpectOneLine(o, 2, "serial number " + std::to_string(serial_number + 1));
  EXPECT_NE(o.err.find("has " + std::to_string(serial_number) + "; --another-drive"), std::string::npos) << o.err;
  const Outcome diff = Ask({"diff", file});
  EXPECT_EQ(diff.code, 0);
  EXPECT_NE(diff.out.find("is of the drive with serial number"), std::string::npos) << diff.out;
  EXPECT_EQ(Json()["another_drive"], true);
  EXPECT_EQ(Ask({"restore", file, "--another-drive"}).code, 0);
  backup["schema"] = "00000000";
  std::ofstream(file) << backup;
  ExpectOneLine(Ask({"restore", file, "--another-drive"}), 2, "\"schema\"");
}

TEST_F(DeviceVerbs, WithoutALink_WriteTheErrorIntoTheirJson) {
  const TakenPort closed(false);
  for (const char* verb : {"learning", "health", "info", "watch", "trial", "log"}) {
    std::ofstream(folder_ / "out.json") << "{}";  // of an earlier run
    ExpectOneLine(Ask({verb}, closed.address()), 3, "cannot connect");
    EXPECT_EQ(Json()["exit_code"], 3) << verb;
    EXPECT_NE(Json()["error"].get<std::string>().find("cannot connect"), std::string::npos) << verb;
  }
}

// The save goes through, and nothing after it.
TEST_F(DeviceVerbs, ALinkThatIsLostAfterTheSave_IsToldAsSent) {
  const std::string table = (folder_ / "table.toml").string();
  calibration::WriteTable(table, calibration::DefaultTable(codegen::LoadModel("er20_like")));
  std::atomic<bool> saved{false};
  test::LoopbackProxy proxy(drive_.port(), Seen([&](std::span<char> bytes, bool replies) {
                              if (saved) return false;
                              saved = IsSave(bytes, replies);
                              return true;
                            }));
  ExpectOneLine(Ask({"flash", "--robot", "er20_like", "--table", table}, "127.0.0.1:" + std::to_string(proxy.port())),
                3, "the table was sent, and it is unknown whether it is in force: armcal verify or armcal info tells");
  EXPECT_EQ(Json()["sent"], true);
  EXPECT_EQ(Json()["readback_ok"], false);
}

// The database is spoilt while the table is stored.
TEST_F(DeviceVerbs, ADatabaseThatFailsAfterTheFlash_LeavesTheTruthInTheJson) {
  const std::string table = (folder_ / "table.toml").string(), database = (folder_ / "fleet.sqlite").string();
  calibration::WriteTable(table, calibration::DefaultTable(codegen::LoadModel("er20_like")));
  test::LoopbackProxy proxy(drive_.port(), Seen([&](std::span<char> bytes, bool replies) {
                              if (IsSave(bytes, replies)) std::ofstream(database) << std::string(1000, 'x');
                              return true;
                            }));
  const auto fails = [&](std::vector<std::string> words) {
    fs::remove(database);
    words.insert(words.end(), {"--db", database, "--arm", "left"});
    ExpectOneLine(Ask(words, "127.0.0.1:" + std::to_string(proxy.port())), 2, "is not a database");
    EXPECT_EQ(Json()["readback_ok"], true) << words[0];
    EXPECT_EQ(Json()["exit_code"], 2) << words[0];
    EXPECT_TRUE(Json().contains("error") && Json().contains("table_crc")) << words[0];
  };
  fails({"flash", "--robot", "er20_like", "--table", table});
  fails({"flash", "--robot", "er20_like", "--table", table});
  fails({"rollback"});
  const std::string backup = (folder_ / "backup.json").string();
  ASSERT_EQ(Ask({"backup", backup}).code, 0);
  fails({"restore", backup});
}

// A device that answers Modbus and is no armcal drive: the magic number of the identity is another one.
// A gateway of several drives tells them apart by the unit in each request.
TEST_F(DeviceVerbs, ADriveBehindAGateway_IsAskedByItsUnit) {
  std::atomic<int> unit = -1;
  const test::LoopbackProxy gateway(drive_.port(), Seen([&](std::span<char> bytes, bool replies) {
                                      constexpr std::size_t kUnitByte = 6;
                                      if (!replies && bytes.size() > kUnitByte) unit = bytes[kUnitByte];
                                      return true;
                                    }));
  const std::string address = fmt::format("127.0.0.1:{}", gateway.port());
  EXPECT_EQ(Ask({"info"}, address + ":17").code, 0);
  EXPECT_EQ(unit, 17);
  EXPECT_EQ(Ask({"info"}, address).code, 0);
  EXPECT_EQ(unit, 1);
  ExpectOneLine(Ask({"info"}, address + ":248"), 2, "unit from 1 to 247");
  const TakenPort silent(false);
  ExpectOneLine(Ask({"info"}, silent.address() + ":17"), 3, fmt::format("127.0.0.1:{}, unit 17: ", silent.port()));
}

TEST_F(DeviceVerbs, OnAnotherDevice_NothingIsReadOrWritten) {
  ASSERT_EQ(Ask({"set", "scratch[3]", "5"}).code, 0);
  test::LoopbackProxy other(drive_.port(), Seen([](std::span<char> bytes, bool replies) {
                              if (replies && bytes.size() == 61 && bytes[7] == 4 && bytes[8] == 52) bytes[9] = 0;
                              return true;
                            }));
  const std::string address = "127.0.0.1:" + std::to_string(other.port());
  ExpectOneLine(Ask({"get", "scratch[3]"}, address), 3, "not an armcal drive");
  ExpectOneLine(Ask({"set", "scratch[3]", "6"}, address), 3, "not an armcal drive");
  ASSERT_EQ(Ask({"get", "scratch[3]"}).code, 0);
  EXPECT_EQ(Json()["value"], 5);
}

// A table file with one number changed, so that two of them differ.
TEST_F(DeviceVerbs, ATrial_IsStoredOnlyByConfirm_AndRollbackBringsTheOlderTable) {
  const auto file = [&](double scale) {
    auto table = calibration::DefaultTable(codegen::LoadModel("er20_like"));
    table.joint[0].torque_scale = scale;
    const std::string path = (folder_ / fmt::format("table_{}.toml", scale)).string();
    calibration::WriteTable(path, table);
    return path;
  };
  const auto flash = [&](double scale, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"flash", "--robot", "er20_like", "--table", file(scale)};
    words.insert(words.end(), more.begin(), more.end());
    return Ask(words);
  };
  const auto scale = [&] {  // of the table in force
    EXPECT_EQ(Ask({"get", "active_table"}).code, 0);
    const auto words = Json()["value"].get<std::vector<std::uint16_t>>();
    return core::GetF32(&words[16 + 6]);
  };
  ExpectOneLine(flash(1.01, {"--trial"}), 4, "no valid table to which a trial could go back");
  ExpectOneLine(Ask({"rollback"}), 4, "Empty");
  ASSERT_EQ(flash(1.01).code, 0);
  const Outcome tried = flash(1.02, {"--trial", "--limit", "1200"});
  ASSERT_EQ(tried.code, 0) << tried.err;
  EXPECT_EQ(Json()["trial_s"], 1200);
  EXPECT_EQ(Json()["store_sequence"], 1);
  EXPECT_EQ(scale(), 1.02f);
  ASSERT_EQ(Ask({"trial"}).code, 0);
  EXPECT_EQ(Json()["on_trial"], true);
  EXPECT_GT(Json()["left_s"], 1000);
  ExpectOneLine(flash(1.03), 4, "a trial runs; end or confirm it first");
  ExpectOneLine(Ask({"rollback"}), 4, "a trial runs; end or confirm it first");
  ASSERT_EQ(Ask({"trial", "--end"}).code, 0);
  EXPECT_EQ(Json()["on_trial"], false);
  EXPECT_EQ(scale(), 1.01f);
  ExpectOneLine(Ask({"trial", "--confirm"}), 4, "no table is on trial");
  ExpectOneLine(Ask({"trial", "--end"}), 4, "no table is on trial");
  ASSERT_EQ(flash(1.02, {"--trial"}).code, 0);
  ASSERT_EQ(Ask({"trial", "--confirm"}).code, 0);
  EXPECT_EQ(Json()["store_sequence"], 2);
  EXPECT_EQ(scale(), 1.02f);
  ASSERT_EQ(Ask({"rollback"}).code, 0);
  EXPECT_EQ(Json()["store_sequence"], 3);
  EXPECT_EQ(scale(), 1.01f);
  ASSERT_EQ(Ask({"rollback"}).code, 0) << "and forth";
  EXPECT_EQ(scale(), 1.02f);
  const Outcome log = Ask({"log"});
  ASSERT_EQ(log.code, 0);
  EXPECT_NE(log.out.find("trial   Ok"), std::string::npos) << log.out;
  EXPECT_EQ(Json()["log"].size(), 32u);
  EXPECT_EQ(Json()["log"].back()["command"], "save");
  EXPECT_EQ(Json()["log"].back()["connection"], 0);
  EXPECT_EQ(Json()["log"].back()["event"], Json()["events"].get<int>() - 1);
}

TEST_F(DeviceVerbs, WatchScanAndMap_WriteWhatTheyShow) {
  ASSERT_EQ(Ask({"watch", "--count", "1"}).code, 0);
  EXPECT_EQ(Json().size(), 1u);
  EXPECT_EQ(Json()[0]["residual_rms_Nm"].size(), 6u);
  const std::string port = std::to_string(drive_.port());
  ASSERT_EQ(Tool({"scan", "127.0.0.1", "--from", port, "--to", port, "--json", (folder_ / "out.json").string()}).code,
            0);
  EXPECT_EQ(Json()[0]["address"], drive_.address());
  ASSERT_EQ(Tool({"scan", drive_.address(), "--json", (folder_ / "out.json").string()}).code, 0);
  EXPECT_EQ(Json().size(), 1u);
  EXPECT_EQ(Json()[0]["address"], drive_.address());
  // Simulated drives listen on 127.0.0.1. The last of the usual ports is that of armcal simulate.
  ExpectOneLine(Tool({"scan", "127.0.0.2", "--json", (folder_ / "out.json").string()}), 3,
                "no drive answered; the last failure was: 127.0.0.2:1502: cannot connect");
  EXPECT_EQ(Json()["exit_code"], 3);
  EXPECT_TRUE(Json()["found"].empty());
  const Outcome csv = Tool({"map", "--csv"});
  EXPECT_NE(csv.out.find("holding,337,1,u16,rw,learning_reset,,1 to 17"), std::string::npos);
  EXPECT_NE(Tool({"map", "--md"}).out.find("### Holding registers"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(Tool({"map", "--json"}).out)["map_minor"], 6);
}

TEST_F(DeviceVerbs, CtrlC_EndsAScan_WhichKeepsWhatItHasFound) {
  const std::string printed = (folder_ / "scan.txt").string();
  const int out = open(printed.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const pid_t scan = Start({ARMCAL_TOOL, "scan", "127.0.0.1", "--from", std::to_string(drive_.port()), "--to", "65535",
                            "--json", (folder_ / "out.json").string()},
                           out, out);
  close(out);
  for (int k = 0; k < 10000 && ReadText(printed).find(drive_.address()) == std::string::npos; ++k) usleep(1000);
  kill(scan, SIGINT);
  EXPECT_EQ(WaitFor(scan), 6);
  ASSERT_EQ(Json().size(), 1u);
  EXPECT_EQ(Json()[0]["address"], drive_.address());
}

TEST(Watch, KeepsItsReadingsWhenTheLinkDrops) {
  const fs::path folder = FreshFolder("watch"), json = folder / "out.json";
  auto drive = std::make_unique<RunningDrive>(folder);
  std::ofstream(json) << "[]";  // of an earlier run
  int pipe_ends[2];
  ASSERT_EQ(pipe2(pipe_ends, O_CLOEXEC), 0);
  const pid_t watch = Start({ARMCAL_TOOL, "watch", "--connect", drive->address(), "--json", json.string()},
                            pipe_ends[1], STDERR_FILENO);
  close(pipe_ends[1]);
  for (char c = 0; read(pipe_ends[0], &c, 1) == 1 && c != '\n';) continue;
  EXPECT_FALSE(fs::exists(json)) << "a result of an earlier run would be taken for this one's";
  drive.reset();
  EXPECT_EQ(WaitFor(watch), 3);
  close(pipe_ends[0]);
  EXPECT_GE(ReadJson(json).at("readings").size(), 1u);
  EXPECT_EQ(ReadJson(json).at("exit_code"), 3);
}

// Against a drive with a key: without the key nothing is stored, and with it all verbs go on as before.
TEST(DriveWithAKey, TakesWhatIsSignedForIt) {
  const fs::path folder = FreshFolder("drive_with_a_key");
  const auto key_file = [&](const char* name, char digit) {
    const fs::path path = folder / name;
    std::ofstream(path) << std::string(64, digit);
    fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
    return path.string();
  };
  const std::string key = key_file("drive.key", '7'), wrong = key_file("wrong.key", '8');
  const RunningDrive drive(folder, "none", {"--key", key});
  const auto ask = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--connect", drive.address(), "--json", (folder / "out.json").string()});
    return Tool(words);
  };
  const auto told = [&] { return ReadJson(folder / "out.json"); };
  const auto flash = [&](double scale, std::vector<std::string> more) {
    auto table = calibration::DefaultTable(codegen::LoadModel("er20_like"));
    table.joint[0].torque_scale = scale;
    const std::string path = (folder / "table.toml").string();
    calibration::WriteTable(path, table);
    std::vector<std::string> words = {"flash", "--robot", "er20_like", "--table", path};
    words.insert(words.end(), more.begin(), more.end());
    return ask(words);
  };
  ExpectOneLine(flash(1.01, {}), 4, "--key FILE");
  ExpectOneLine(flash(1.01, {"--dry-run"}), 4, "--key FILE");
  EXPECT_EQ(flash(1.01, {"--dry-run", "--key", key}).code, 0);
  ExpectOneLine(flash(1.01, {"--key", wrong}), 4, "BadSignature");
  ASSERT_EQ(flash(1.01, {"--key", key}).code, 0);
  EXPECT_EQ(ask({"verify", "--robot", "er20_like", "--table", (folder / "table.toml").string()}).code, 0);
  const Outcome info = ask({"info"});
  EXPECT_NE(info.out.find("signed with the drive's key"), std::string::npos);
  EXPECT_EQ(told()["signing"], "hmac");
  EXPECT_EQ(told()["signing_counter"], 1);
  const std::string backup = (folder / "backup.json").string();
  ASSERT_EQ(ask({"backup", backup}).code, 0);
  ASSERT_EQ(flash(1.02, {"--trial", "--key", key}).code, 0);
  ASSERT_EQ(ask({"trial", "--confirm"}).code, 0);
  EXPECT_EQ(ask({"diff", backup}).code, 5);
  ExpectOneLine(ask({"restore", backup}), 4, "--key FILE");
  ASSERT_EQ(ask({"restore", backup, "--key", key}).code, 0);
  EXPECT_EQ(ask({"diff", backup}).code, 0);
  ExpectOneLine(ask({"rollback"}), 4, "--key FILE");
  ASSERT_EQ(ask({"rollback", "--key", key}).code, 0);
  EXPECT_EQ(ask({"diff", backup}).code, 5);
  ASSERT_EQ(ask({"info"}).code, 0);
  EXPECT_EQ(told()["signing_counter"], 4);
  ExpectOneLine(ask({"learning", "--reset", "bodies"}), 4, "Forbidden");
  fs::permissions(key, fs::perms::group_read, fs::perm_options::add);
  ExpectOneLine(flash(1.03, {"--key", key}), 2, "chmod 600");
}

TEST(ReadPort, MayBeReadButNotWritten) {
  const RunningDrive drive(FreshFolder("read_port"), "none", {"--read-port", "0"});
  ASSERT_EQ(Tool({"get", "generation", "--connect", drive.read_address()}).code, 0);
  ExpectOneLine(Tool({"set", "scratch[0]", "1", "--connect", drive.read_address()}), 4, "Forbidden");
  EXPECT_EQ(Tool({"set", "scratch[0]", "1", "--connect", drive.address()}).code, 0);
}

}  // namespace
}  // namespace armcal::tests
