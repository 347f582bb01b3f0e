// end-to-end tests - starts the built tool and the drive, and reads what they leave.
#include "tests/e2e/tool.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <fstream>

namespace armcal::tests {

std::string ReadText(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

nlohmann::json ReadJson(const fs::path& path) { return nlohmann::json::parse(ReadText(path)); }

fs::path FreshFolder(const std::string& name) {
  const fs::path folder = fs::path(ARMCAL_E2E_FOLDER) / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

pid_t Start(std::vector<std::string> words, int out, int err) {
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  arguments.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  return child;
}

int WaitFor(pid_t child, long* peak_kB) {
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  if (peak_kB != nullptr) *peak_kB = used.ru_maxrss;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

Outcome RunProgram(const std::vector<std::string>& words) {
  static std::atomic<int> run{0};
  const std::string base = ARMCAL_E2E_FOLDER "/run_" + std::to_string(getpid()) + "_" + std::to_string(++run);
  fs::create_directories(ARMCAL_E2E_FOLDER);
  const int out = open((base + ".out").c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644),
            err = open((base + ".err").c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  const pid_t child = Start(words, out, err);
  close(out), close(err);
  Outcome o;
  o.code = WaitFor(child, &o.peak_kB);
  o.out = ReadText(base + ".out"), o.err = ReadText(base + ".err");
  fs::remove(base + ".out"), fs::remove(base + ".err");
  return o;
}

Outcome Tool(std::vector<std::string> words) {
  words.insert(words.begin(), ARMCAL_TOOL);
  return RunProgram(words);
}

void ExpectOneLine(const Outcome& o, int code, const std::string& named) {
  EXPECT_EQ(o.code, code) << o.err << o.out;
  EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
  EXPECT_NE(o.err.find(named), std::string::npos) << o.err << " expected to name " << named;
}

RunningDrive::RunningDrive(const fs::path& folder, const std::string& scenario, const std::vector<std::string>& more) {
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  std::vector<std::string> words = {ARMCAL_TOOL, "simulate", "--scenario", scenario,
                                    "--port",    "0",        "--storage",  (folder / "drive.nor").string()};
  words.insert(words.end(), more.begin(), more.end());
  child_ = Start(words, pipe_ends[1], STDERR_FILENO);
  close(pipe_ends[1]);
  std::string line;
  for (char c = 0; read(pipe_ends[0], &c, 1) == 1 && c != '\n';) line += c;
  close(pipe_ends[0]);
  const auto colon = line.rfind(':');
  if (colon == std::string::npos) throw std::runtime_error("the drive said: " + line);
  port_ = std::stoi(line.substr(colon + 1));
  const std::string reading = "reading alone on port ";
  if (const auto at = line.find(reading); at != std::string::npos)
    read_port_ = std::stoi(line.substr(at + reading.size()));
}

RunningDrive::~RunningDrive() {
  kill(child_, SIGTERM);
  WaitFor(child_);
}

TakenPort::TakenPort(bool listening) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof a;
  if (bind(socket_, reinterpret_cast<sockaddr*>(&a), size) != 0 || (listening && listen(socket_, 8) != 0) ||
      getsockname(socket_, reinterpret_cast<sockaddr*>(&a), &size) != 0)
    throw std::runtime_error("no port");
  port_ = ntohs(a.sin_port);
}

TakenPort::~TakenPort() { close(socket_); }

}  // namespace armcal::tests
