// end-to-end tests - drive and estimators of a robot that armcal was not built with: each is compiled once, whatever
// goes wrong.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <csignal>
#include <fstream>

#include "tests/e2e/own_drive.hpp"

namespace armcal::tests {
namespace {

class CompiledDrive : public OwnDrive {
 protected:
  // A compiler of the test: a script.
  void CompileWith(const std::string& body) {
    std::ofstream(Path("compiler")) << "#!/bin/sh\n" << body;
    chmod(Path("compiler").c_str(), 0755);
    setenv("CXX", Path("compiler").c_str(), 1);
  }
  std::vector<std::string> Kept(const std::string& ending = "") const {
    std::vector<std::string> names;
    if (fs::is_directory(Path("cache/armcal")))
      for (const auto& e : fs::directory_iterator(Path("cache/armcal")))
        if (const std::string name = e.path().filename(); name.ends_with(ending)) names.push_back(name);
    return names;
  }
  Outcome Simulate() { return Tool({"simulate", "--robot", Robot(), "--port", "0", "--storage", Path("drive.nor")}); }
  std::vector<std::string> Words(const std::string& storage) const {
    return {ARMCAL_TOOL, "simulate", "--robot", Robot(), "--port", "0", "--storage", Path(storage)};
  }
  // The firmware's estimators on this PC: on the log, and on the drive's trace, where they end with the drive's bits.
  void ExpectTheDrivesEstimates(const RunningDrive& drive) {
    const std::vector<std::string> words{
        "estimate", "--robot", Robot(), "--log", Path("motion_log.csv.gz"), "--json", Path("estimate.json")};
    ExpectOneLine(Tool(words), 2, "no-such-compiler: not found");
    unsetenv("CXX");
    const Outcome estimated = Tool(words);
    ASSERT_EQ(estimated.code, 0) << estimated.err;
    EXPECT_NE(estimated.err.find("compiling the estimators of robot own, once"), std::string::npos) << estimated.err;
    EXPECT_GT(ReadJson(Path("estimate.json")).at("samples").get<int>(), 1000);
    setenv("CXX", "no-such-compiler", 1);
    const Outcome flashed =
        Tool({"flash", "--connect", drive.address(), "--robot", Robot(), "--table", Path("fit.toml")});
    ASSERT_EQ(flashed.code, 0) << flashed.err;
    const int out = open(Path("live.out").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
    const pid_t live =
        Start({ARMCAL_TOOL, "estimate", "--connect", drive.address(), "--robot", Robot(), "--json", Path("live.json")},
              out, out);
    close(out);
    int status = 0;
    while (ReadText(Path("live.out")).find("listening") == std::string::npos) {
      ASSERT_EQ(waitpid(live, &status, WNOHANG), 0) << ReadText(Path("live.out"));
      usleep(10000);
    }
    ASSERT_NO_FATAL_FAILURE(Recorded(drive, "motion"));
    ASSERT_EQ(WaitFor(live), 0) << ReadText(Path("live.out"));
    const nlohmann::json result = ReadJson(Path("live.json"));
    EXPECT_TRUE(result.at("same_bits").get<bool>());
    EXPECT_TRUE(result.at("same_bits_kalman").get<bool>());
    EXPECT_GT(result.at("rows_used").get<int>(), 1000);
  }
};

TEST_F(CompiledDrive, OfAScara_IsCompiledOnceAndItsEstimatesAreTheDrives) {
  ASSERT_NO_FATAL_FAILURE(Imported(Scara()));

  setenv("CXX", "no-such-compiler", 1);
  ExpectOneLine(Simulate(), 2, "no-such-compiler: not found");
  // An arm without bodies is refused before anybody looks for a compiler.
  ExpectOneLine(Tool({"simulate", "--robot", "kuka_kr300", "--port", "0", "--storage", Path("drive.nor")}), 2,
                "joint[1].link");
  EXPECT_TRUE(Kept(".part").empty());

  CompileWith("echo no memory left\nfor word; do case $word in *.so) echo half >\"$word\";; esac; done\nexit 1\n");
  const Outcome failed = Simulate();
  EXPECT_EQ(failed.code, 2);
  EXPECT_EQ(std::count(failed.err.begin(), failed.err.end(), '\n'), 2) << failed.err;  // "compiling ...", and the fault
  const auto at = failed.err.rfind("see ");
  ASSERT_NE(at, std::string::npos) << failed.err;
  EXPECT_EQ(ReadText(failed.err.substr(at + 4, failed.err.size() - at - 5)), "no memory left\n");
  for (const std::string& name : Kept()) EXPECT_TRUE(name.ends_with(".txt") || name.ends_with(".lock")) << name;

  // A start that is killed while it compiles.
  CompileWith("echo $$ >" + Path("begun.part") + "\nmv " + Path("begun.part") + " " + Path("begun") +
              "\nexec sleep 100\n");
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  const pid_t killed = Start(Words("killed.nor"), nowhere, nowhere);
  while (!fs::exists(Path("begun"))) usleep(1000);
  kill(killed, SIGKILL);
  WaitFor(killed);
  kill(std::stoi(ReadText(Path("begun"))), SIGKILL);
  EXPECT_EQ(Kept(".part").size(), 1u);

  // Two starts at once: one compiles, both serve. Afterwards nobody needs a compiler.
  unsetenv("CXX");
  std::vector<pid_t> starts;
  for (const char* name : {"first", "second"}) {
    const int out = open(Path(name + std::string(".out")).c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644),
              err = open(Path(name + std::string(".err")).c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
    starts.push_back(Start(Words(name + std::string(".nor")), out, err));
    close(out), close(err);
  }
  int served = 0, compiled = 0, status = 0;
  while (served < 2 && waitpid(-1, &status, WNOHANG) == 0) {
    usleep(10000);
    served = 0;
    for (const char* name : {"first.out", "second.out"})
      served += ReadText(Path(name)).find("listening") != std::string::npos;
  }
  for (const pid_t start : starts) kill(start, SIGTERM), WaitFor(start);
  for (const char* name : {"first.err", "second.err"})
    compiled += ReadText(Path(name)).find("compiling the simulated drive of robot own, once") != std::string::npos;
  EXPECT_EQ(served, 2) << ReadText(Path("first.err")) << ReadText(Path("second.err"));
  EXPECT_EQ(compiled, 1);
  EXPECT_TRUE(Kept(".part").empty());

  setenv("CXX", "no-such-compiler", 1);
  const RunningDrive drive(folder_, Scenario("nothing.toml", 5), {"--robot", Robot()});
  const Outcome excited = Tool({"excite", "--robot", Robot(), "--no-slow", "--starts", "2", "--search-seconds", "20",
                                "--out", Path("motion.csv")});
  ASSERT_EQ(excited.code, 0) << excited.err;
  ASSERT_NO_FATAL_FAILURE(Recorded(drive, "motion"));
  const Outcome fit = Tool({"identify", "--robot", Robot(), "--train", Path("motion_log.csv.gz"), "--json",
                            Path("fit.json"), "--table-out", Path("fit.toml")});
  ASSERT_EQ(fit.code, 0) << fit.err;

  ExpectTheDrivesEstimates(drive);
}

}  // namespace
}  // namespace armcal::tests
