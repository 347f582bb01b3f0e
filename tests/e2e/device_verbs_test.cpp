// end-to-end tests - the verbs for a technician at a drive, and a port that may only be read.
#include <fmt/core.h>
#include <fstream>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "codegen/src/generator/load.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

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
  ExpectOneLine(flash(1.01, {"--trial"}), 4, "WrongOrder");
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
  ExpectOneLine(flash(1.03), 4, "WrongOrder");
  ASSERT_EQ(Ask({"trial", "--end"}).code, 0);
  EXPECT_EQ(Json()["on_trial"], false);
  EXPECT_EQ(scale(), 1.01f);
  ExpectOneLine(Ask({"trial", "--confirm"}), 4, "WrongOrder");
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
  const Outcome csv = Tool({"map", "--csv"});
  EXPECT_NE(csv.out.find("holding,337,1,u16,rw,learning_reset,,1 to 17"), std::string::npos);
  EXPECT_NE(Tool({"map", "--md"}).out.find("### Holding registers"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(Tool({"map", "--json"}).out)["map_minor"], 6);
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
