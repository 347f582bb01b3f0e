// controller - a table on trial in a whole drive: the stored table comes back after a power cut, at the time limit,
// when the motion controller reports a tracking error, and when the filters doubt the table.
#include <cmath>
#include <memory>
#include <random>

#include "tests/unit/controller/bench.hpp"

namespace armcal::trial_on_drive {
namespace {

using core::Status;
using Model = generated::Er20Like;
using Filter = filter::ForgettingFilter<Model>;
using Drive = test::Bench<Filter>;
namespace reg = link::reg;
constexpr int n = Model::kJoints;
constexpr std::uint32_t kAllEnabled = (1u << n) - 1;

estimator::Table<Model> TableWithMass(float share) {
  auto table = estimator::DefaultTable<Model>();
  for (int k = 0; k < 10; ++k) table.parameter[2 * model::kBodyBlock + k].mean *= share;  // link 3
  return table;
}

// The drive has a stored table, and another one on trial. Answers the trial's checksum.
std::uint32_t Try(Drive& drive, const estimator::Table<Model>& table) {
  std::uint32_t crc = 0;
  EXPECT_EQ(drive.Check(table, crc), Status::kOk);
  EXPECT_EQ(drive.Command(reg::kTrial, crc), Status::kOk);
  EXPECT_EQ(drive.Value<reg::kTransactionState>(), 7);
  return crc;
}

bool SameNumbers(const estimator::AdoptedTable<Model>& a, const std::vector<float>& p) {
  return std::vector<float>(a.committed.p, a.committed.p + Model::kColumns) == p;
}

TEST(TrialOnDrive, HoweverItEnds_TheStoredTableIsInForce) {
  const auto drive = std::make_unique<Drive>();
  ASSERT_EQ(drive->Flash(TableWithMass(1.0f)), Status::kOk);
  const auto& in_force = drive->controller.adopted().committed;
  const std::vector<float> stored(in_force.p, in_force.p + Model::kColumns);
  const std::uint32_t crc = drive->Value<reg::kActiveCrc>();
  const int operations = drive->flash.operations();
  std::mt19937 random(7);
  enum Cause { kPowerCut, kTimeLimit, kReported };
  int back[3] = {};
  for (const Cause cause : {kPowerCut, kTimeLimit, kReported})
    for (int k = 0; k < 100; ++k) {
      const std::uint32_t trial = Try(*drive, TableWithMass(1.01f + 0.001f * static_cast<float>(k)));
      EXPECT_EQ(drive->Value<reg::kActiveCrc>(), trial);
      EXPECT_FALSE(SameNumbers(drive->controller.adopted(), stored));
      drive->Run(static_cast<int>(random() % 16));
      if (cause == kPowerCut) {
        test::NorFlash flash = drive->flash;
        flash.PowerUp();
        const auto again = std::make_unique<controller::Controller<Model, Filter>>(flash.storage(), drive->clock);
        ASSERT_EQ(again->Boot(), Status::kOk);
        back[cause] += SameNumbers(again->adopted(), stored);
        ASSERT_EQ(drive->Command(reg::kBack, 0), Status::kOk);
        continue;
      }
      if (cause == kTimeLimit) drive->now += 600000;
      else drive->controller.ReportTrackingError();
      drive->Run(1);
      EXPECT_EQ(drive->Value<reg::kTransactionState>(), 6);
      EXPECT_EQ(drive->Value<reg::kTransactionStatus>(), cause == kTimeLimit ? 35 : 37);
      back[cause] += drive->Value<reg::kActiveCrc>() == crc && SameNumbers(drive->controller.adopted(), stored);
    }
  EXPECT_EQ(back[kPowerCut], 100);
  EXPECT_EQ(back[kTimeLimit], 100);
  EXPECT_EQ(back[kReported], 100);
  EXPECT_EQ(drive->flash.operations(), operations) << "a trial stores nothing";
}

// A tracking error that was reported before the trial says nothing about it.
TEST(TrialOnDrive, Confirmed_IsInForceAfterPowerUp) {
  const auto drive = std::make_unique<Drive>();
  ASSERT_EQ(drive->Flash(TableWithMass(1.0f)), Status::kOk);
  drive->controller.ReportTrackingError();
  const std::uint32_t crc = Try(*drive, TableWithMass(1.05f));
  drive->Run(20);
  ASSERT_EQ(drive->Command(reg::kConfirm, crc), Status::kOk);
  drive->Idle();
  EXPECT_EQ(drive->Value<reg::kTransactionState>(), 5);
  const auto& in_force = drive->controller.adopted().committed;
  const std::vector<float> p(in_force.p, in_force.p + Model::kColumns);
  const auto again = std::make_unique<controller::Controller<Model, Filter>>(drive->flash.storage(), drive->clock);
  ASSERT_EQ(again->Boot(), Status::kOk);
  EXPECT_TRUE(SameNumbers(again->adopted(), p));
}

// The torque of joint 3 in one tick, at a set-point that does not change.
float TorqueOf(Drive& drive) {
  controller::SetPoint<n> set = {};
  set.q[1] = 0.5f;
  const float warm[n] = {25, 25, 25, 25, 25, 25};
  float tau_Nm[n];
  EXPECT_EQ(drive.controller.FeedForward(set, warm, tau_Nm), Status::kOk);
  ++drive.now;
  drive.Idle();
  return tau_Nm[2];
}

// The torque moves evenly from one table's to the other's in 500 ticks, the least fade of this model, although neither
// table asks for a fade. So it does when the axes have been enabled meanwhile. A drive that has stored the other table
// knows its torque.
TEST(TrialOnDrive, FadesInAndOut_AlsoWhileAxesAreEnabled) {
  const auto drive = std::make_unique<Drive>(), other = std::make_unique<Drive>();
  ASSERT_EQ(drive->Flash(TableWithMass(1.0f)), Status::kOk);
  ASSERT_EQ(other->Flash(TableWithMass(1.25f)), Status::kOk);
  const float light = TorqueOf(*drive), heavy = TorqueOf(*other);
  ASSERT_GT(std::abs(heavy - light), 10.0f);
  const auto follow = [&](float from, float to) {
    for (int k = 1; k <= 600; ++k) {
      const float share = k < 500 ? static_cast<float>(k) / 500.0f : 1.0f;
      ASSERT_NEAR(TorqueOf(*drive), from + (to - from) * share, 1e-3f) << k;
    }
    EXPECT_EQ(TorqueOf(*drive), to);
  };
  (void)Try(*drive, TableWithMass(1.25f));
  follow(light, heavy);
  drive->controller.SetEnabledAxes(kAllEnabled);
  drive->controller.ReportTrackingError();
  drive->Idle();
  follow(heavy, light);
}

// A number outside its range is named first, whoever writes it.
TEST(TrialOnDrive, ALimitOutsideItsRange_IsRefusedBeforeTheSeatIsLookedAt) {
  const auto drive = std::make_unique<Drive>();
  EXPECT_EQ(drive->WriteValue<reg::kTrialLimit>(0), Status::kOutOfRange);
  EXPECT_EQ(drive->WriteValue<reg::kTrialLimit>(3601), Status::kOutOfRange);
  EXPECT_EQ(drive->WriteValue<reg::kTrialLimit>(7), Status::kLocked);
}

TEST(TrialOnDrive, WhileAxesAreEnabled_IsRefusedToATableThatIsNotBumpless) {
  const auto drive = std::make_unique<Drive>();
  ASSERT_EQ(drive->Flash(TableWithMass(1.0f)), Status::kOk);
  drive->controller.SetEnabledAxes(kAllEnabled);
  std::uint32_t crc = 0;
  ASSERT_EQ(drive->Check(TableWithMass(1.1f), crc), Status::kOk);
  EXPECT_EQ(drive->Command(reg::kTrial, crc), Status::kAxisEnabled);
  auto bumpless = TableWithMass(1.1f);
  bumpless.flags = model::kFlagBumpless, bumpless.blend_ms = 800;
  (void)Try(*drive, bumpless);
}

// Noise far beyond the table's. What the filters thought before the trial does not count.
TEST(TrialOnDrive, WhoseFiltersAreInconsistent_GivesTheStoredTableBack) {
  const auto drive = std::make_unique<Drive>();
  ASSERT_EQ(drive->Flash(TableWithMass(1.0f)), Status::kOk);
  drive->disturbance_LSB = 3000;
  drive->Run(9000);
  ASSERT_NE(drive->Value<reg::kHealth>(), 0);
  (void)Try(*drive, TableWithMass(1.1f));
  drive->Run(100);
  EXPECT_EQ(drive->Value<reg::kTransactionState>(), 7) << "not yet";
  drive->Run(9000);
  EXPECT_EQ(drive->Value<reg::kTransactionState>(), 6);
  EXPECT_EQ(drive->Value<reg::kTransactionStatus>(), 36);
}

}  // namespace
}  // namespace armcal::trial_on_drive
