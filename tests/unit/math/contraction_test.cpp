// math - whether the compiler fuses a b + c behind the source's back: found where it does, and not where it does not.
#include <gtest/gtest.h>

#include "armcal/math/mul_add.hpp"

namespace armcal::math {
namespace {

TEST(Contracts, WithTheFlagsOfTheProject_IsFalse) { EXPECT_FALSE(Contracts()); }

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
// What -ffp-contract=fast does to a function on a core with the instruction, and what -ffp-contract=off does.
[[gnu::noinline, gnu::optimize("O2", "fp-contract=fast"), gnu::target("fma")]] bool Fast() { return Contracts(); }
[[gnu::noinline, gnu::optimize("O2", "fp-contract=off"), gnu::target("fma")]] bool Off() { return Contracts(); }

TEST(Contracts, WithContraction_IsTrue) {
  if (!__builtin_cpu_supports("fma")) GTEST_SKIP() << "this processor has no fused multiply-add";
  EXPECT_TRUE(Fast());
  EXPECT_FALSE(Off());
}
#endif

}  // namespace
}  // namespace armcal::math
