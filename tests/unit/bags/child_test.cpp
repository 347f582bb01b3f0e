// bags tests - a child that crashes, throws or never ends harms nobody.
#include "host_sim/data/bags/child.hpp"

#include <gtest/gtest.h>

#include <csignal>

#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::bags {
namespace {

using files::test::ErrorOf;

TEST(Child, GivesItsBytes) {
  const std::string bytes(3000000, 'x');
  EXPECT_EQ(InChild([&] { return bytes; }, 10), bytes);
  EXPECT_EQ(InChild([] { return std::string(); }, 10), "");
}

TEST(Child, ErrorsAndCrashes_AreInputErrors) {
  EXPECT_EQ(ErrorOf([] { InChild([]() -> std::string { throw io::InputError("no such column"); }, 10); }),
            "no such column");
  EXPECT_EQ(ErrorOf([] { InChild([]() -> std::string { throw std::bad_alloc(); }, 10); }), "is damaged");
  for (const int signal : {SIGKILL, SIGSEGV, SIGXCPU})
    EXPECT_EQ(ErrorOf([signal] { InChild([signal]() -> std::string { return std::to_string(raise(signal)); }, 10); }),
              "is damaged");
}

std::string NeverEnd() {
  volatile bool more = true;
  while (more) {
  }
  return {};
}

TEST(Child, ThatNeverEnds_IsEnded) {
  EXPECT_EQ(ErrorOf([] { InChild(NeverEnd, 1); }), "is damaged");
}

}  // namespace
}  // namespace armcal::bags
