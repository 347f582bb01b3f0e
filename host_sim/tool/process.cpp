// tool - starts programs by fork and exec, reads their output through a pipe, and waits for their end.
#include "host_sim/tool/process.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>

#include "codegen/src/io/input_error.hpp"

namespace armcal::tool {
namespace {

// The words as exec wants them. The pointers are valid as long as the words are.
std::vector<char*> Arguments(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& w : words) arguments.push_back(const_cast<char*>(w.c_str()));
  arguments.push_back(nullptr);
  return arguments;
}

[[noreturn]] void BecomeAsChild(const std::vector<std::string>& words) {
  execvp(words[0].c_str(), Arguments(words).data());  // also a program of the search path, such as cmake
  _exit(127);
}

int CodeOf(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

}  // namespace

std::string OwnProgram() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

std::string ProgramFor(const std::string& stem, const std::string& robot, const std::string& chosen,
                       const std::string& what) {
  const std::filesystem::path beside = std::filesystem::path(OwnProgram()).parent_path() / (stem + "-" + robot);
  const std::string program = chosen.empty() ? beside.string() : chosen;
  if (std::filesystem::is_regular_file(program)) return program;
  if (!chosen.empty()) throw io::InputError("--program " + chosen + ": no such file");
  std::set<std::string> built;
  for (const auto& e : std::filesystem::directory_iterator(beside.parent_path()))
    if (const std::string name = e.path().filename().string(); name.starts_with(stem + "-"))
      built.insert(name.substr(stem.size() + 1));
  std::string known;
  for (const std::string& one : built) known += (known.empty() ? "" : ", ") + one;
  throw io::InputError(program + ": no " + what + " has been built for robot " + robot +
                       (known.empty() ? "" : "; there is one for " + known));
}

void Become(const std::vector<std::string>& words) {
  execv(words[0].c_str(), Arguments(words).data());
  throw io::InputError(words[0] + ": cannot be started");
}

int RunProgram(const std::vector<std::string>& words, const std::string& log) {
  const pid_t child = fork();
  if (child == 0) {
    if (!log.empty()) {
      const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
      dup2(file, 1);
      dup2(file, 2);
    }
    BecomeAsChild(words);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return CodeOf(status);
}

Background::Background(const std::vector<std::string>& words) {
  int ends[2];
  if (pipe(ends) != 0) throw io::InputError(std::string("cannot open a pipe: ") + std::strerror(errno));
  child_ = fork();
  if (child_ == 0) {
    dup2(ends[1], 1);
    close(ends[0]);
    close(ends[1]);
    BecomeAsChild(words);
  }
  close(ends[1]);
  pipe_ = ends[0];
  char c = 0;
  while (read(pipe_, &c, 1) == 1 && c != '\n') first_line_ += c;
  if (c != '\n') {
    const int code = Wait();
    throw io::InputError(words[0] + ": ended before it was ready, with code " + std::to_string(code) +
                         (first_line_.empty() ? "" : ": " + first_line_));
  }
}

Background::~Background() { Stop(); }

std::string Background::ReadAll() {
  std::string text;
  char buffer[4096];
  for (ssize_t got; (got = read(pipe_, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<std::size_t>(got));
  return text;
}

int Background::Wait(std::string* output) {
  const std::string text = ReadAll();
  if (output) *output = text;
  int status = 0;
  waitpid(child_, &status, 0);
  close(pipe_);
  child_ = -1;
  return CodeOf(status);
}

void Background::Stop() {
  if (child_ < 0) return;
  kill(child_, SIGTERM);
  Wait();
}

}  // namespace armcal::tool
