// tests - the physical read-out of an arm, cold and warm; needs a double FPU.
#include "port/runner/line.hpp"
#include "tests/target/read_out_arm.hpp"

using namespace armcal;          // NOLINT: all of it is under test
using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

using Model = ReadOutArm::Model;
ReadOutArm arm;

void Print(const char* name, const double* values, int count) {
  for (int k = 0; k < count; ++k) {
    std::uint64_t bits;
    std::memcpy(&bits, &values[k], sizeof bits);
    Line(name).Decimal(k).Hex(static_cast<std::uint32_t>(bits >> 32)).Hex(static_cast<std::uint32_t>(bits)).End();
  }
}

bool ReadOut(bool warm) {
  if (!arm.Begin(warm)) return false;
  while (arm.HandOver()) {
  }
  while (!arm.read_out.Step()) {
  }
  const auto& r = arm.read_out.result();
  Print("body", r.body, Model::kBodyParameters);
  Print("body_sd", r.body_sd, Model::kBodyParameters);
  Print("column", r.column, Model::kColumns);
  Print("column_sd", r.column_sd, Model::kColumns);
  Line("steps").Decimal(r.steps).End();
  return r.converged;
}

}  // namespace

int Program() {
  if (!arm.Start()) return 1;
  arm.Feed(500);
  if (!ReadOut(false)) return 2;
  arm.Feed(125);
  return ReadOut(true) ? 0 : 3;
}
