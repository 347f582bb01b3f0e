// estimator - two hours without drift while the clock passes 2^24, 2^31 or 2^32.
#include "tests/unit/estimator/days.hpp"

namespace armcal::estimator {
namespace {

constexpr int kHours = 2;

TEST(TwoHours, WhileTheClockPassesAnyPower_ForgettingKnowsOnlyTheLastMinutes) {
  for (const std::uint32_t passage : {1u << 24, 1u << 31, 0u}) test::ForgettingKnowsOnlyTheLastMinutes(kHours, passage);
}

TEST(TwoHours, WhileTheClockPassesAnyPower_KalmanStaysWithTheTruth) {
  for (const std::uint32_t passage : {1u << 24, 1u << 31, 0u}) test::KalmanStaysWithTheTruth(kHours, passage);
}

}  // namespace
}  // namespace armcal::estimator
