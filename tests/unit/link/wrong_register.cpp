// link - uses a register rightly (WRONG is 0) and in three wrong ways, which must not compile.
#include "armcal/link/register_words.hpp"

namespace armcal::link {

void Use(Words<reg::kStatusBlock>& status) {
#if WRONG == 0
  status.Set<reg::kTick>(std::uint32_t{1});
#elif WRONG == 1
  status.Set<reg::kAxes>(std::uint16_t{1});
#elif WRONG == 2
  status.Set<reg::kTick>(std::uint16_t{1});
#else
  status.Set<reg::kSlotState, 2>(std::uint16_t{1});
#endif
}

}  // namespace armcal::link
