// replay tests - a free run follows closed forms: an axis that stops by friction, an arm that keeps its energy.
#include <gtest/gtest.h>

#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/identify/replay/position_error.hpp"
#include "tests/unit/replay/one_axis.hpp"

namespace armcal::replay {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::Axis;

constexpr double kStep_s = 1e-3;

Record Times(int samples, int joints) {
  Record r;
  r.t = VectorXd::LinSpaced(samples, 0, (samples - 1) * kStep_s);
  r.q.setZero(samples, joints), r.torque = r.q;
  r.source = "made up";
  return r;
}

// 10 N for a second, then none. The torque falls along a straight line between two samples: its jump is in the middle.
MatrixXd PushedAndLetGo(const Axis& axis, double step_s, const Record& log) {
  FreeRun run(tests::AxisModel(), step_s);
  return run.Run(log, 0, log.samples() - 1, {VectorXd::Zero(1), VectorXd::Zero(1)}, axis.parameters());
}

TEST(FreeRun, AxisUnderConstantForce_FollowsTheClosedFormAndStopsInTime) {
  const Axis axis;
  Record log = Times(3001, 1);
  log.torque.topRows(1001).setConstant(10);
  const MatrixXd q = PushedAndLetGo(axis, kStep_s, log);
  // By hand: v = 7/4 (1 - e^(-2 t)), then v = (v0 + 3/4) e^(-2 s) - 3/4, which is zero at s = ln(1 + 4/3 v0) / 2.
  const double push = 1.0005, v0 = 1.75 * (1 - std::exp(-2 * push)), stop = push + 0.5 * std::log(1 + v0 / 0.75);
  const auto by_hand = [&](double t) {
    const double a = std::min(t, push), s = std::clamp(t - push, 0.0, stop - push);
    return 1.75 * (a - 0.5 * (1 - std::exp(-2 * a))) + (v0 + 0.75) * 0.5 * (1 - std::exp(-2 * s)) - 0.75 * s;
  };
  // Second order: the largest error of speed is v'' h^2 / 12 each step, here below 1e-6 m in all.
  for (int k = 0; k <= 3000; k += 50) EXPECT_NEAR(q(k, 0), by_hand(k * kStep_s), 2e-6) << k;
  const int after = static_cast<int>(stop / kStep_s) + 2;
  ASSERT_LT(after, 2900);
  EXPECT_EQ(q(after, 0), q(3000, 0));  // it stands: set-valued friction neither creeps nor chatters
  EXPECT_LT(q(after - 20, 0), q(after, 0));
}

TEST(FreeRun, AWrongCoulombFriction_ShowsInThePosition) {
  Record log = Times(3001, 1);
  log.torque.topRows(1001).setConstant(10);
  Axis wrong;
  wrong.Fc *= 1.01;  // planted
  EXPECT_GT(std::abs(PushedAndLetGo(wrong, kStep_s, log)(3000, 0) - PushedAndLetGo({}, kStep_s, log)(3000, 0)), 1e-3);
}

TEST(FreeRun, AForceBelowCoulombFriction_MovesNothing) {
  Record log = Times(500, 1);
  log.torque.setConstant(2.99);
  EXPECT_EQ(PushedAndLetGo({}, kStep_s, log).cwiseAbs().maxCoeff(), 0);
  log.torque.setConstant(3.1);
  EXPECT_GT(PushedAndLetGo({}, kStep_s, log)(499, 0), 0);
}

TEST(FreeRun, LongerSteps_TakeTheMeanOfTheTorqueAndStayClose) {
  const Axis axis;
  Record log = Times(4001, 1);
  for (int k = 0; k <= 4000; ++k) log.torque(k, 0) = 12 * std::sin(2 * std::numbers::pi * 0.5 * log.t[k]);
  const MatrixXd fine = PushedAndLetGo(axis, kStep_s, log), coarse = PushedAndLetGo(axis, 4 * kStep_s, log);
  ASSERT_EQ(coarse.rows(), 1001);
  double q = 0, v = 0, worst_fine = 0, worst_coarse = 0;  // exact under the mean force of each sample time
  for (int k = 1; k <= 4000; ++k) {
    axis.Move(0.5 * (log.torque(k - 1, 0) + log.torque(k, 0)), kStep_s, q, v);
    worst_fine = std::max(worst_fine, std::abs(fine(k, 0) - q));
    if (k % 4 == 0) worst_coarse = std::max(worst_coarse, std::abs(coarse(k / 4, 0) - q));
  }
  EXPECT_GT(std::abs(q) + worst_fine, 1e-3);  // it moves
  EXPECT_LT(worst_fine, 1e-5);                // of a stroke of 1 m
  EXPECT_LT(worst_coarse, 1e-4);
}

TEST(FreeRun, ATorqueGain_IsTakenOffTheMeasuredTorque) {
  Record log = Times(1001, 1), twice = log;
  log.torque.setConstant(10), twice.torque.setConstant(20);
  FreeRun run(tests::AxisModel(), kStep_s);
  Parameters p = Axis().parameters();
  const State rest{VectorXd::Zero(1), VectorXd::Zero(1)};
  const MatrixXd one = run.Run(log, 0, 1000, rest, p);
  p.kappa[0] = 1;
  EXPECT_LT((run.Run(twice, 0, 1000, rest, p) - one).cwiseAbs().maxCoeff(), 1e-12);
}

// Kinetic plus potential energy of codegen/robots/two_link.toml, written by hand from its figures.
double Energy(double q1, double q2, double w1, double w2) {
  constexpr double g = 9.81, l = 0.5, c = 0.2, m1 = 3, m2 = 2, I1 = 0.05, I2 = 0.03;
  constexpr double rotor1 = 2e-5 * 2500, rotor2 = 1e-5 * 2500;
  const double x = -l * std::sin(q1) * w1 - c * std::sin(q1 + q2) * (w1 + w2);
  const double y = l * std::cos(q1) * w1 + c * std::cos(q1 + q2) * (w1 + w2);
  const double kinetic = 0.5 * ((m1 * c * c + I1 + rotor1) * w1 * w1 + m2 * (x * x + y * y) +
                                I2 * (w1 + w2) * (w1 + w2) + rotor2 * w2 * w2);
  return kinetic + g * (m1 * c * std::sin(q1) + m2 * (l * std::sin(q1) + c * std::sin(q1 + q2)));
}

TEST(FreeRun, ATwoLinkArmWithoutFriction_KeepsItsEnergy) {
  const codegen::Model model(codegen::ReadRobot("codegen/robots/two_link.toml"),
                             codegen::ReadCatalogue("codegen/effects"));
  Parameters p{calibration::MakePrior(model).mean.head(model.columns()), VectorXd::Zero(2)};
  for (int c = 0; c < model.columns(); ++c)
    if (!model.is_rigid(c)) p.z[c] = 0;
  const Record log = Times(5001, 2);
  const State start{Eigen::Vector2d(0.3, 0.5), VectorXd::Zero(2)};
  const auto spread = [&](const Parameters& with) {
    FreeRun run(model, kStep_s);
    const MatrixXd q = run.Run(log, 0, 5000, start, with);
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (int k = 1; k < 5000; ++k) {
      const Eigen::RowVectorXd w = (q.row(k + 1) - q.row(k - 1)) / (2 * kStep_s);
      const double e = Energy(q(k, 0), q(k, 1), w[0], w[1]);
      least = std::min(least, e), most = std::max(most, e);
    }
    return most - least;
  };
  // The arm falls through some 30 J. Central differences of the positions err by w'' h^2 / 6: below 0.01 J.
  EXPECT_LT(spread(p), 0.02);
  Parameters heavier = p;
  heavier.z[model.front() + model.rigid() - 1] *= 1.02;  // planted
  EXPECT_GT(spread(heavier), 0.04);
}

TEST(StateFromFirst, IsTheParabolaThroughTheFirstSamples) {
  Record log = Times(100, 1);
  for (int k = 0; k < 100; ++k) log.q(k, 0) = 0.1 + 0.3 * log.t[k] + 2 * log.t[k] * log.t[k];
  log.q.bottomRows(80).setConstant(9);  // not looked at
  const State s = StateFromFirst(log, 20);
  EXPECT_NEAR(s.q[0], 0.1 + 0.3 * 0.009 + 2 * 0.009 * 0.009, 1e-12);
  EXPECT_NEAR(s.qd[0], 0.3 + 4 * 0.009, 1e-9);
  EXPECT_THROW(StateFromFirst(log, 2), io::InputError);
  EXPECT_THROW(StateFromFirst(log, 101), io::InputError);
}

TEST(Replay, ReportsErrorsLimitsAndARunaway) {
  const Axis axis;
  Record log = Times(6001, 1);
  log.torque.setConstant(10);
  double q = 0, v = 0;
  for (int k = 0; k <= 6000; ++k) {
    log.q(k, 0) = q;
    axis.Move(10, kStep_s, q, v);
  }
  const PositionError e = Replay(tests::AxisModel(), log, axis.parameters(), 20, kStep_s);
  ASSERT_EQ(e.after.size(), 3u);  // 1 s, 5 s, the end
  EXPECT_NEAR(e.after[2].seconds, 5.991, 1e-9);
  EXPECT_LT(e.rms[0], 1e-4);        // a parabola of 20 samples misses the jerk at the start
  EXPECT_GT(e.left_limits_s, 0.1);  // the axis has half a metre
  EXPECT_EQ(e.ran_away_s, 0);
  Axis wrong = axis;
  wrong.offset = -1;  // planted: 1 N pushes it ahead
  EXPECT_GT(Replay(tests::AxisModel(), log, wrong.parameters(), 20, kStep_s).after[1].error[0], 0.5);
  wrong.Fv = -40;  // feeds energy
  const PositionError away = Replay(tests::AxisModel(), log, wrong.parameters(), 20, kStep_s);
  EXPECT_GT(away.ran_away_s, 0);
  EXPECT_TRUE(away.rms.allFinite());
}

}  // namespace
}  // namespace armcal::replay
