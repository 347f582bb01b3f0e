// end-to-end tests - run the built tool as a user does, and keep its exit code, output and files.
#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace armcal::tests {

namespace fs = std::filesystem;

std::string ReadText(const fs::path& path);
nlohmann::json ReadJson(const fs::path& path);

// A fresh folder under the build tree; it stays for whoever looks into a failure.
fs::path FreshFolder(const std::string& name);

// Starts a program with its output where it is told; a null device otherwise.
pid_t Start(std::vector<std::string> words, int out, int err);
// Returns the exit code. peak_kB: the most memory that the program held at once.
int WaitFor(pid_t child, long* peak_kB = nullptr);

struct Outcome {
  int code = -1;
  std::string out, err;
  long peak_kB = 0;  // of memory
};

Outcome RunProgram(const std::vector<std::string>& words);
Outcome Tool(std::vector<std::string> words);

// A failure as the documentation promises it: this exit code, exactly one line on stderr, holding `named`.
void ExpectOneLine(const Outcome& o, int code, const std::string& named);

// A simulated drive on a free port, ended with the object.
class RunningDrive {
 public:
  explicit RunningDrive(const fs::path& folder, const std::string& scenario = "none",
                        const std::vector<std::string>& more = {});
  ~RunningDrive();
  RunningDrive(const RunningDrive&) = delete;
  RunningDrive& operator=(const RunningDrive&) = delete;

  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  // Of the port that serves reading alone, for a drive with --read-port.
  std::string read_address() const { return "127.0.0.1:" + std::to_string(read_port_); }

 private:
  pid_t child_ = -1;
  int port_ = 0, read_port_ = 0;
};

// A loopback port that is taken; listening, or bound only, which refuses connections.
class TakenPort {
 public:
  explicit TakenPort(bool listening);
  ~TakenPort();
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int socket_, port_ = 0;
};

}  // namespace armcal::tests
