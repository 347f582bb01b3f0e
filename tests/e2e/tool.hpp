// end-to-end tests - run the built tool as a user does, and keep its exit code, output and files.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace armcal::tests {

namespace fs = std::filesystem;

inline std::string ReadText(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline nlohmann::json ReadJson(const fs::path& path) { return nlohmann::json::parse(ReadText(path)); }

// A fresh folder under the build tree; it stays for whoever looks into a failure.
inline fs::path FreshFolder(const std::string& name) {
  const fs::path folder = fs::path(ARMCAL_E2E_FOLDER) / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

// Starts a program with its output where it is told; a null device otherwise.
inline pid_t Start(std::vector<std::string> words, int out, int err) {
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

inline int WaitFor(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

struct Outcome {
  int code = -1;
  std::string out, err;
};

inline Outcome RunProgram(const std::vector<std::string>& words) {
  static int run = 0;
  const std::string base = ARMCAL_E2E_FOLDER "/run_" + std::to_string(getpid()) + "_" + std::to_string(++run);
  fs::create_directories(ARMCAL_E2E_FOLDER);
  const int out = open((base + ".out").c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644),
            err = open((base + ".err").c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644);
  const pid_t child = Start(words, out, err);
  close(out), close(err);
  Outcome o{WaitFor(child), ReadText(base + ".out"), ReadText(base + ".err")};
  fs::remove(base + ".out"), fs::remove(base + ".err");
  return o;
}

inline Outcome Tool(std::vector<std::string> words) {
  words.insert(words.begin(), ARMCAL_TOOL);
  return RunProgram(words);
}

// A failure as the documentation promises it: this exit code, exactly one line on stderr, holding `named`.
inline void ExpectOneLine(const Outcome& o, int code, const std::string& named) {
  EXPECT_EQ(o.code, code) << o.err << o.out;
  EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
  EXPECT_NE(o.err.find(named), std::string::npos) << o.err << " expected to name " << named;
}

// A simulated drive on a free port, ended with the object.
class RunningDrive {
 public:
  explicit RunningDrive(const fs::path& folder, const std::string& scenario = "none",
                        const std::vector<std::string>& more = {}) {
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
  }
  ~RunningDrive() {
    kill(child_, SIGTERM);
    WaitFor(child_);
  }
  RunningDrive(const RunningDrive&) = delete;
  RunningDrive& operator=(const RunningDrive&) = delete;

  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  pid_t child_ = -1;
  int port_ = 0;
};

// A loopback port that is taken; listening, or bound only, which refuses connections.
class TakenPort {
 public:
  explicit TakenPort(bool listening) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof a;
    if (bind(socket_, reinterpret_cast<sockaddr*>(&a), size) != 0 || (listening && listen(socket_, 8) != 0) ||
        getsockname(socket_, reinterpret_cast<sockaddr*>(&a), &size) != 0)
      throw std::runtime_error("no port");
    port_ = ntohs(a.sin_port);
  }
  ~TakenPort() { close(socket_); }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int socket_, port_ = 0;
};

}  // namespace armcal::tests
