// fuzz - the entry of libFuzzer, for the target that the build names: -DARMCAL_FUZZ=Rtu
#include "tests/fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  armcal::fuzz::ARMCAL_FUZZ(bytes, count);
  return 0;
}
