// faults - runs the tests of a fault's room with the fault switched on; knows names and exit codes only.
//   run_faults FAULTS TESTS [NUMBER | ROOM ...]: folders of <room>.toml and of the programs faults_<room>; one fault,
//   or those of some rooms. Prints which test caught which fault; fails if a fault survives, or if a test fails without
//   any. A fault may never end: a run has four times what the sound tests of its room take, and ten seconds.
#include <fmt/core.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <set>
#include <thread>

#include "tests/faults/fault_list.hpp"

namespace {

using armcal::faults::Fault;

constexpr int kLongest_s = 600;  // of a room's sound tests

// The first test that fails, and how else the run ended badly; empty: all passed.
std::string FailingTest(const std::string& tests, const std::string& room, std::size_t number, int timeout_s) {
  const std::string command = fmt::format(
      "ARMCAL_FAULT={} timeout {} {}/faults_{} --gtest_brief=1 --gtest_fail_fast 2>&1", number, timeout_s, tests, room);
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command);
  std::string output;
  char part[4096];
  while (const std::size_t count = std::fread(part, 1, sizeof part, pipe)) output.append(part, count);
  const int status = pclose(pipe);
  if (status == 0) return "";
  if (WIFEXITED(status) && WEXITSTATUS(status) == 124) return fmt::format("no end within {} s", timeout_s);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) throw std::runtime_error("not found: " + command);
  const std::string mark = "[  FAILED  ] ";
  const std::size_t at = output.find(mark);
  if (at == output.npos) return "crash";
  const std::size_t from = at + mark.size();
  return output.substr(from, output.find_first_of(" ,\n", from) - from);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: run_faults FAULTS TESTS [NUMBER | ROOM ...]");
  const std::vector<Fault> faults = armcal::faults::ReadFaults(argv[1]);
  const std::string tests = argv[2];
  const std::set<std::string> asked_for(argv + 3, argv + argc);
  std::vector<std::size_t> taken;
  for (std::size_t k = 0; k < faults.size(); ++k)
    if (asked_for.empty() || asked_for.contains(faults[k].room) || asked_for.contains(std::to_string(k + 1)))
      taken.push_back(k);
  if (taken.empty()) throw std::runtime_error("no such fault");

  std::map<std::string, int> timeout_s;  // of each room
  for (const std::size_t k : taken) timeout_s[faults[k].room] = kLongest_s;
  int bad = 0;
  for (auto& [room, longest_s] : timeout_s) {
    const auto start = std::chrono::steady_clock::now();
    const std::string failing = FailingTest(tests, room, 0, longest_s);
    longest_s =
        10 + static_cast<int>(4 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (failing.empty()) continue;
    fmt::print("without a fault {} fails: {}\n", room, failing);
    ++bad;
  }

  std::vector<std::string> caught(faults.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i; (i = next++) < taken.size();) {
      const std::size_t k = taken[i];
      caught[k] = FailingTest(tests, faults[k].room, k + 1, timeout_s.at(faults[k].room));
    }
  };
  std::vector<std::thread> workers;
  for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) workers.emplace_back(work);
  for (std::thread& worker : workers) worker.join();

  for (const std::size_t k : taken) {
    bad += caught[k].empty();
    fmt::print("{:3} {:11} {:70} {}\n", k + 1, faults[k].room, faults[k].name,
               caught[k].empty() ? "SURVIVES" : caught[k]);
  }
  fmt::print("{} faults, {}\n", taken.size(), bad == 0 ? "all caught" : "NOT all caught");
  return bad != 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "run_faults: {}\n", e.what());
  return 1;
}
