// diagnosis tests - add effects in other forms than the records to KDL's torque: each is named and placed, or none is.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <memory>
#include <numbers>
#include <random>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;
using tests::Effect;
using tests::State;
using tests::SyntheticArm;

double Sign(double v) { return v > 0 ? 1 : v < 0 ? -1 : 0; }

// Joints count from 1 here, as in a report. Sizes: two to four times one sample's noise (0.18 and 0.11 N m).
Effect RationalStribeck(int joint, double excess_Nm) {
  return [=](const State& s) {
    return s.joint == joint - 1 ? excess_Nm / (1 + std::pow(s.qd / 0.25, 2)) * Sign(s.qd) : 0;
  };
}
Effect Asymmetry(int joint, double difference_Nm) {
  return [=](const State& s) { return s.joint == joint - 1 ? difference_Nm * std::abs(Sign(s.qd)) : 0; };
}
Effect Ripple(int joint, double amplitude_Nm, double per_rad) {
  return [=](const State& s) {
    const double a = per_rad * s.q + 0.4;
    return s.joint == joint - 1 ? amplitude_Nm * (std::cos(a) + 0.2 * std::sin(2 * a)) : 0;
  };
}
Effect LoadFriction(int joint, double mu) {
  return [=](const State& s) {
    return s.joint == joint - 1 ? mu * (std::sqrt(s.tau_rigid * s.tau_rigid + 1) - 1) * Sign(s.qd) : 0;
  };
}

// What no record holds: a speed at which something rings.
Effect Resonance(int joint, double size_Nm) {
  return [=](const State& s) {
    const double off = (std::abs(s.qd) - 0.8) / 0.12;
    return s.joint == joint - 1 ? size_Nm * std::exp(-off * off) * Sign(s.qd) : 0;
  };
}

// Springs that slip, each at its own force: what bristles and gear teeth do near a turn. A log is one run: the springs
// start anew where the position jumps, at `start` of their force in the joint's direction.
Effect Springs(int joint, double level_Nm, double longer = 1, double start = 1) {
  struct Memory {
    double q = NAN, force[3] = {};
  };
  const auto memory = std::make_shared<Memory>();
  return [=](const State& s) {
    if (s.joint != joint - 1) return 0.0;
    constexpr double kLength_rad[] = {0.004, 0.015, 0.05}, kShare[] = {0.4, 0.35, 0.25};
    double sum = 0;
    const bool starts = !(std::abs(s.q - memory->q) < 0.1);
    for (int c = 0; c < 3; ++c) {
      double& force = memory->force[c];
      const double most = kShare[c] * level_Nm;
      force = starts ? start * most * Sign(s.qd)
                     : std::clamp(force + most * (s.q - memory->q) / (longer * kLength_rad[c]), -most, most);
      sum += force;
    }
    memory->q = s.q;
    return sum - level_Nm * Sign(s.qd);  // the declared Coulomb friction holds what is left in sliding
  };
}

codegen::Robot TwoLink() { return codegen::ReadRobot("codegen/robots/two_link.toml"); }

struct Case {
  SyntheticArm arm;
  Dataset train, test;
  std::unique_ptr<Diagnosis> diagnosis;

  // change: what happens to a log beside the effect.
  Case(const Effect& effect, std::uint64_t seed, const std::function<void(Dataset&)>& change = {},
       AtTurns at_turns = AtTurns::kNever)
      : arm(TwoLink(), seed), train(arm.Run(20, 10 * seed, effect)), test(arm.Run(20, 10 * seed + 1, effect)) {
    if (change) change(train), change(test);
    diagnosis = std::make_unique<Diagnosis>(arm.model(), tests::Records(), std::vector<const Dataset*>{&train},
                                            std::vector<const Dataset*>{}, at_turns);
  }
  const Finding& finding() const { return diagnosis->finding(); }
  std::string Said() const {
    std::string s;
    for (const Term& t : finding().terms) {
      s += t.record->name;
      for (const int j : t.joints) s += " " + std::to_string(j + 1);
      for (const std::string& also : t.also_fits) s += " or " + also;
      s += "; ";
    }
    return s;
  }
  // The first term is of this kind, or says that it cannot be told from it.
  bool Names(const std::string& kind, int joint) const {
    if (finding().terms.empty()) return false;
    const Term& t = finding().terms[0];
    const bool named = t.record->name == kind || std::count(t.also_fits.begin(), t.also_fits.end(), kind) > 0;
    return named && t.joints == std::vector<int>{joint - 1};
  }
  // RMS per joint where it moves, on the held-out log.
  double After(int joint) {
    const HeldOut held_out = diagnosis->Judge(test);
    return calibration::Rms(test, held_out.after, true)[joint - 1];
  }
};

// Slow motion with many turns, and rows near them that count.
constexpr double kNearTurn_radps = 0.06;
void LeaveOutTurns(Dataset& d) {
  for (int j = 0; j < d.joints(); ++j)
    for (int k = 0; k < d.samples(); ++k) d.used(k, j) &= std::abs(d.s.qd(k, j)) > kNearTurn_radps;
}

TEST(Diagnosis, SpringsThatSlip_AreNamedHysteresis_AndSlidingFrictionIsNot) {
  Case c(Springs(1, 3), 7, LeaveOutTurns, AtTurns::kAlways);
  ASSERT_FALSE(c.finding().terms.empty());
  EXPECT_TRUE(c.Names("hysteresis", 1)) << c.Said();
  const HeldOut held_out = c.diagnosis->Judge(c.test);
  const double before = calibration::Rms(c.test, held_out.before, false)[0],
               after = calibration::Rms(c.test, held_out.after, false)[0];
  EXPECT_LT(after, 0.5 * before);
  Case nothing({}, 8, LeaveOutTurns, AtTurns::kAlways);
  EXPECT_TRUE(nothing.finding().terms.empty()) << nothing.Said();
}

// Longer springs show in sliding, too. The log begins while they still push from an earlier motion, the other way.
TEST(Diagnosis, LongSpringsThatSlip_AreNamedHysteresis_AndNoContactWhereTheLogBegins) {
  Case c(Springs(1, 3, 5, -1), 7);
  ASSERT_FALSE(c.finding().terms.empty());
  for (const Term& t : c.finding().terms) {
    EXPECT_EQ(t.joints, std::vector<int>{0}) << c.Said();
    EXPECT_EQ(t.record->effect_class, codegen::EffectClass::kStateful) << c.Said();
  }
  const HeldOut held_out = c.diagnosis->Judge(c.test);
  EXPECT_LT(calibration::Rms(c.test, held_out.after, true)[0],
            0.4 * calibration::Rms(c.test, held_out.before, true)[0]);
}

// An average of a limited band reaches over a turn.
TEST(Diagnosis, RowsNearTurns_AreLookedAtByThemselvesWhereTheBandIsLimited) {
  for (const bool limited : {false, true}) {
    Case c(
        Springs(1, 3), 7,
        [&](Dataset& d) {
          LeaveOutTurns(d);
          if (limited) d.band_Hz.setConstant(d.joints(), 6);
          d = calibration::Delayed(d, 0);  // makes the averages
        },
        AtTurns::kWhereAveraged);
    EXPECT_EQ(c.finding().at_turns.empty(), !limited) << c.Said();
  }
}

TEST(Diagnosis, RationalStribeck_IsNamedAtItsJoint) {
  Case c(RationalStribeck(2, 0.4), 1);
  EXPECT_TRUE(c.Names("stribeck", 2)) << c.Said();
  EXPECT_LT(c.After(2), 1.10 * c.arm.noise_Nm(1));
  EXPECT_TRUE(c.finding().terms[0].confirmed);
}

TEST(Diagnosis, CoulombLevelsThatDiffer_AreNamedAtTheirJoint) {
  Case c(Asymmetry(2, 0.2), 2);
  EXPECT_TRUE(c.Names("coulomb_asymmetry", 2)) << c.Said();
  EXPECT_LT(c.After(2), 1.10 * c.arm.noise_Nm(1));
  EXPECT_NEAR(c.finding().terms[0].amplitude[0], 0.2, 4 * c.finding().terms[0].sd[0]);
}

// Joints are often moved one after the other.
TEST(Diagnosis, WhereTheFirstJointStands_TheEffectOfAnotherIsFoundWithItsSize) {
  SyntheticArm arm(TwoLink(), 3);
  constexpr double kSize_Nm = 0.4;
  const Dataset log = arm.Run(20, 30, Ripple(2, kSize_Nm, 37.3), 0.5, {0});
  const Diagnosis diagnosis(arm.model(), tests::Records(), {&log});
  ASSERT_FALSE(diagnosis.finding().terms.empty());
  const Term& t = diagnosis.finding().terms[0];
  EXPECT_EQ(t.record->name, "torque_ripple");
  EXPECT_EQ(t.joints, std::vector<int>{1});
  EXPECT_TRUE(t.confirmed) << t.unconfirmed;
  EXPECT_NEAR(t.amplitude.head(2).norm(), kSize_Nm, 0.1 * kSize_Nm);
}

TEST(Diagnosis, WhereTheLastJointStands_ADelayOfTheWholeArmIsFound) {
  SyntheticArm arm(TwoLink(), 9);
  const Dataset log = calibration::Delayed(arm.Run(20, 90, {}, 0.5, {1}), 0.008);
  const Diagnosis diagnosis(arm.model(), tests::Records(), {&log});
  ASSERT_EQ(diagnosis.finding().terms.size(), 1U);
  EXPECT_EQ(diagnosis.finding().terms[0].record->name, "time_delay");
  EXPECT_TRUE(std::isnan(diagnosis.finding().innovation[1]));
}

TEST(Diagnosis, RippleOfUnknownFrequency_IsNamedWithItsFrequency) {
  for (const double k : {37.3, 530.0}) {  // the second: twice a turn of a motor behind 1:265
    Case c(Ripple(1, 0.4, k), 3);
    EXPECT_TRUE(c.Names("torque_ripple", 1)) << c.Said();
    EXPECT_NEAR(c.finding().terms[0].eta[0], k, 0.05);
    EXPECT_LT(c.After(1), 1.10 * c.arm.noise_Nm(0));
  }
}

TEST(Diagnosis, FrictionThatGrowsWithTheLoad_IsNamedAtItsJoint) {
  Case c(LoadFriction(1, 0.06), 4);
  EXPECT_TRUE(c.Names("load_friction", 1)) << c.Said();
  EXPECT_LT(c.After(1), 1.10 * c.arm.noise_Nm(0));
}

// A structure rings at 15 Hz, five times as large as the noise. All of it counted as white would hide the friction.
TEST(Diagnosis, SmallFrictionUnderRinging_IsNamed_AndRingingAloneIsNot) {
  const auto ring = [](Dataset& d) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    constexpr double kRadius = 0.97;
    const double turn = std::cos(2 * std::numbers::pi * 15 / 125);
    double one = 0, two = 0;
    for (int k = -200; k < d.samples(); ++k) {
      const double v = 2 * kRadius * turn * one - kRadius * kRadius * two + 0.25 * normal(random);
      two = one, one = v;
      if (k >= 0) d.tau(k, 0) += v;
    }
  };
  Case c(LoadFriction(1, 0.008), 4, ring);
  EXPECT_TRUE(c.Names("load_friction", 1)) << c.Said();
  Case nothing({}, 4, ring);
  EXPECT_TRUE(nothing.finding().terms.empty()) << nothing.Said();
}

TEST(Diagnosis, WhatNoRecordHolds_IsUnknownAtItsJointAndSignal_AndTheErrorFalls) {
  Case c(Resonance(2, 0.5), 7);
  ASSERT_FALSE(c.finding().terms.empty());
  const Term& t = c.finding().terms[0];
  EXPECT_EQ(t.record->kind, "unknown") << c.Said();
  EXPECT_EQ(t.record->signals[0], "qd");
  EXPECT_EQ(t.joints, std::vector<int>{1});
  EXPECT_LT(c.After(2), 1.10 * c.arm.noise_Nm(1));
}

TEST(Diagnosis, ContactsAtTwoTimes_AreOneTermWithTheirTimes) {
  const double begin[] = {5.2, 13.1}, length = 0.4;
  Case c({}, 8, [&](Dataset& d) {
    for (int k = 0; k < d.samples(); ++k)
      for (const double from : begin)
        if (const double u = (d.s.t[k] - from) / length; u > 0 && u < 1)
          d.tau(k, 1) += 1.5 * std::sin(std::numbers::pi * u);  // N m, fourteen times the noise
  });
  ASSERT_EQ(c.finding().terms.size(), 1u) << c.Said();
  const Term& t = c.finding().terms[0];
  EXPECT_EQ(t.record->name, "external_contact");
  EXPECT_EQ(t.joints, std::vector<int>{1});
  ASSERT_EQ(t.eta.size(), 4u);  // on, off of each
  std::vector<double> middle{(t.eta[0] + t.eta[1]) / 2, (t.eta[2] + t.eta[3]) / 2};
  std::sort(middle.begin(), middle.end());
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(middle[k], begin[k] + length / 2, 0.03);  // four samples
}

TEST(Diagnosis, TorqueThatIsReadLate_IsADelayOfItsLength) {
  for (const double delay_s : {0.004, -0.012}) {  // half a sample, and one and a half the other way
    Case c({}, 9, [&](Dataset& d) {
      const Eigen::MatrixXd tau = d.tau;
      for (int k = 2; k + 2 < d.samples(); ++k) {
        const double at = k - delay_s * 125;
        const int below = static_cast<int>(std::floor(at));
        d.tau.row(k) = (below + 1 - at) * tau.row(below) + (at - below) * tau.row(below + 1);
      }
    });
    ASSERT_FALSE(c.finding().terms.empty());
    const Term& t = c.finding().terms[0];
    EXPECT_EQ(t.record->name, "time_delay") << c.Said();
    EXPECT_NEAR(t.eta[0], delay_s, 0.0005);
  }
}

TEST(Diagnosis, Deviations_CoverTheTruthAsOftenAsTheySay) {
  int inside = 0, all = 0;
  for (std::uint64_t seed = 20; seed < 50; ++seed) {
    Case c(Asymmetry(2, 0.2), seed);
    if (!c.Names("coulomb_asymmetry", 2)) continue;  // or an offset: the same column while the joint moves
    const Term& t = c.finding().terms[0];
    inside += std::abs(t.amplitude[0] - 0.2) < 1.96 * t.sd[0], ++all;
  }
  EXPECT_GE(all, 25);
  EXPECT_GE(inside, 0.80 * all);  // of 30 intervals of 95 %, fewer than 24 hold the truth once in ten thousand sets
}

TEST(Diagnosis, OrdinaryParameterError_IsNoEffect) {
  for (const std::uint64_t seed : {5u, 6u}) {
    Case c({}, seed);
    EXPECT_TRUE(c.finding().terms.empty()) << "seed " << seed << ": " << c.Said();
    const HeldOut held_out = c.diagnosis->Judge(c.test);
    EXPECT_EQ(held_out.before, held_out.after);
    for (int j = 0; j < 2; ++j) {  // what would have been seen is far below the noise, and not nothing
      EXPECT_GT(c.finding().smallest[j], 0);
      EXPECT_LT(c.finding().smallest[j], 0.5 * c.arm.noise_Nm(j));
    }
  }
}

TEST(Diagnosis, Terms_AreTheSameWhicheverLogIsHeldOut) {
  Case a(RationalStribeck(2, 0.4), 1), b(RationalStribeck(2, 0.4), 1);
  (void)a.diagnosis->Judge(a.test);
  (void)b.diagnosis->Judge(b.arm.Run(10, 77, RationalStribeck(2, 0.4), 0.3));
  ASSERT_EQ(a.finding().terms.size(), b.finding().terms.size());
  for (std::size_t k = 0; k < a.finding().terms.size(); ++k) {
    const Term &x = a.finding().terms[k], &y = b.finding().terms[k];
    EXPECT_EQ(x.record->name, y.record->name);
    EXPECT_EQ(x.joints, y.joints);
    EXPECT_EQ(x.eta, y.eta);
    EXPECT_EQ(x.amplitude, y.amplitude);
    EXPECT_EQ(x.also_fits, y.also_fits);
  }
}

TEST(Diagnosis, ATermThatTheHeldOutLogRefutes_StaysUnconfirmedAndOutOfThePrediction) {
  Case c(Ripple(1, 0.4, 37.3), 3);
  ASSERT_FALSE(c.finding().terms.empty());
  const Dataset sound = c.arm.Run(20, 99);  // the same arm with the ripple gone
  const HeldOut held_out = c.diagnosis->Judge(sound);
  for (const Term& t : c.finding().terms) EXPECT_FALSE(t.confirmed) << t.record->name;
  EXPECT_LT((held_out.after - held_out.before).cwiseAbs().maxCoeff(), 0.05 * c.arm.noise_Nm(0));
}

TEST(Diagnosis, TermTorque_IsTheEffectBeyondWhatTheDeclaredModelTookUp) {
  Case c(Ripple(1, 0.4, 37.3), 3);
  const auto torque = c.diagnosis->TermTorque(c.test);
  ASSERT_FALSE(torque.empty());
  double error = 0, size = 0;
  for (int k = 0; k < c.test.samples(); ++k) {
    const double truth = Ripple(1, 0.4, 37.3)({0, c.test.s.q(k, 0), c.test.s.qd(k, 0), 0});
    double found = 0;
    for (const auto& t : torque) found += t(k, 0);
    error += std::pow(found - truth, 2), size += truth * truth;
  }
  EXPECT_LT(error, 0.1 * size);  // the second harmonic, 4 % of the square, may or may not be a term of its own
}

}  // namespace
}  // namespace armcal::diagnosis
