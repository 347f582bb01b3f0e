// end-to-end tests - 500 logs under Slurm and under GNU parallel, by the commands of docs/fleet.md. Everything that
// runs a part of the batch is killed in the middle.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "host_sim/data/logs/log.hpp"
#include "tests/e2e/tool.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::tests {
namespace {

constexpr int kLogs = 500;
constexpr std::size_t kVerdictsBeforeTheKill = 200;

// What the model of the arms of a kind lacks: an offset of the second joint's torque.
struct Kind {
  const char* name;
  double offset_Nm;
};
constexpr Kind kKinds[] = {{"plain", 0}, {"raised", 0.8}, {"sound", 0}};

const Kind& KindOf(int k) { return kKinds[static_cast<std::size_t>(k) % std::size(kKinds)]; }
std::string NameOf(int k) { return KindOf(k).name + std::string("_arm_") + std::to_string(k); }

// One pair of logs of each kind. The arms of a kind differ in their names alone.
fs::path KindLogs() {
  static const fs::path folder = [] {
    const fs::path made = FreshFolder("cluster_kinds");
    std::uint64_t seed = 0;
    for (const Kind& kind : kKinds) {
      ++seed;
      SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), seed);
      for (const std::string role : {"train", "test"}) {
        const calibration::Dataset d = arm.Run(10, 10 * seed + (role == "test"),
                                               [&](const State& s) { return s.joint == 1 ? kind.offset_Nm : 0.0; });
        logs::Log log;
        log.joints = d.joints();
        log.t = d.s.t, log.q = d.s.q, log.tau = d.tau;
        logs::WriteLog(made / (kind.name + ("." + role + ".csv.gz")), log);
      }
    }
    return made;
  }();
  return folder;
}

// A folder with the 500 pairs of logs of a fleet and its robot.
fs::path FleetFolder(const std::string& name) {
  const fs::path folder = FreshFolder(name);
  fs::create_directories(folder / "logs");
  for (int k = 0; k < kLogs; ++k)
    for (const std::string end : {".train.csv.gz", ".test.csv.gz"})
      fs::create_hard_link(KindLogs() / (KindOf(k).name + end), folder / "logs" / (NameOf(k) + end));
  fs::copy_file("codegen/robots/two_link.toml", folder / "logs/robot.toml");
  return folder;
}

// The block of docs/fleet.md that holds `marker`.
std::string PageBlock(const std::string& marker) {
  const std::string page = ReadText("docs/fleet.md"), fence = "\n```\n";
  const std::size_t at = page.find(marker), begin = page.rfind(fence, at) + fence.size();
  EXPECT_NE(at, std::string::npos) << marker;
  return page.substr(begin, page.find(fence, at) + 1 - begin);
}

// A shell's commands in a folder, with armcal and the system's programs in the search path. before: what stands before
// the folder's commands, such as a variable that they and all their children get.
std::vector<std::string> Shell(const fs::path& folder, const std::string& commands, const std::string& before = "") {
  const std::string tool = fs::path(ARMCAL_TOOL).parent_path().string();
  return {"bash", "-c",
          "set -euo pipefail; cd '" + folder.string() + "'; export PATH='" + tool + "':\"$PATH\":/usr/sbin; " + before +
              "\n" + commands};
}

bool Installed(const std::string& program) { return RunProgram(Shell(".", "command -v " + program)).code == 0; }

// Waits until it is so. False: it was not, for too long.
template <class Holds>
bool Until(Holds holds, int seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return true;
}

// Processes that were started with this variable, or whose parents were.
std::set<pid_t> ProcessesWith(const std::string& variable) {
  std::set<pid_t> found;
  for (const auto& e : fs::directory_iterator("/proc")) {
    const std::string name = e.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    if ((std::string(1, '\0') + ReadText(e.path() / "environ")).find('\0' + variable + '\0') != std::string::npos)
      found.insert(std::stoi(name));
  }
  return found;
}

// Ends them as a power failure does: none lives to see another one's end. Returns how many there were.
std::size_t KillAllWith(const std::string& variable) {
  std::set<pid_t> stopped;
  for (bool more = true; more;) {
    more = false;
    for (const pid_t p : ProcessesWith(variable))
      if (stopped.insert(p).second) kill(p, SIGSTOP), more = true;
  }
  for (const pid_t p : stopped) kill(p, SIGKILL);
  return stopped.size();
}

struct FileIdentity {
  ino_t inode;
  long s, ns;
  auto operator<=>(const FileIdentity&) const = default;
};

// Every verdict that is there, by name. A file that was written again is another one.
std::map<std::string, FileIdentity> VerdictsIn(const fs::path& folder) {
  std::map<std::string, FileIdentity> found;
  if (!fs::exists(folder)) return found;
  for (const auto& e : fs::directory_iterator(folder)) {
    struct stat file {};
    if (e.path().extension() == ".json" && stat(e.path().c_str(), &file) == 0)
      found[e.path().stem().string()] = {file.st_ino, file.st_mtim.tv_sec, file.st_mtim.tv_nsec};
  }
  return found;
}

// Each log has one verdict, which says what was planted. kept: verdicts that must not have been written again.
void ExpectOneVerdictEach(const fs::path& folder, const std::map<std::string, FileIdentity>& kept) {
  const std::map<std::string, FileIdentity> written = VerdictsIn(folder / "verdicts");
  EXPECT_EQ(written.size(), static_cast<std::size_t>(kLogs));
  for (const auto& [name, file] : kept) EXPECT_TRUE(written.contains(name) && written.at(name) == file) << name;
  for (int k = 0; k < kLogs; ++k)
    for (const char* end : {".json", ".html", ".toml", ".log"})
      EXPECT_GT(fs::file_size(folder / "verdicts" / (NameOf(k) + end)), 0U) << NameOf(k) << end;

  const Outcome summary = RunProgram(Shell(folder, PageBlock("--summary verdicts --batch logs")));
  ASSERT_EQ(summary.code, 0) << summary.err << summary.out;
  const nlohmann::json all = ReadJson(folder / "all.json");
  EXPECT_EQ(all.at("failed"), 0);
  std::set<std::string> names;
  for (const auto& v : all.at("verdicts")) {
    const std::string name = v.at("name");
    EXPECT_TRUE(names.insert(name).second) << "twice: " << name;
    double offset_Nm = 0;
    for (const Kind& kind : kKinds)
      if (name.starts_with(kind.name)) offset_Nm = kind.offset_Nm;
    EXPECT_EQ(v.at("terms").size(), offset_Nm == 0 ? 0U : 1U) << v;
    for (const auto& t : v.at("terms")) {
      EXPECT_EQ(t.at("kind"), "torque_offset") << v;
      EXPECT_NEAR(t.at("parameters").value("torque_offset.To2", 0.0), offset_Nm, 0.1) << v;
    }
  }
  for (int k = 0; k < kLogs; ++k) EXPECT_TRUE(names.contains(NameOf(k))) << "none: " << NameOf(k);
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kLogs));

  const Outcome kept_in_base =
      Tool({"diagnose", "--summary", (folder / "verdicts").string(), "--db", (folder / "fleet.sqlite").string()});
  EXPECT_NE(kept_in_base.out.find(": 500 verdicts"), std::string::npos) << kept_in_base.err;
}

// Runs the page's commands and kills all processes of the mark in the middle. Returns the verdicts that were there.
std::map<std::string, FileIdentity> KillInTheMiddle(const fs::path& folder, const std::string& mark) {
  const bool begun = Until([&] { return VerdictsIn(folder / "verdicts").size() >= kVerdictsBeforeTheKill; }, 900);
  EXPECT_TRUE(begun) << VerdictsIn(folder / "verdicts").size();
  const std::size_t killed = KillAllWith(mark);
  EXPECT_TRUE(Until([&] { return ProcessesWith(mark).empty(); }, 60));
  const std::map<std::string, FileIdentity> kept = VerdictsIn(folder / "verdicts");
  EXPECT_LT(kept.size(), static_cast<std::size_t>(kLogs));
  std::printf("killed %zu processes after %zu verdicts\n", killed, kept.size());
  EXPECT_GE(killed, 2U);
  return kept;
}

// Slurm on this host alone, in a folder, of the user who runs the test, on ports of its own. It ends with the object.
class Slurm {
 public:
  explicit Slurm(const fs::path& folder) : folder_(folder) {
    const std::string f = folder.string();
    const auto free_port = [] { return std::to_string(TakenPort(false).port()); };
    char host[65] = {};
    gethostname(host, sizeof host - 1);
    for (const char* sub : {"state", "spool"}) fs::create_directories(folder / sub);
    std::string user = RunProgram({"id", "-un"}).out;
    user.pop_back();  // the end of the line
    std::ofstream(folder / "slurm.conf")
        << "ClusterName=armcal\nSlurmctldHost=" << host << "(127.0.0.1)\nSlurmctldPort=" << free_port()
        << "\nSlurmdPort=" << free_port() << "\nSlurmUser=" << user << "\nSlurmdUser=" << user
        << "\nAuthType=auth/munge\nCredType=cred/munge\nAuthInfo=socket=" << f << "/munge,cred_expire=20"
        << "\nStateSaveLocation=" << f << "/state\nSlurmdSpoolDir=" << f << "/spool\nSlurmctldPidFile=" << f
        << "/slurmctld.pid\nSlurmdPidFile=" << f << "/slurmd.pid\nProctrackType=proctrack/linuxproc\n"
        << "TaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\nMpiDefault=none\nReturnToService=2\n"
        << "SelectType=select/cons_tres\nSelectTypeParameters=CR_CPU\nSlurmdParameters=config_overrides\n"
        << "CommunicationParameters=NoCtldInAddrAny,NoInAddrAny\n"  // on the loopback address alone
        << "SlurmdTimeout=15\nMinJobAge=3600\n"  // a silent node is down after 15 s; all jobs are told of at the end
        << "NodeName=" << host << " NodeAddr=127.0.0.1 CPUs=2\nPartitionName=all Nodes=ALL Default=YES\n";
    fs::create_symlink("slurm.conf", folder / "node.conf");
    // Who has the key may run jobs.
    close(open((folder / "key").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
    std::string key(1024, '\0');
    std::ifstream("/dev/urandom", std::ios::binary).read(key.data(), static_cast<std::streamsize>(key.size()));
    std::ofstream(folder / "key", std::ios::binary) << key;
    Launch(
        "munged --foreground --force --key-file=key --socket=munge --pid-file=munged.pid --log-file=munged.log "
        "--seed-file=seed");
    Launch("slurmctld -D");
    StartNode();
  }
  ~Slurm() {
    KillAllWith(node());
    for (const pid_t child : children_) kill(child, SIGKILL), WaitFor(child);
  }
  Slurm(const Slurm&) = delete;
  Slurm& operator=(const Slurm&) = delete;

  // What the node's daemon and all that it starts have in their environment, and nothing else has.
  std::string node() const { return "SLURM_CONF=" + (folder_ / "node.conf").string(); }
  std::string conf() const { return "export SLURM_CONF='" + (folder_ / "slurm.conf").string() + "'; "; }
  void StartNode() { Launch("env '" + node() + "' slurmd -D"); }
  std::string NodeState() const { return Ask("sinfo --noheader --format=%T").out; }
  Outcome Ask(const std::string& command) const { return RunProgram(Shell(folder_, command, conf())); }
  std::string Logs() const { return ReadText(folder_ / "out.txt"); }

 private:
  void Launch(const std::string& command) {
    const int out = open((folder_ / "out.txt").c_str(), O_CREAT | O_APPEND | O_WRONLY | O_CLOEXEC, 0644);
    children_.push_back(Start(Shell(folder_, "exec setpriv --pdeathsig KILL " + command, conf()), out, out));
    close(out);
  }

  fs::path folder_;
  std::vector<pid_t> children_;
};

TEST(Cluster, SlurmArray_WhoseNodeDies_GivesEachLogOneVerdict) {
  if (!Installed("slurmctld")) GTEST_SKIP() << "no Slurm here (toolchains/install.sh fleet)";
  const fs::path folder = FleetFolder("cluster_slurm");
  std::ofstream(folder / "diagnose.sbatch") << PageBlock("#SBATCH --array");
  fs::create_directories(folder / "slurm");
  Slurm slurm(folder / "slurm");
  ASSERT_TRUE(Until([&] { return slurm.NodeState() == "idle\n"; }, 120)) << slurm.Logs();

  const pid_t batch = Start(Shell(folder, PageBlock("sbatch --wait"), slurm.conf()), STDOUT_FILENO, STDERR_FILENO);
  const auto kept = KillInTheMiddle(folder, slurm.node());
  EXPECT_TRUE(Until([&] { return slurm.NodeState().starts_with("down"); }, 120)) << slurm.Logs();
  slurm.StartNode();
  EXPECT_EQ(WaitFor(batch), 0) << slurm.Logs();
  const std::string restarts = slurm.Ask("squeue --states=all --noheader --array --Format=RestartCnt").out;
  EXPECT_NE(restarts.find('1'), std::string::npos) << "no job was started again: " << restarts;
  ExpectOneVerdictEach(folder, kept);
}

TEST(Cluster, GnuParallel_KilledAndStartedAgain_GivesEachLogOneVerdict) {
  if (!Installed("parallel")) GTEST_SKIP() << "no GNU parallel here (toolchains/install.sh fleet)";
  const fs::path folder = FleetFolder("cluster_parallel");
  const std::string mark = "ARMCAL_RUN=" + folder.string();
  std::ofstream(folder / "machines") << "2/:\n";
  const auto start = [&] {
    return Start(Shell(folder, PageBlock("parallel --sshloginfile"), "export '" + mark + "'; "), STDOUT_FILENO,
                 STDERR_FILENO);
  };
  const pid_t first = start();
  const auto kept = KillInTheMiddle(folder, mark);
  WaitFor(first);
  EXPECT_EQ(WaitFor(start()), 0);
  ExpectOneVerdictEach(folder, kept);
}

}  // namespace
}  // namespace armcal::tests
