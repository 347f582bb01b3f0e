// end-to-end tests - a recording that ends early: by Ctrl-C, by a broken link, and before it begins.
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

#include "armcal/core/words.hpp"
#include "codegen/src/generator/emit.hpp"
#include "codegen/src/generator/load.hpp"
#include "host_sim/client/table_backup.hpp"
#include "host_sim/client/trace_reader.hpp"
#include "host_sim/client/vendor_registers.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/client/cutting_proxy.hpp"

namespace armcal::tests {
namespace {

constexpr int kLogTicks = 3000;  // of a motion: more than the 200 samples of a log

// A slow motion of all joints about zero.
std::string WriteMotion(const std::string& path, int points) {
  std::ofstream out(path);
  out << "t,q1,q2,q3,q4,q5,q6\n";
  for (int k = 0; k < points; ++k) {
    out << 0.008 * k;
    for (int j = 0; j < 6; ++j) out << ',' << 0.1 * std::sin(0.008 * k);
    out << '\n';
  }
  return path;
}

class EarlyEnd : public testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  pid_t StartRecord(int port, const std::string& out, int points) {
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC),
              err = open(Path("err").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
    const pid_t child =
        Start({ARMCAL_TOOL, "record", "--connect", "127.0.0.1:" + std::to_string(port), "--robot", "er20_like",
               "--trajectory", WriteMotion(Path("motion.csv"), points), "--out", Path(out), "--json", Path("log.json")},
              nowhere, err);
    close(nowhere), close(err);
    return child;
  }
  Outcome End(pid_t child) {
    Outcome o;
    o.code = WaitFor(child);
    o.err = ReadText(Path("err"));
    return o;
  }

  std::vector<std::uint16_t> Player() { return client_.ReadInput(client::kPlayerStatus, client::kPlayerStatusCount); }
  // Waits until the drive has played what makes a log.
  void UntilPlayed() {
    const auto playing = static_cast<std::uint16_t>(client::PlayerState::kPlaying);
    for (int k = 0; k < 1000000; ++k)
      if (const auto w = Player();
          w[0] == playing && static_cast<std::int32_t>(core::GetU32(&w[6]) - core::GetU32(&w[4])) > kLogTicks)
        return;
    FAIL() << "the drive does not play";
  }
  bool Enabled() { return client_.ReadStatus().enabled_axes != 0; }
  void UntilEnabled(bool enabled) {
    for (int k = 0; k < 1000000 && Enabled() != enabled; ++k) std::this_thread::yield();
    ASSERT_EQ(Enabled(), enabled);
  }

  fs::path folder_ =
      FreshFolder(std::string("early_end_") + testing::UnitTest::GetInstance()->current_test_info()->name());
  RunningDrive drive_{folder_, "none", {"--real-time"}};
  client::DriveClient client_{"127.0.0.1", drive_.port()};
};

TEST_F(EarlyEnd, CtrlCWhileTheDrivePlays_StopsTheArm_AndKeepsThePart) {
  const pid_t child = StartRecord(drive_.port(), "run", 8000);
  UntilPlayed();
  kill(child, SIGINT);
  ExpectOneLine(End(child), 128 + SIGINT, "interrupted");
  EXPECT_FALSE(Enabled());
  EXPECT_EQ(Player()[0], static_cast<std::uint16_t>(client::PlayerState::kDisabled));
  EXPECT_FALSE(fs::exists(Path("run"))) << "a part has another name";
  EXPECT_TRUE(ReadText(Path("run.partial")).starts_with("t,"));
  const auto json = ReadJson(Path("log.json"));
  EXPECT_TRUE(json.at("partial"));
  EXPECT_EQ(json.at("error"), "interrupted");
  EXPECT_EQ(json.at("exit_code"), 128 + SIGINT);
  EXPECT_EQ(json.at("log"), Path("run.partial"));
  EXPECT_GE(json.at("samples"), 200);
}

TEST_F(EarlyEnd, CtrlCWhileTheTrajectoryIsLoaded_DisablesTheArm_AndKeepsNothing) {
  client_.WriteSingle(client::kPlayerCommand, static_cast<std::uint16_t>(client::PlayerCommand::kEnable));
  UntilEnabled(true);
  const pid_t child = StartRecord(drive_.port(), "run.csv", 20000);
  for (int k = 0; k < 1000000 && core::GetU32(&Player()[2]) == 0; ++k) std::this_thread::yield();
  kill(child, SIGINT);
  ExpectOneLine(End(child), 128 + SIGINT, "interrupted");
  EXPECT_FALSE(Enabled());
  EXPECT_FALSE(fs::exists(Path("run.csv")));
  EXPECT_FALSE(fs::exists(Path("run.partial.csv")));
}

TEST_F(EarlyEnd, ALinkThatBreaks_SaysThatTheArmMayStillMove) {
  auto proxy = std::make_unique<test::CuttingProxy>(drive_.port());
  const pid_t child = StartRecord(proxy->port(), "run.csv", 8000);
  UntilPlayed();
  proxy.reset();
  const Outcome o = End(child);
  ExpectOneLine(o, 6, "the arm may still be moving and enabled");
  EXPECT_TRUE(Enabled()) << "what the message says";
  EXPECT_TRUE(fs::exists(Path("run.partial.csv")));
}

// The trace is taken before the arm is enabled.
TEST_F(EarlyEnd, ATraceThatAnotherClientTakes_LeavesTheArmDisabled) {
  client::TraceRequest request;
  request.channels = 1;
  client::StartTrace(client_, 0, request);
  const Outcome o = End(StartRecord(drive_.port(), "run.csv", 1000));
  ExpectOneLine(o, 4, "SeatTaken");
  EXPECT_FALSE(Enabled());
}

// The signals that a process catches, as the kernel shows them.
bool CatchesCtrlC(pid_t process) {
  std::istringstream status(ReadText("/proc/" + std::to_string(process) + "/status"));
  for (std::string word; status >> word;)
    if (word == "SigCgt:" && status >> word) return (std::stoull(word, nullptr, 16) >> (SIGINT - 1) & 1) != 0;
  return false;
}

// The drive takes the connection and says nothing, so the first Ctrl-C has to wait.
TEST(Record, ASecondCtrlC_EndsItAtOnce) {
  const TakenPort silent(true);
  const fs::path folder = FreshFolder("second_ctrl_c");
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  const pid_t child = Start({ARMCAL_TOOL, "record", "--connect", silent.address(), "--robot", "er20_like", "--seconds",
                             "5", "--out", (folder / "log.csv").string()},
                            nowhere, nowhere);
  close(nowhere);
  const auto until = [&](bool catches) {
    for (int k = 0; k < 100000 && CatchesCtrlC(child) != catches; ++k) std::this_thread::yield();
    EXPECT_EQ(CatchesCtrlC(child), catches);
  };
  until(true);
  kill(child, SIGINT);
  until(false);
  kill(child, SIGINT);
  EXPECT_EQ(WaitFor(child), 128 + SIGINT);
}

// er20_like with one line changed.
std::string OtherRobot(const fs::path& folder, const std::string& from, const std::string& to) {
  std::string text = ReadText("codegen/robots/er20_like.toml");
  const auto at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  std::ofstream(folder / "other.toml") << text.replace(at, from.size(), to);
  return (folder / "other.toml").string();
}

TEST(Record, WithTheFileOfAnotherArm_IsRefused_AndAnotherSchemaIsNamed) {
  const fs::path folder = FreshFolder("other_robot");
  const RunningDrive drive(folder, "none", {"--real-time"});
  const std::string log = (folder / "log.csv").string(), told = (folder / "log.json").string();
  const auto record = [&](const std::string& robot) {
    return Tool(
        {"record", "--connect", drive.address(), "--robot", robot, "--seconds", "2", "--out", log, "--json", told});
  };
  ExpectOneLine(record("two_link"), 2, "6 axes, robot two_link has 2");
  ExpectOneLine(record(OtherRobot(folder, "tick_rate_Hz = 1000", "tick_rate_Hz = 500")), 2,
                "1000 ticks a second, robot er20_like has 500");
  ExpectOneLine(record(OtherRobot(folder, "sample_ticks = 8", "sample_ticks = 4")), 2,
                "8 ticks a sample, robot er20_like has 4");
  EXPECT_FALSE(fs::exists(log));
  const std::string own = client::CrcText(codegen::Schema(codegen::LoadModel("er20_like"))),
                    renamed = OtherRobot(folder, "name = \"er20_like\"", "name = \"renamed\""),
                    other = client::CrcText(codegen::Schema(codegen::LoadModel(renamed)));
  ASSERT_NE(own, other);
  ExpectOneLine(record(renamed), 0, "the drive runs schema " + own + ", robot renamed has " + other);
  EXPECT_EQ(ReadJson(told).at("schema"), own);
  EXPECT_EQ(ReadJson(told).at("robot_schema"), other);
  const Outcome o = record("er20_like");
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(o.err, "");
  EXPECT_EQ(ReadJson(told).at("robot_schema"), own);
}

// Two motions, one after the other, of a drive in virtual time.
std::string TwoLogs(const std::string& name) {
  const fs::path folder = FreshFolder(name);
  const std::string motion = WriteMotion((folder / "motion.csv").string(), 300);
  const RunningDrive drive(folder);
  std::string logs;
  for (const char* log : {"first.csv", "second.csv"}) {
    const Outcome o = Tool({"record", "--connect", drive.address(), "--robot", "er20_like", "--trajectory", motion,
                            "--out", (folder / log).string()});
    EXPECT_EQ(o.code, 0) << o.err;
    logs += ReadText(folder / log);
  }
  return logs;
}

TEST(Record, OfTheSameCommandsInVirtualTime_IsTheSameLog_HoweverLongTheyTake) {
  const std::string at_once = TwoLogs("same_at_once");
  std::atomic<bool> ended{false};
  std::vector<std::thread> others;
  for (unsigned k = 0; k < 2 * std::max(1U, std::thread::hardware_concurrency()); ++k)
    others.emplace_back([&] {
      while (!ended) {
      }
    });
  const std::string later = TwoLogs("same_later");
  ended = true;
  for (std::thread& other : others) other.join();
  EXPECT_GT(at_once.size(), 50000U);
  EXPECT_TRUE(at_once == later);
}

}  // namespace
}  // namespace armcal::tests
