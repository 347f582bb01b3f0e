// estimator - wrong readings in ticks that come early or late: the whole battery, with time stamps, against the run
// with exact ticks in which the wrong ones are flagged.
#include "tests/unit/estimator/glitches.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests

template <class Filter>
struct JitteredGlitchTest : GlitchTest<Filter> {};
TYPED_TEST_SUITE(JitteredGlitchTest, GlitchFilters);

TYPED_TEST(JitteredGlitchTest, WrongReadings_LeaveEstimatesWhereFlaggedOnesLeaveThem) {
  for (const Glitch& glitch : Battery()) {
    Pair pair(21, JitteredTicks());
    glitch.plant(pair);
    this->Compare(glitch.name, pair);
  }
}

// The clock of the ticks is wrong, too: a crystal, and a timer that was set wrongly.
TYPED_TEST(JitteredGlitchTest, WrongTickRate_DoesNotMatter) {
  for (const double drift : {1e-4, -1e-2}) {
    Pair pair(21, MakeTicks(20, true, drift));
    pair.known = MakeTicks(0, true, drift);
    this->Compare(drift > 0 ? "crystal" : "timer", pair);
  }
}

}  // namespace
}  // namespace armcal::estimator
