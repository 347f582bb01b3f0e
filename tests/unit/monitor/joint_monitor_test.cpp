// monitor - statistics of known sequences.
#include "armcal/monitor/innovations.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

namespace armcal::monitor {
namespace {

TEST(JointMonitor, OfFewRows_IsTheirPlainMean) {
  JointMonitor m;
  m.Add(2.0f, 4.0f, 3.0f);
  m.Add(3.0f, 1.0f, -4.0f);
  EXPECT_FLOAT_EQ(m.nis(), 5.0f);
  EXPECT_FLOAT_EQ(m.residual_rms_Nm(), std::sqrt(12.5f));
  EXPECT_EQ(m.count(), 2u);
}

TEST(JointMonitor, OfAConsistentFilter_IsNearOne) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  JointMonitor m;
  for (int i = 0; i < 50000; ++i) m.Add(1.5f * normal(random), 2.25f, 0.5f * normal(random));
  EXPECT_NEAR(m.nis(), 1.0f, 0.08f);  // sqrt(2 / (2 x 4096)) = 0.016; five of them
  EXPECT_NEAR(m.residual_rms_Nm(), 0.5f, 0.02f);
}

TEST(JointMonitor, AfterAChange_ForgetsTheOldRows) {
  JointMonitor m;
  for (int i = 0; i < 20000; ++i) m.Add(1.0f, 1.0f, 1.0f);
  for (int i = 0; i < 40000; ++i) m.Add(3.0f, 1.0f, 1.0f);
  EXPECT_NEAR(m.nis(), 9.0f, 0.01f);
}

TEST(JointMonitor, NotFiniteRow_LeavesEveryBit) {
  JointMonitor m;
  m.Add(1.0f, 2.0f, 3.0f);
  JointMonitor before;
  std::memcpy(&before, &m, sizeof m);
  m.Add(std::numeric_limits<float>::quiet_NaN(), 1.0f, 1.0f);
  m.Add(1.0f, 1.0f, std::numeric_limits<float>::infinity());
  EXPECT_EQ(std::memcmp(&before, &m, sizeof m), 0);
}

}  // namespace
}  // namespace armcal::monitor
