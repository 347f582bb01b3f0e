// tool - starts another program: in place of this one, until it ends, or in the background.
#pragma once

#include <string>
#include <vector>

#include <sys/types.h>

namespace armcal::tool {

// The path of this program.
std::string OwnProgram();

// `chosen`, or else the program STEM-ROBOT beside this one. Throws io::InputError if it is not there: "no WHAT has been
// built for robot ROBOT".
std::string ProgramFor(const std::string& stem, const std::string& robot, const std::string& chosen,
                       const std::string& what);

// Puts the program words[0] in the place of this one. Throws io::InputError if it cannot be started.
[[noreturn]] void Become(const std::vector<std::string>& words);

// Runs, waits, returns the exit code. Output goes where ours goes, or to `log` if it is given.
int RunProgram(const std::vector<std::string>& words, const std::string& log = "");

// Started at construction; told to end (SIGTERM) and waited for at the latest by the destructor.
class Background {
 public:
  // Waits for the first line of its output. Throws io::InputError if it ends before, with what it said.
  explicit Background(const std::vector<std::string>& words);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  const std::string& first_line() const { return first_line_; }
  // Waits for its own end; returns the exit code and the rest of its output.
  int Wait(std::string* output = nullptr);
  void Stop();

 private:
  std::string ReadAll();
  pid_t child_ = -1;
  int pipe_ = -1;
  std::string first_line_;
};

}  // namespace armcal::tool
