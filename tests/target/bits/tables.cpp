// tests - the drive's judgement of hostile tables: what is accepted and why the others are refused.
#include "port/runner/line.hpp"
#include "tests/target/hostile_tables.hpp"

using namespace armcal;  // NOLINT: the program is about all of it
using port::runner::Line;

namespace {
target::HostileTables tables;
target::Judge<target::HostileTables::Model> judge;
constexpr int kTables = 10000;
}  // namespace

int Program() {
  int accepted = 0;
  for (int k = 0; k < kTables; ++k) {
    const core::Refusal r = judge(tables.Next());
    accepted += core::IsOk(r.status);
    Line("table")
        .Decimal(k)
        .Value("status", static_cast<std::uint32_t>(r.status))
        .Value("word", r.word)
        .Hex(target::ResultBits(r.value))
        .Hex(target::ResultBits(r.bound))
        .End();
  }
  Line("accepted").Decimal(accepted).End();
  return 0;
}
