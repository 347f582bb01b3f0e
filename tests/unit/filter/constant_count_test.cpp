// filter - the instructions of an update, counted by single-stepping a child process.
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <limits>
#include <set>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter {
namespace {
using namespace test;  // NOLINT: the bench of these tests

// Instructions that `call` takes in a forked copy of this process; 0 where tracing is not allowed.
template <class Call>
long Count(Call call) {
  const pid_t child = fork();
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(1);
    raise(SIGSTOP);
    call();
    raise(SIGUSR1);
    _exit(0);
  }
  int status = 0;
  long count = 0;
  waitpid(child, &status, 0);
  while (WIFSTOPPED(status) && WSTOPSIG(status) != SIGUSR1) {
    if (ptrace(PTRACE_SINGLESTEP, child, nullptr, nullptr) != 0) break;
    waitpid(child, &status, 0);
    ++count;
  }
  kill(child, SIGKILL);
  waitpid(child, &status, 0);
  return count;
}

template <class Filter>
class ConstantCount : public testing::Test {};
using Filters =
    testing::Types<ForgettingFilter<Small>, KalmanFilter<Small>, KalmanFilter<Small, Form::kBlock>, ModelBank<Small>>;
TYPED_TEST_SUITE(ConstantCount, Filters);

TYPED_TEST(ConstantCount, GatedRefusedTinyAndPlainRows_CostTheSame) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "a sanitizer adds its own branches";
#endif
  Bench bench;
  TypeParam filter;
  filter.Restart(bench.prior);
  for (const Row& r : bench.Rows(20)) filter.Update(r.joint, r.front, r.dense, r.y, true);
  std::set<long> counts;
  for (int kind = 0; kind < 5; ++kind) {
    Row row = bench.Next(2);
    if (kind == 2) row.dense[5] = std::numeric_limits<float>::quiet_NaN();
    for (float& x : row.dense) x *= kind == 3 ? 1e-20f : 1.0f;
    if (kind == 4) row.y = -1e5f;
    counts.insert(Count([&] { filter.Update(row.joint, row.front, row.dense, row.y, kind != 1); }));
  }
  if (*counts.begin() == 0) GTEST_SKIP() << "ptrace is not allowed here";
  // An update of this small layout is 500 to 5000 instructions; the choice of the answer's Status may differ by a few.
  EXPECT_GT(*counts.begin(), 300);
  EXPECT_LE(*counts.rbegin() - *counts.begin(), 16);
}

}  // namespace
}  // namespace armcal::filter
