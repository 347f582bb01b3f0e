// estimator - three days without drift; the clock passes 2^31 or 2^32, the time since the adoption 2^24.
#include "tests/unit/estimator/days.hpp"

namespace armcal::estimator {
namespace {

constexpr int kHours = 72;

TEST(SeventyTwoHours, WhileTheClockPassesTwoToThe31_ForgettingKnowsOnlyTheLastMinutes) {
  test::ForgettingKnowsOnlyTheLastMinutes(kHours, 1u << 31);
}

TEST(SeventyTwoHours, WhileTheClockPassesTwoToThe32_KalmanStaysWithTheTruth) {
  test::KalmanStaysWithTheTruth(kHours, 0u);
}

}  // namespace
}  // namespace armcal::estimator
