// diagnosis tests - search, accept, size and evaluate one term at a time, and compare it with formulas.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <functional>

#include "host_sim/diagnose/diagnosis/known_term.hpp"
#include "host_sim/diagnose/diagnosis/limits.hpp"
#include "host_sim/diagnose/diagnosis/selector.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A record whose one column is this expression of joint j, everywhere and of any size.
codegen::EffectRecord ColumnRecord(const std::string& name, const std::string& expression) {
  codegen::EffectRecord record = tests::Records().at("viscous_cubic");
  record.name = record.kind = name;
  record.needs.clear(), record.confusable_with.clear();
  record.inputs = {codegen::Quantity::kPosition, codegen::Quantity::kSpeed};
  record.linear[0].rows = {{"j", expression}};
  return record;
}

// The small arm, one training log with an effect, and the state of a diagnosis with these records alone.
struct OneLog {
  OneLog(const codegen::Catalogue& catalogue, double seconds, const tests::Effect& effect = {})
      : records(catalogue), log(arm.Run(seconds, 60, effect)), work(arm.model(), records, {&log}) {}
  Candidate* Of(const std::string& record, int joint) {
    for (const auto& c : work.candidates)
      if (c->record().name == record && c->joints() == std::vector<int>{joint}) return c.get();
    throw std::logic_error("no candidate " + record);
  }
  // A column of the joint's used rows.
  VectorXd Column(int joint, const std::function<double(double q, double qd)>& value) const {
    std::vector<double> out;
    for (int k = 0; k < log.samples(); ++k)
      if (log.used(k, joint)) out.push_back(value(log.s.q(k, joint), log.s.qd(k, joint)));
    return VectorXd::Map(out.data(), static_cast<Eigen::Index>(out.size()));
  }
  tests::SyntheticArm arm{codegen::ReadRobot("codegen/robots/two_link.toml"), 6};
  codegen::Catalogue records;
  Dataset log;
  Diagnosis::Work work;
};

double RootMeanSquare(const VectorXd& v) { return v.norm() / std::sqrt(static_cast<double>(v.size())); }

// The record's friction grows with the load. What falls with the load is nothing that it can be.
TEST(SearchedTerm, WithAnAmplitudeBelowItsBound_GainsNothing) {
  for (const double mu : {0.06, -0.06}) {
    OneLog one({{"load_friction", tests::Records().at("load_friction")}}, 20, [=](const tests::State& s) {
      return s.joint == 0 ? mu * std::abs(s.tau_rigid) * (s.qd > 0 ? 1 : s.qd < 0 ? -1 : 0) : 0;
    });
    Diagnosis::Work& w = one.work;
    w.Solve({});
    w.FollowEstimate(w.all_reads);
    w.Prepare({});
    const Metric metric(w.rows, w.WhiteNoise());
    const Thinned thinned(w.evidence, 1000, w.kept_columns);
    std::vector<NoiseModel> averaged;
    const BaseRows thin_rows = thinned.Average(w.rows, w.WhiteNoise(), averaged);
    const Metric thin_metric(thin_rows, averaged);
    const Found found = SearchCandidate(*one.Of("load_friction", 0), {w.evidence, thinned, metric, thin_metric});
    if (mu > 0) {
      EXPECT_GT(found.gain.gain, 50);
      EXPECT_NEAR(found.gain.amplitude[0], mu, 6 * found.gain.sd[0]);
    } else {
      EXPECT_EQ(found.gain.gain, 0);
    }
  }
}

// An offset that is said to be confusable with cubic friction. It bars it on its own joint, and on no other one.
TEST(NextTerm, IsBarredByAConfusableOne_OnTheSameJointOnly) {
  codegen::EffectRecord offset = tests::Records().at("torque_offset");
  offset.confusable_with = {"viscous_cubic"};
  OneLog one({{"torque_offset", offset}, {"viscous_cubic", tests::Records().at("viscous_cubic")}}, 20,
             [](const tests::State& s) { return s.joint == 1 ? 0.3 * std::pow(s.qd, 3) : 0; });
  for (const int joint : {0, 1}) {
    Chosen known, next;
    known.candidate = one.Of("torque_offset", joint);
    const bool found = Selector(one.work).Next({&known}, next);
    ASSERT_EQ(found, joint == 0);
    EXPECT_EQ(next.candidate, found ? one.Of("viscous_cubic", 1) : nullptr);
  }
}

// A wave over position that is five times as large in every fifth block of the log. All these blocks are in one fold,
// so what the other folds say of its amplitude is wrong there, and what it says of theirs is wrong, too.
TEST(NextTerm, WhoseGainIsInOneFold_IsRefused) {
  constexpr int kBlocks = 20, kFolds = 5;
  tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 6);
  const codegen::Catalogue records{{"wave", ColumnRecord("wave", "sin(40*q)")}};
  for (const bool steady : {true, false}) {
    Dataset log = arm.Run(20, 60);
    for (int k = 0; k < log.samples(); ++k) {
      const bool strong = steady || k * kBlocks / log.samples() % kFolds == 0;
      log.tau(k, 0) += (strong ? 0.4 : 0.08) * std::sin(40 * log.s.q(k, 0));
    }
    Diagnosis::Work work(arm.model(), records, {&log});
    Chosen next;
    EXPECT_EQ(Selector(work).Next({}, next), steady);
  }
}

// Half of the true speed. A curve over speed on the same joint fits what is wrong of it, so nothing says in which
// direction it is wrong.
TEST(Refinement, MovesAnUnknown_UnlessACurveOverItsSignalIsInTheModel) {
  constexpr double kTrue = 0.12, kFound = 0.06;
  const codegen::Catalogue records{{"stribeck", tests::Records().at("stribeck")},
                                   {"curve_friction", tests::Records().at("curve_friction")}};
  for (const bool beside : {false, true}) {
    OneLog one(records, 60, [](const tests::State& s) {
      return s.joint == 0 ? 0.6 * std::exp(-std::abs(s.qd) / kTrue) * (s.qd > 0 ? 1 : -1) : 0;
    });
    Chosen stribeck, curve;
    stribeck.candidate = one.Of("stribeck", 0), stribeck.eta = {kFound, 1};
    curve.candidate = one.Of("curve_friction", 0), curve.eta = {0, one.log.s.qd.col(0).maxCoeff()};
    one.work.chosen = {stribeck};
    if (beside) one.work.chosen.push_back(curve);
    one.work.Polish();
    const double speed = one.work.chosen[0].eta[0];
    if (beside) EXPECT_EQ(speed, kFound);
    else EXPECT_NEAR(speed, kTrue, 0.2 * kTrue);
  }
}

// What a fit of the ripple's size and phase, its frequency, a constant and a slope leaves to know of the frequency. The
// rest of the arm's model is too smooth to matter.
TEST(Deviation, OfARipplesFrequency_IsThatOfAFitByHand) {
  constexpr double kFrequency = 37.3, kSize_Nm = 0.4;
  OneLog one({{"torque_ripple", tests::Records().at("torque_ripple")}}, 160,
             [](const tests::State& s) { return s.joint == 0 ? kSize_Nm * std::cos(kFrequency * s.q) : 0; });
  Chosen ripple;
  ripple.candidate = one.Of("torque_ripple", 0);
  ripple.eta = {kFrequency};
  one.work.Solve({&ripple});
  const double sd = one.work.Deviations({&ripple}).at(0).eta[0];
  const std::function<double(double, double)> columns[] = {
      [](double q, double) { return -kSize_Nm * q * std::sin(kFrequency * q); },
      [](double q, double) { return std::cos(kFrequency * q); },
      [](double q, double) { return std::sin(kFrequency * q); }, [](double, double) { return 1; },
      [](double q, double) { return q; }};
  MatrixXd A(one.Column(0, columns[0]).size(), 5);
  for (int c = 0; c < 5; ++c) A.col(c) = one.Column(0, columns[c]);
  const double expected = one.arm.noise_Nm(0) * std::sqrt((A.transpose() * A).inverse()(0, 0));
  // It is taken from what 320 blocks of time leave, and has a deviation of 6 % itself: that of 40 other noises.
  EXPECT_NEAR(sd, expected, 0.2 * expected);
}

// 15.14: what one amplitude gains by chance once in 10 000 searches, 3.891 standard deviations to either side. The
// second column is the declared viscous friction and a fifth of the first one: only that fifth shows.
TEST(DetectionLimit, IsHigherWhereTheDeclaredModelTakesUpTheColumn) {
  OneLog one({{"alone", ColumnRecord("alone", "sin(40*q)")}, {"beside", ColumnRecord("beside", "qd + 0.2*sin(40*q)")}},
             20);
  const std::vector<Limit> limits = DetectionLimits(one.work);
  ASSERT_EQ(limits.size(), 4u);
  for (const Limit& limit : limits) {
    const VectorXd shows = one.Column(limit.joint, [](double q, double) { return 0.2 * std::sin(40 * q); });
    const VectorXd all = one.Column(limit.joint, [](double q, double qd) { return qd + 0.2 * std::sin(40 * q); });
    const double alone = one.arm.noise_Nm(limit.joint) * std::sqrt(15.14 / static_cast<double>(shows.size()));
    const double share = limit.record->name == "alone" ? 1 : RootMeanSquare(all) / RootMeanSquare(shows);
    EXPECT_NEAR(limit.rms_Nm, share * alone, 0.08 * share * alone) << limit.record->name << limit.joint;
  }
}

// Twice the speed, as the record fixes it, and three times its square. What was found for the fixed one says nothing.
TEST(KnownTermTorque, TakesAFixedAmplitudeFromTheRecord) {
  codegen::EffectRecord record = ColumnRecord("fixed_and_free", "qd");
  record.linear[0].fixed_amplitude = true, record.linear[0].amplitude = 2;
  record.linear.push_back(record.linear[0]);
  record.linear[1].name = "free", record.linear[1].rows = {{"j", "qd^2"}}, record.linear[1].fixed_amplitude = false;
  tests::SyntheticArm arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 6);
  const Dataset log = arm.Run(1, 61);
  calibration::Fit declared;
  declared.x = arm.truth();
  const TermTorques found = TorquesOf({&record, {1}, {}, Eigen::Vector2d(0.5, 3)}, arm.model(), declared, log);
  const VectorXd speed = log.s.qd.col(1);
  EXPECT_LT((found.torque.col(1) - 2 * speed - 3 * speed.cwiseAbs2()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(found.torque.col(0).cwiseAbs().maxCoeff(), 0);
  ASSERT_EQ(found.slope.size(), 2u);
  EXPECT_EQ(found.slope[0].cwiseAbs().maxCoeff(), 0);
  EXPECT_LT((found.slope[1].col(1) - speed.cwiseAbs2()).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace armcal::diagnosis
