// bags - forks, and takes over what the child leaves in a file without a name.
#include "host_sim/data/bags/child.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "codegen/src/io/input_error.hpp"

namespace armcal::bags {

namespace {

// Exit codes that nothing else in the child uses: a library or a sanitizer that ends the process leaves 0 or 1.
enum Outcome : int { kDone = 70, kBad, kFailed };

bool WriteAll(int file, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written = ::write(file, bytes.data() + done, bytes.size() - done);
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

std::string ReadAll(int file) {
  std::string bytes(static_cast<std::size_t>(::lseek(file, 0, SEEK_END)), '\0');
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got = ::pread(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (got <= 0) throw io::InputError("cannot be read: no memory");
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

// The child's part. Its library must not print, and must not run for ever.
[[noreturn]] void Work(const std::function<std::string()>& work, unsigned most_s, int file) {
  const int nowhere = ::open("/dev/null", O_RDWR);
  ::dup2(nowhere, STDOUT_FILENO), ::dup2(nowhere, STDERR_FILENO);
  const rlimit none{0, 0}, seconds{most_s, most_s};
  ::setrlimit(RLIMIT_CORE, &none), ::setrlimit(RLIMIT_CPU, &seconds);
  int outcome = kFailed;
  try {
    if (WriteAll(file, work())) outcome = kDone;
  } catch (const io::InputError& error) {
    if (WriteAll(file, error.what())) outcome = kBad;
  } catch (...) {
  }
  ::_exit(outcome);
}

}  // namespace

std::string InChild(const std::function<std::string()>& work, unsigned most_s) {
  const int file = ::memfd_create("armcal", MFD_CLOEXEC);
  const pid_t child = file < 0 ? -1 : ::fork();
  if (child == 0) Work(work, most_s, file);
  int status = 0;
  while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  struct Close {
    int file;
    ~Close() { ::close(file); }
  } const closed{file};
  if (child < 0) throw io::InputError("cannot be read: no process or no memory");
  const bool ended = WIFEXITED(status);
  if (!ended || (WEXITSTATUS(status) != kDone && WEXITSTATUS(status) != kBad)) throw io::InputError("is damaged");
  std::string bytes = ReadAll(file);
  if (WEXITSTATUS(status) == kBad) throw io::InputError(bytes);
  return bytes;
}

}  // namespace armcal::bags
