// tests - what the physical read-out takes from the background of a core with a double FPU; on others it prints
// nothing.
#include "port/runner/line.hpp"
#include "port/runner/stack.hpp"
#include "tests/target/measure.hpp"
#if !defined(__ARM_FP) || (__ARM_FP & 8)
#include "tests/target/read_out_arm.hpp"

namespace armcal::target {
namespace {

ReadOutArm arm;

// Hand-over: the filter's columns, during which it waits. Instructions: all slices after that.
void Measure(const char* name, bool warm) {
  Range call;
  call.Add(CostOf([&] { (void)arm.Begin(warm); }));
  std::uint32_t hand_over = call.most;
  for (bool more = true; more;) {
    const std::uint32_t spent = CostOf([&] { more = arm.HandOver(); });
    call.Add(spent);
    hand_over += spent;
  }
  Range slice;
  std::uint32_t sum = 0, slices = 0;
  for (bool done = false; !done; ++slices) {
    const std::uint32_t spent = CostOf([&] { done = arm.read_out.Step(); });
    slice.Add(spent);
    sum += spent;
  }
  std::uint32_t deepest = port::runner::StackOf([&] {
    (void)arm.Begin(warm);
    while (arm.HandOver()) {
    }
  });
  for (bool done = false; !done;) {
    const std::uint32_t bytes = port::runner::StackOf([&] { done = arm.read_out.Step(); });
    deepest = bytes > deepest ? bytes : deepest;
  }
  port::runner::Line("read_out")
      .Text(name)
      .Value("instructions", sum)
      .Value("slices", slices)
      .Value("slice_max", slice.most)
      .Value("hand_over", hand_over)
      .Value("hand_over_max", call.most)
      .Value("state_bytes", sizeof arm.read_out)
      .Value("stack_bytes", deepest)
      .End();
}

}  // namespace

void MeasureReadOut() {
  if (!arm.Start()) return;
  arm.Feed(500);
  Measure("map_cold", false);
  arm.Feed(125);
  Measure("map_warm", true);
}

}  // namespace armcal::target
#else
namespace armcal::target {
void MeasureReadOut() {}
}  // namespace armcal::target
#endif
