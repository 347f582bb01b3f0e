// controller - random tables, half of them close to a bound: none beyond the ceilings is accepted, and none that is
// accepted commands more than the ceilings say.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "armcal/controller/controller.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "codegen/generated/emps/model.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "codegen/generated/kuka_kr300/model.hpp"
#include "codegen/generated/kuka_lwr4/model.hpp"
#include "codegen/generated/puma560/model.hpp"
#include "codegen/generated/two_link/model.hpp"
#include "codegen/generated/ur10/model.hpp"
#include "codegen/src/robot/robot.hpp"
#include "tests/target/hostile_tables.hpp"
#include "tests/unit/table/nor_flash.hpp"

namespace armcal::hostile_tables {
namespace {

using core::Status;
using Words = std::vector<std::uint16_t>;

using target::Judge;

template <class Model>
Words DefaultWords() {
  Words words(estimator::Table<Model>::kWords);
  model::Encode(estimator::DefaultTable<Model>(), words.data());
  return words;
}

// The PUMA's bodies cannot exist, as its robot file says; its ceilings are not what refuses it.
template <class Model>
void ExpectDefaultWithinCeilings() {
  const Words words = DefaultWords<Model>();
  const core::Refusal r = model::CheckWords(model::View(Model::kCeilings), false, words.data());
  EXPECT_EQ(r.status, Status::kOk) << Model::kName << ", word " << r.word << ": " << r.value << ", bound " << r.bound;
  const auto judge = std::make_unique<Judge<Model>>();
  const core::Refusal all = (*judge)(words.data());
  EXPECT_TRUE(all.status == Status::kOk || all.status == Status::kUnphysical)
      << Model::kName << ", status " << static_cast<int>(all.status) << ", word " << all.word << ": " << all.value;
}

TEST(Ceilings, EveryDefaultTable_IsAccepted) {
  ExpectDefaultWithinCeilings<generated::Er20Like>();
  ExpectDefaultWithinCeilings<generated::KukaKr300>();
  ExpectDefaultWithinCeilings<generated::KukaLwr4>();
  ExpectDefaultWithinCeilings<generated::Puma560>();
  ExpectDefaultWithinCeilings<generated::Ur10>();
  ExpectDefaultWithinCeilings<generated::Emps>();
  ExpectDefaultWithinCeilings<generated::TwoLink>();
}

using Model = target::HostileTables::Model;
constexpr int n = Model::kJoints, kParameters = Model::kParameters;

int JointWord(int joint, int part) { return target::HostileTables::JointWord(joint, part); }
int ParameterWord(int k, int part) { return target::HostileTables::ParameterWord(k, part); }
int GateWord(int joint) { return ParameterWord(kParameters, 0) + 2 * joint; }
float At(const Words& words, int word) { return core::GetF32(&words[word]); }
void Put(Words& words, int word, float value) { core::PutF32(&words[word], value); }

class Hostile {
 public:
  Words Next() {
    const std::uint16_t* const words = tables_.Next();
    return {words, words + target::HostileTables::kWords};
  }

 private:
  target::HostileTables tables_;
};

// The same judgement from the robot file and by hand, for the friction law and offset of the example arm.
void ExpectHarmless(const Words& words, const codegen::Robot& robot) {
  EXPECT_EQ(words[5] & ~1, 0);
  EXPECT_LE(core::GetU32(&words[6]), 1000000u);
  if (words[5] & 1) {
    EXPECT_GE(core::GetU32(&words[6]), 500u);
  }
  for (int j = 0; j < n; ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const double X = joint.torque_limit_Nm * (1 + 1e-6);
    for (int part = 0; part < 4; ++part) EXPECT_GT(At(words, JointWord(j, part)), 0.0f);
    EXPECT_LE(At(words, JointWord(j, 0)), X);
    EXPECT_LE(At(words, JointWord(j, 1)), 10 * joint.v_min_radps * (1 + 1e-6));
    EXPECT_LE(At(words, JointWord(j, 2)), X);
    EXPECT_GE(At(words, JointWord(j, 3)), 0.5f);
    EXPECT_LE(At(words, JointWord(j, 3)), 2.0f);
    const auto amplitude = [&](int column) {
      const int k = Model::kBodyParameters + column;
      return (words[ParameterWord(k, 3)] >> 8) == 3 ? 0.0 : static_cast<double>(At(words, ParameterWord(k, 0)));
    };
    const double Fc = amplitude(3 * j), Fv = amplitude(3 * j + 1);
    for (int k = 3; k <= 1000; ++k) {
      const double braking = Fc + Fv * joint.speed_limit_radps * k / 1000;
      ASSERT_GE(braking, -0.05001 * X) << "joint " << j + 1;
      ASSERT_LE(braking, 3 * X * 1.00001) << "joint " << j + 1;
    }
    EXPECT_LE(std::abs(amplitude(3 * j + 2)), X) << "offset of joint " << j + 1;
  }
  for (int k = 0; k < kParameters; ++k) {
    for (int part = 0; part < 3; ++part) EXPECT_TRUE(std::isfinite(At(words, ParameterWord(k, part))));
    EXPECT_GE(At(words, ParameterWord(k, 1)), 0.0f);
    EXPECT_GE(At(words, ParameterWord(k, 2)), 0.0f);
    EXPECT_EQ(words[ParameterWord(k, 3)] & ~0x0303, 0);
    EXPECT_EQ(words[ParameterWord(k, 3) + 1], 0);
  }
}

struct SetPoint {
  float q[n], qd[n], qdd[n];
};

class Feed {
 public:
  explicit Feed(const codegen::Robot& robot) : robot_(robot) {}

  // While the axes are disabled: in force at once.
  void Begin(model::Committed<Model> committed) {
    committed.bumpless = false;
    EXPECT_EQ(feed_.Offer(committed, false), Status::kOk);
  }
  // While they are enabled.
  bool Offer(const model::Committed<Model>& committed) { return core::IsOk(feed_.Offer(committed, true)); }
  // False: a joint was cut to its limit.
  bool Evaluate(const SetPoint& set, double* tau) {
    const float degC[n] = {30, 30, 30, 30, 30, 30};
    float out[n];
    const Status status = feed_.Evaluate(set.q, set.qd, set.qdd, degC, 0.0f, false, out);
    for (int j = 0; j < n; ++j) {
      tau[j] = out[j];
      EXPECT_LE(std::abs(tau[j]), robot_.joint[j].torque_limit_Nm * (1 + 1e-6)) << "joint " << j + 1;
    }
    return status == Status::kOk;
  }

 private:
  const codegen::Robot& robot_;
  feedforward::FeedForward<Model> feed_;
};

// How many tables: 1e5 unless ARMCAL_HOSTILE_TABLES says otherwise.
int Count() {
  const char* const given = std::getenv("ARMCAL_HOSTILE_TABLES");
  return given != nullptr ? std::atoi(given) : 100000;
}

TEST(Ceilings, OfHostileTables_NoneIsAcceptedBeyondThem_AndEachAcceptedOneKeepsXAndY) {
  const codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
  const auto judge = std::make_unique<Judge<Model>>();
  model::Committed<Model> last;
  Hostile hostile;
  std::mt19937 random(7);
  const auto share = [&] { return static_cast<unsigned>(random()) / 4294967296.0; };
  int accepted = 0, refused_by_friction = 0, fades = 0;
  for (int k = 0; k < Count() && !HasFatalFailure(); ++k) {
    const Words words = hostile.Next();
    const core::Refusal refusal = (*judge)(words.data());
    refused_by_friction +=
        refusal.status == Status::kFeedsEnergy ||
        (refusal.status == Status::kBeyondCeiling && refusal.bound == Model::kCeilings.joint[0].friction_Nm);
    if (!core::IsOk(refusal.status)) continue;
    ++accepted;
    ExpectHarmless(words, robot);
    SetPoint set;
    for (int j = 0; j < n; ++j) {
      const codegen::Joint& joint = robot.joint[j];
      const double range = joint.position_limit_rad[1] - joint.position_limit_rad[0];
      set.q[j] = static_cast<float>(joint.position_limit_rad[0] + share() * range);
      // Faster than any v_min: a new one counts at once, and with it whether friction does.
      set.qd[j] = static_cast<float>((share() < 0.5 ? -1 : 1) * (0.1 + 0.4 * share()) * joint.speed_limit_radps);
      set.qdd[j] = static_cast<float>(0.1 * (2 * share() - 1) * joint.acceleration_limit_radps2);
    }
    double before[n], after[n];
    const auto feed = std::make_unique<Feed>(robot);
    feed->Begin(last.valid ? last : judge->committed());
    last = judge->committed();
    const auto alone = std::make_unique<Feed>(robot);
    alone->Begin(judge->committed());
    bool free = alone->Evaluate(set, after);  // Y is promised where no limit cuts either table's torque
    free = feed->Evaluate(set, before) && free;
    if (!feed->Offer(judge->committed())) continue;  // not bumpless: it waits until the axes are disabled
    bool kept = true;
    for (int tick = 0; tick < 4; ++tick) {
      free = feed->Evaluate(set, after) && free;
      for (int j = 0; j < n; ++j) {
        const double X = robot.joint[j].torque_limit_Nm, Y = 2 * X / 500;
        kept = kept && std::abs(after[j] - before[j]) <= Y + 1e-6 * X;
        before[j] = after[j];
      }
    }
    if (!free) continue;
    ++fades;
    EXPECT_TRUE(kept) << "table " << k;
  }
  RecordProperty("accepted", accepted);
  RecordProperty("fades", fades);
  EXPECT_GT(accepted, Count() / 50);
  EXPECT_GT(refused_by_friction, Count() / 200);
  EXPECT_GT(fades, Count() / 500);
}

// The controller judges as the functions do, and a client can read what it did not like.
TEST(Ceilings, TheController_RefusesTheSameTables_AndNamesTheWord) {
  namespace reg = link::reg;
  constexpr auto kWords = static_cast<std::uint16_t>(estimator::Table<Model>::kWords);
  test::NorFlash flash{{2, 16384, 8, 0xFF}};
  std::uint32_t now = 0;
  const auto count = [](void* t) { return *static_cast<std::uint32_t*>(t); };
  using Controller = controller::Controller<Model, filter::ForgettingFilter<Model>>;
  controller::BoardRules rules;
  rules.adopt_while_enabled = true;
  const auto drive =
      std::make_unique<Controller>(flash.storage(), hardware::Clock{&now, count, count}, link::Identity{}, rules);
  ASSERT_EQ(drive->Boot(), Status::kBlank);
  const auto write = [&](const auto& w) { return drive->map().Write(w.span().first, w.size(), w.data()); };
  link::Words<reg::kUnlock> key;
  key.Set<reg::kUnlock>(reg::kUnlockKey);
  ASSERT_EQ(write(key), Status::kOk);
  const auto judge = std::make_unique<Judge<Model>>();
  Hostile hostile;
  std::uint32_t sequence = 0;
  for (int k = 0; k < 300; ++k) {
    const Words words = hostile.Next();
    const auto command = [&](std::uint32_t what) {
      link::Words<reg::kCommandBlock> w;
      w.Set<reg::kSequence>(++sequence);
      w.Set<reg::kCommand>(what);
      w.Set<reg::kCommandSchema>(Model::kSchema);
      w.Set<reg::kCommandWords>(kWords);
      w.Set<reg::kCommandCrc>(core::Crc32Words(words.data(), words.size()));
      Status status = write(w);
      for (; status == Status::kUnfinished; status = write(w)) EXPECT_TRUE(drive->Step());
      return status;
    };
    ASSERT_EQ(command(reg::kOpen), Status::kOk);
    ASSERT_EQ(drive->map().Write(reg::kStagedTable.address, kWords, words.data()), Status::kOk);
    const core::Refusal expected = (*judge)(words.data());
    EXPECT_EQ(command(reg::kCheck), expected.status) << k;
    link::Words<reg::kWritingBlock> told;
    const link::Span block = SpanOf(reg::kWritingBlock);
    ASSERT_EQ(drive->map().Read(block.kind, block.first, block.count, told.data()), Status::kOk);
    EXPECT_EQ(told.Get<reg::kRefusedStatus>(), static_cast<std::uint16_t>(expected.status));
    EXPECT_EQ(told.Get<reg::kRefusedWord>(), expected.word);
  }
}

// One word at a time, with a bound that the test knows from the robot file.
TEST(Ceilings, EachKindOfWord_IsRefusedByItsNumber) {
  const auto judge = std::make_unique<Judge<Model>>();
  const auto expect = [&](int word, float value, Status status) {
    Words words = DefaultWords<Model>();
    Put(words, word, value);
    const core::Refusal r = (*judge)(words.data());
    EXPECT_EQ(r.status, status) << "word " << word << ": " << value;
    EXPECT_EQ(r.word, word) << value;
    EXPECT_TRUE(r.value == value || std::isnan(value)) << r.value;
  };
  expect(JointWord(1, 2), 2201.0f, Status::kBeyondCeiling);  // torque limit of joint 2: 2200 N m
  expect(JointWord(1, 2), 0.0f, Status::kOutOfRange);
  expect(JointWord(1, 2), -1.0f, Status::kOutOfRange);
  expect(JointWord(0, 3), 2.01f, Status::kBeyondCeiling);
  expect(JointWord(0, 3), 0.49f, Status::kBeyondCeiling);
  expect(JointWord(5, 0), 1e30f, Status::kBeyondCeiling);
  expect(JointWord(5, 1), 1e-30f, Status::kBeyondCeiling);
  expect(8, 1e-30f, Status::kBeyondCeiling);
  expect(8, 1.5f, Status::kOutOfRange);
  expect(ParameterWord(0, 0), 1e30f, Status::kBeyondCeiling);
  expect(ParameterWord(0, 1), 1e30f, Status::kBeyondCeiling);
  expect(ParameterWord(0, 2), 1e30f, Status::kBeyondCeiling);
  expect(ParameterWord(Model::kBodyParameters, 0), -1e6f, Status::kBeyondCeiling);
  expect(ParameterWord(3, 0), std::nanf(""), Status::kNotFinite);
  expect(ParameterWord(3, 1), -1.0f, Status::kOutOfRange);
  expect(GateWord(2), 2.9f, Status::kBeyondCeiling);
  expect(GateWord(2), 1000.5f, Status::kBeyondCeiling);
  expect(GateWord(5), -5.0f, Status::kOutOfRange);
  expect(GateWord(0), std::nanf(""), Status::kNotFinite);

  const auto expect_bits = [&](int word, unsigned bits, bool allowed, Status status) {
    Words words = DefaultWords<Model>();
    words[word] = static_cast<std::uint16_t>(words[word] | bits);
    const core::Refusal r = model::CheckWords(model::View(Model::kCeilings), allowed, words.data());
    EXPECT_EQ(r.status, status) << "word " << word;
    EXPECT_EQ(r.word, word);
  };
  for (unsigned bit = 1; bit < 16; ++bit) expect_bits(5, 1u << bit, true, Status::kOutOfRange);
  expect_bits(5, 1, false, Status::kForbidden);
  expect_bits(ParameterWord(7, 3), 4, true, Status::kOutOfRange);
  expect_bits(ParameterWord(7, 3), 0x0400, true, Status::kOutOfRange);
  expect_bits(ParameterWord(7, 3) + 1, 0x8000, true, Status::kOutOfRange);
  expect_bits(6, 0xFFFF, true, Status::kBeyondCeiling);  // a cross-fade of years
  for (int k = 0; k < 40; ++k) expect_bits(GateWord(n) + k, 0x0100, true, Status::kOutOfRange);
  Words fast = DefaultWords<Model>();
  fast[5] = 1, fast[7] = 499;
  EXPECT_EQ(model::CheckWords(model::View(Model::kCeilings), true, fast.data()).word, 6);
  fast[7] = 500;
  EXPECT_EQ(model::CheckWords(model::View(Model::kCeilings), true, fast.data()).status, Status::kOk);
}

// The joint's own gate reaches the filters; 0 and layout version 1 mean the compiled one.
TEST(Ceilings, AGateOfAJoint_ReplacesTheCompiledOne) {
  Words words = DefaultWords<Model>();
  Put(words, GateWord(1), 8.0f);
  estimator::Table<Model> table;
  const auto adopted = std::make_unique<estimator::AdoptedTable<Model>>();
  const auto rigid = std::make_unique<physical::RigidPrior<Model, float>>();
  for (const bool first_layout : {false, true}) {
    if (first_layout) words[2] = 1;
    EXPECT_EQ(model::CheckWords(model::View(Model::kCeilings), false, words.data()).status, Status::kOk);
    ASSERT_EQ(model::Decode(words.data(), Model::kSchema, table), Status::kOk);
    ASSERT_EQ(estimator::BuildAdoptedTable(table, 1, *rigid, *adopted), Status::kOk);
    EXPECT_EQ(adopted->gate_sigma[0], 5.0f);
    EXPECT_EQ(adopted->gate_sigma[1], first_layout ? 5.0f : 8.0f);
  }
}

// Each version has its own length, and the other one's is refused.
TEST(Ceilings, ATableOfTheWrongLength_IsNoTable) {
  using Table = estimator::Table<Model>;
  Words words = DefaultWords<Model>();
  const auto heading = [&](int version, int count) {
    words[2] = static_cast<std::uint16_t>(version);
    return model::CheckHeading<n, kParameters>(words.data(), count, Model::kSchema);
  };
  EXPECT_EQ(heading(2, Table::kWords), Status::kOk);
  EXPECT_EQ(heading(1, Table::kFirstWords), Status::kOk);
  EXPECT_EQ(heading(1, Table::kWords), Status::kWrongSize);
  EXPECT_EQ(heading(2, Table::kFirstWords), Status::kWrongSize);
  EXPECT_EQ(heading(0, Table::kFirstWords), Status::kWrongSize);
  EXPECT_EQ(heading(3, Table::kWords), Status::kWrongSize);
}

// Friction that rises less than in proportion to speed has a negative viscous coefficient beside its Coulomb level.
TEST(Ceilings, ANegativeCoefficient_IsAcceptedAsLongAsTheSumBrakes) {
  const auto judge = std::make_unique<Judge<Model>>();
  const double top_radps = 170 * 3.14159265358979 / 180;  // joint 1
  const auto judged = [&](double Fc, double at_top) {
    Words words = DefaultWords<Model>();
    Put(words, ParameterWord(Model::kBodyParameters, 0), static_cast<float>(Fc));
    Put(words, ParameterWord(Model::kBodyParameters + 1, 0), static_cast<float>((at_top - Fc) / top_radps));
    return (*judge)(words.data());
  };
  EXPECT_EQ(judged(60, 20).status, Status::kOk);
  EXPECT_EQ(judged(60, 0).status, Status::kOk);
  EXPECT_EQ(judged(60, -74.9).status, Status::kOk) << "5 % of 1500 N m is the tolerance";
  EXPECT_EQ(judged(60, -75.1).status, Status::kFeedsEnergy);
  EXPECT_EQ(judged(-78, 300).status, Status::kFeedsEnergy) << "it pushes at low speed";
  EXPECT_EQ(judged(1400, 4600).status, Status::kBeyondCeiling) << "more than three times the joint's torque";
  EXPECT_NEAR(judged(60, -90).value, -90, 0.01);
  EXPECT_EQ(judged(60, -90).word, ParameterWord(Model::kBodyParameters + 1, 0));
}

}  // namespace
}  // namespace armcal::hostile_tables
