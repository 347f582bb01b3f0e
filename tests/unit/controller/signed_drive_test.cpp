// controller - a drive with a key: what it takes and refuses, and that no power cut opens the way for an old table.
#include <memory>
#include <random>

#include "tests/unit/controller/bench.hpp"
#include "tests/unit/link/signed_tables.hpp"

namespace armcal::signed_drive {
namespace {

using core::Status;
using Model = generated::Er20Like;
using Filter = filter::ForgettingFilter<Model>;
using Drive = test::Bench<Filter>;
using Words = std::vector<std::uint16_t>;
namespace reg = link::reg;

constexpr std::uint32_t kSerial = 4711;
const test::Key kOwnKey = test::MakeKey(3);

controller::BoardRules SignedRules() {
  controller::BoardRules rules = Drive::Rules();
  rules.saves.interval_ms = 0;
  rules.signing.key = kOwnKey.data();
  return rules;
}
link::Identity Numbered() {
  link::Identity identity;
  identity.serial_number = kSerial;
  return identity;
}
std::unique_ptr<Drive> MakeDrive() { return std::make_unique<Drive>(SignedRules(), Numbered()); }

// Tables that differ in the torque scale of joint 1.
Words Plain(int number) {
  auto table = estimator::DefaultTable<Model>();
  table.joint[0].torque_scale = 1.0f + 0.001f * static_cast<float>(number);
  Words words(Drive::kWords);
  model::Encode(table, words.data());
  return words;
}
Words SignedTable(int number, std::uint32_t counter) { return test::Signed(Plain(number), kSerial, counter, kOwnKey); }
Words FirstLayout(int number) {
  Words words = Plain(number);
  words[2] = 1;
  words.resize(estimator::Table<Model>::kFirstWords);
  return words;
}

TEST(SignedDrive, TakesSignedTablesAlone_AndEachCounterOnce) {
  const auto drive = MakeDrive();
  EXPECT_EQ(drive->Value<reg::kSigning>(), 1);
  EXPECT_EQ(drive->Flash(Plain(1)), Status::kBadSignature);
  EXPECT_EQ(drive->Flash(FirstLayout(1)), Status::kBadSignature);
  EXPECT_EQ(drive->Flash(test::Signed(Plain(1), kSerial, 5, test::MakeKey(4))), Status::kBadSignature);
  EXPECT_EQ(drive->Flash(test::Signed(Plain(1), kSerial + 1, 5, kOwnKey)), Status::kOtherDrive);
  EXPECT_EQ(drive->Flash(SignedTable(1, 0)), Status::kReplayed);
  EXPECT_EQ(drive->Value<reg::kRefusedStatus>(), 22);
  EXPECT_EQ(drive->flash.operations(), 0);
  EXPECT_EQ(drive->controller.generation(), 1u);

  ASSERT_EQ(drive->Flash(SignedTable(1, 5)), Status::kOk);
  EXPECT_EQ(drive->controller.adopted().committed.torque_scale[0], 1.001f);
  EXPECT_EQ(drive->Value<reg::kSigningCounter>(), 5u);
  EXPECT_EQ(drive->Flash(SignedTable(1, 5)), Status::kReplayed);
  EXPECT_EQ(drive->Flash(SignedTable(2, 5)), Status::kReplayed);
  EXPECT_EQ(drive->Flash(SignedTable(2, 4)), Status::kReplayed);
  ASSERT_EQ(drive->Flash(SignedTable(2, 6)), Status::kOk);
  EXPECT_EQ(drive->Read(SpanOf(reg::kActiveTable, Drive::kWords)), SignedTable(2, 6));
}

// A signature does not let a table do what no table may.
TEST(SignedDrive, KeepsItsCeilings) {
  const auto drive = MakeDrive();
  Words words = Plain(1);
  core::PutF32(&words[model::WordOfJoint(1) + 4], 1e6f);
  EXPECT_EQ(drive->Flash(test::Signed(words, kSerial, 1, kOwnKey)), Status::kBeyondCeiling);
  EXPECT_EQ(drive->Flash(test::Signed(Plain(1), kSerial, 1, kOwnKey, 1, 0xDEAD)), Status::kOutOfRange);
  EXPECT_EQ(drive->Value<reg::kSigningCounter>(), 0u) << "the counter is still free";
}

TEST(SignedDrive, LetsNoClientHoldOrResetWhatItLearns_ButTheFirmwareMay) {
  const auto drive = MakeDrive();
  drive->Unlock();
  EXPECT_EQ(drive->WriteValue<reg::kLearningHold>(1), Status::kForbidden);
  EXPECT_EQ(drive->WriteValue<reg::kLearningReset>(1), Status::kForbidden);
  drive->controller.HoldLearning(true);
  drive->Run(3000);
  EXPECT_EQ(drive->Value<reg::kRowsUsedA>(), 0u);
  drive->controller.HoldLearning(false);
  drive->Run(3000);
  EXPECT_GT(drive->Value<reg::kRowsUsedA>(), 0u);
  EXPECT_EQ(drive->controller.ResetLearning(0), Status::kOk);
}

TEST(SignedDrive, ATrial_UsesItsCounterUp) {
  const auto drive = MakeDrive();
  ASSERT_EQ(drive->Flash(SignedTable(1, 1)), Status::kOk);
  ASSERT_EQ(drive->Check(SignedTable(2, 2)), Status::kOk);
  ASSERT_EQ(drive->Command(reg::kTrial, SignedTable(2, 2)), Status::kOk);
  ASSERT_EQ(drive->Command(reg::kBack, SignedTable(2, 2)), Status::kOk);
  EXPECT_EQ(drive->Check(SignedTable(2, 2)), Status::kReplayed);
  ASSERT_EQ(drive->Check(SignedTable(2, 3)), Status::kOk);
  ASSERT_EQ(drive->Command(reg::kTrial, SignedTable(2, 3)), Status::kOk);
  ASSERT_EQ(drive->Command(reg::kConfirm, SignedTable(2, 3)), Status::kOk);
  drive->Idle();
  EXPECT_EQ(drive->Value<reg::kTransactionState>(), 5);
  EXPECT_EQ(drive->Check(SignedTable(4, 3)), Status::kReplayed);
}

// What is stored boots, whoever stored it. A key guards what comes over the wire.
TEST(SignedDrive, BootsWhatIsStored) {
  const auto open = std::make_unique<Drive>();
  EXPECT_EQ(open->Value<reg::kSigning>(), 0);
  EXPECT_EQ(open->Flash(SignedTable(1, 9)), Status::kOutOfRange) << "a drive without a key cannot judge a seal";
  ASSERT_EQ(open->Flash(FirstLayout(7)), Status::kOk);
  const auto with_key = std::make_unique<controller::Controller<Model, Filter>>(open->flash.storage(), open->clock,
                                                                                Numbered(), SignedRules());
  EXPECT_EQ(with_key->Boot(), Status::kOk);
  EXPECT_EQ(with_key->adopted().committed.torque_scale[0], 1.007f);

  const auto drive = MakeDrive();
  ASSERT_EQ(drive->Flash(SignedTable(1, 3)), Status::kOk);
  ASSERT_EQ(drive->Flash(SignedTable(2, 4)), Status::kOk);
  const auto without_key =
      std::make_unique<controller::Controller<Model, Filter>>(drive->flash.storage(), drive->clock);
  EXPECT_EQ(without_key->Boot(), Status::kOk);
  EXPECT_EQ(without_key->adopted().committed.torque_scale[0], 1.002f);
  drive->flash.Fade(16384 + 200, 5);  // the newer record, in slot 1
  const auto damaged = std::make_unique<controller::Controller<Model, Filter>>(drive->flash.storage(), drive->clock,
                                                                               Numbered(), SignedRules());
  EXPECT_EQ(damaged->Boot(), Status::kOk) << "the older one is accepted and reported";
  EXPECT_EQ(damaged->adopted().committed.torque_scale[0], 1.001f);
  std::uint16_t fallbacks[2];
  ASSERT_EQ(damaged->map().Read(link::RegisterKind::kInput, reg::kTableFallbacks.address, 2, fallbacks), Status::kOk);
  EXPECT_EQ(fallbacks[1], 1);
}

// All registers are read, and none holds four bytes of the key that follow each other.
TEST(SignedDrive, ShowsNothingOfItsKey) {
  const auto drive = MakeDrive();
  ASSERT_EQ(drive->Flash(SignedTable(1, 1)), Status::kOk);
  EXPECT_EQ(drive->Flash(Plain(2)), Status::kBadSignature);
  std::vector<std::uint8_t> shown;
  for (const auto kind : {link::RegisterKind::kInput, link::RegisterKind::kHolding})
    for (std::uint32_t address = 0; address < 0x10000; ++address) {
      std::uint16_t word;
      if (!core::IsOk(drive->controller.map().Read(kind, static_cast<std::uint16_t>(address), 1, &word))) continue;
      shown.push_back(static_cast<std::uint8_t>(word >> 8));
      shown.push_back(static_cast<std::uint8_t>(word & 0xFF));
    }
  EXPECT_GT(shown.size(), 4000u);
  for (std::size_t k = 0; k + 4 <= kOwnKey.size(); ++k)
    EXPECT_EQ(std::search(shown.begin(), shown.end(), kOwnKey.begin() + k, kOwnKey.begin() + k + 4), shown.end()) << k;
}

std::uint32_t CounterInForce(Drive& drive) {
  const Words words = drive.Read(SpanOf(reg::kActiveTable, Drive::kWords));
  return core::GetU32(&words[words.size() - 38]);
}

// Whatever a power cut leaves in force, no table with its counter or a lower one is taken afterwards. The next counter
// is what the drive shows, plus one, as a client takes it.
TEST(SignedDrive, After500PowerCutsDuringSaves_TakesNoOldCounter) {
  std::mt19937 random(5);
  test::NorFlash flash({2, 16384, 8, 0xFF});
  std::uint32_t before = 0, offered = 0;
  int old = 0, fresh = 0;
  for (int cut = 0; cut <= 500; ++cut) {
    const auto drive = std::make_unique<Drive>(SignedRules(), Numbered(), flash);
    const std::uint32_t in_force = drive->booted == Status::kOk ? CounterInForce(*drive) : 0;
    ASSERT_TRUE(in_force == before || in_force == offered) << cut;
    old += in_force != offered, fresh += in_force == offered;
    for (const std::uint32_t tried : {in_force, static_cast<std::uint32_t>(in_force * (random() % 100) / 100)}) {
      ASSERT_EQ(drive->Check(SignedTable(7, tried)), Status::kReplayed) << cut << ", counter " << tried;
    }
    before = in_force;
    offered = drive->Value<reg::kSigningCounter>() + 1;
    ASSERT_GT(offered, in_force);
    drive->flash.CutAt({static_cast<int>(random() % 34), static_cast<std::uint32_t>(random() % 80)});
    ASSERT_EQ(drive->Flash(SignedTable(cut % 100, offered)), Status::kOk) << "as far as the command goes";
    flash = drive->flash;
    flash.PowerUp();
  }
  EXPECT_GT(old, 300);
  EXPECT_GT(fresh, 50);
}

}  // namespace
}  // namespace armcal::signed_drive
