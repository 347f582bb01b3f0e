// calibration tests - the weighted fit and its read-out against KDL's torque and a textbook Bayes update.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/band.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::Er20;
using tests::SyntheticArm;

// Largest error in standard deviations, and the share of parameters within two.
struct Honesty {
  double worst = 0, within_two = 0;
  Honesty(const Fit& fit, const VectorXd& truth) {
    int inside = 0;
    for (const int c : fit.active) {
      const double distance = std::abs(fit.x[c] - truth[c]) / fit.sd[c];
      worst = std::max(worst, distance);
      inside += distance < 2;
    }
    within_two = static_cast<double>(inside) / static_cast<double>(fit.active.size());
  }
};

TEST(WeightedFit, KdlTorque_GivesTheTrueParametersWithinTheirDeviations) {
  for (const std::uint64_t seed : {1u, 2u}) {
    SyntheticArm arm(Er20(), seed);
    const Dataset d = arm.Run(20, 100 + seed);
    const Fit fit = WeightedFit(arm.model(), {&d});
    const Honesty h(fit, arm.truth());
    EXPECT_LT(h.worst, 4) << "seed " << seed;          // 58 Gaussian errors pass 4 sd once in 270 runs
    EXPECT_GT(h.within_two, 0.85) << "seed " << seed;  // 95 % expected; errors are correlated
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(fit.sigma[j] / arm.noise_Nm(j), 1, 0.06) << j;  // 1 / sqrt(2 x 2400) x 4
  }
}

TEST(WeightedFit, ATorqueThatTheModelLacks_IsNotWithinTheDeviations) {
  SyntheticArm arm(Er20(), 1);
  const Dataset d =
      arm.Run(20, 101, [](const tests::State& s) { return s.joint == 3 ? 0.5 * s.qd * std::abs(s.qd) : 0; });
  EXPECT_GT(Honesty(WeightedFit(arm.model(), {&d}), arm.truth()).worst, 4);
}

TEST(WeightedFit, WithoutPrior_TooFewRowsPredictNoTorqueThatTheArmCannotGive) {
  codegen::Robot robot = Er20();
  robot.has_prior = false;
  SyntheticArm arm(Er20(), 1);
  const codegen::Model model(robot, tests::Records());
  Dataset few = arm.Run(20, 101);
  const Dataset other = arm.Run(20, 102);
  // Joints 4 to 6 say nothing, the others have fewer rows than columns.
  few.used.rightCols(3).setZero();
  few.used.bottomRows(few.samples() - few.samples() / 100).setZero();
  const Fit fit = WeightedFit(model, {&few});
  const MatrixXd torque = Predict(model, other, fit.x, fit.eta);
  for (int j = 0; j < model.joints(); ++j)
    EXPECT_LT(torque.col(j).cwiseAbs().maxCoeff(), 3 * robot.joint[j].torque_limit_Nm) << "joint " << j + 1;
}

TEST(WeightedFit, WithoutPrior_ALongLogGivesTheTruthAllTheSame) {
  codegen::Robot robot = Er20();
  robot.has_prior = false;
  SyntheticArm arm(Er20(), 2);
  const codegen::Model model(robot, tests::Records());
  const Dataset d = arm.Run(20, 103), other = arm.Run(20, 104);
  const Fit fit = WeightedFit(model, {&d});
  const VectorXd error = Rms(other, other.tau - Predict(model, other, fit.x, fit.eta), true);
  for (int j = 0; j < model.joints(); ++j) EXPECT_LT(error[j], 1.1 * arm.noise_Nm(j)) << "joint " << j + 1;
}

TEST(WeightedFit, TwoLogs_AreWorthMoreThanOne) {
  SyntheticArm arm(Er20(), 3);
  const Dataset a = arm.Run(10, 1), b = arm.Run(10, 2);
  const Fit one = WeightedFit(arm.model(), {&a}), both = WeightedFit(arm.model(), {&a, &b});
  EXPECT_EQ(both.information.rows.sum(), a.used.sum() + b.used.sum());
  EXPECT_LT(Honesty(both, arm.truth()).worst, 4);
  int better = 0;
  for (const int c : one.active) better += both.sd[c] < one.sd[c];
  EXPECT_GT(better, 0.9 * static_cast<double>(one.active.size()));
}

TEST(WeightedFit, AJointThatStandsStill_LeavesItsFrictionToThePrior) {
  SyntheticArm arm(Er20(), 4);
  const Dataset d = arm.Run(20, 5, {}, 0.5, {5});
  const Fit fit = WeightedFit(arm.model(), {&d});
  const std::vector<int> hardly = HardlyDetermined(arm.model(), fit);
  for (int c = 0; c < arm.model().front(); ++c) {
    if (arm.model().table()[arm.model().table_index(c)].state != "estimated") continue;
    const std::string name = arm.model().column_name(c);
    const bool still = name == "Fc6" || name == "Fv6";
    EXPECT_EQ(fit.ratio(c) > kFromPrior, still) << name << " " << fit.ratio(c);
    EXPECT_EQ(std::count(hardly.begin(), hardly.end(), c), still ? 1 : 0) << name;
  }
}

// A row of joint 1 is an average over some twenty samples, and joint 3 rests. The noise of one sample is drawn, at 125
// Hz; that of a joint that rests is the robot file's, of one tick.
TEST(NoiseDensity, IsThatOfASample_WhereRowsAreAveragesToo) {
  SyntheticArm arm(Er20(), 1);
  Dataset d = arm.Run(40, 101, {}, 0.5, {2});
  d.band_Hz.setConstant(6, INFINITY), d.band_Hz[0] = 6;
  d.average.resize(6), d.average[0] = AverageRows(d, 0);
  const Fit fit = WeightedFit(arm.model(), {&d});
  EXPECT_LT(fit.sigma[0], 0.5 * arm.noise_Nm(0));
  const VectorXd density = NoiseDensity(arm.model(), {&d}, fit);
  for (const int j : {0, 1, 3, 4, 5}) EXPECT_NEAR(density[j], arm.noise_Nm(j) / std::sqrt(125), 0.06 * density[j]) << j;
  const codegen::Robot& robot = arm.model().robot();
  EXPECT_DOUBLE_EQ(density[2], robot.joint[2].torque_noise_Nm / std::sqrt(robot.tick_rate_Hz));
}

TEST(WeightedFit, HeldColumns_StayAtThePrior) {
  SyntheticArm arm(Er20(), 4);
  const Dataset d = arm.Run(10, 5);
  const Fit fit = WeightedFit(arm.model(), {&d}, {0, 3});
  for (const int c : {0, 3}) {
    EXPECT_EQ(fit.x[c], MakePrior(arm.model()).mean[c]);
    EXPECT_EQ(fit.sd[c], 0);
  }
}

// One car on a rail: its force can be written by hand.
struct Car {
  static constexpr double kMass_kg = 95, kCoulomb_N = 20, kViscous_Nspm = 200, kOffset_N = -3, kNoise_N = 2;
  codegen::Model model{codegen::ReadRobot("codegen/robots/emps.toml"), tests::Records()};
  std::mt19937_64 random{11};

  // keeps: share of one row's noise that the next row has, too.
  Dataset Run(int samples, double step_s, double keeps) {
    Dataset d;
    d.s.t = VectorXd::LinSpaced(samples, 0, (samples - 1) * step_s);
    d.s.q.setZero(samples, 1), d.s.qd = d.s.q, d.s.qdd = d.s.q, d.tau = d.s.q;
    d.used.setZero(samples, 1);
    std::normal_distribution<double> normal(0, kNoise_N);
    double noise_N = normal(random);
    for (int k = 0; k < samples; ++k) {
      for (const auto& [size_m, f_Hz] : {std::pair{0.2, 0.2}, std::pair{0.04, 0.63}}) {
        const double w = 2 * std::numbers::pi * f_Hz, x = w * d.s.t[k] + 0.3;
        d.s.q(k, 0) += size_m * std::sin(x);
        d.s.qd(k, 0) += size_m * w * std::cos(x);
        d.s.qdd(k, 0) -= size_m * w * w * std::sin(x);
      }
      const double v = d.s.qd(k, 0);
      d.tau(k, 0) = kMass_kg * d.s.qdd(k, 0) + kCoulomb_N * (v > 0 ? 1 : -1) + kViscous_Nspm * v + kOffset_N + noise_N;
      d.used(k, 0) = std::abs(v) > model.robot().joint[0].v_min_radps;
      noise_N = keeps * noise_N + std::sqrt(1 - keeps * keeps) * normal(random);
    }
    d.moving = d.used;
    return d;
  }
};

// Four columns take four of some 20 squares away. Without them in the count, the variance would be 0.8 of the true one.
TEST(WeightedFit, AFewRows_StillTellTheNoise) {
  Car car;
  constexpr int kLogs = 400;
  double variance = 0;
  for (int k = 0; k < kLogs; ++k) {
    const Dataset d = car.Run(20, 0.25, 0);
    const Fit fit = WeightedFit(car.model, {&d});
    variance += fit.sigma[0] * fit.sigma[0] / kLogs;
  }
  // The mean has a deviation of sqrt(2 / 16 / 400) = 0.018. The gain's column counts, too, though it is no direction of
  // its own: 16 / 15.
  EXPECT_NEAR(variance / (Car::kNoise_N * Car::kNoise_N), 1, 0.13);
}

// Noise of which 0.8 stays from row to row: a sum over it varies (1 + 0.8) / (1 - 0.8) = 9 times as much as one over
// white noise. Deviations that do not count this are three times too small.
TEST(WeightedFit, NoiseThatLasts_IsCountedInTheDeviations) {
  Car car;
  constexpr int kLogs = 40;
  double squares = 0;
  for (int k = 0; k < kLogs; ++k) {
    const Dataset d = car.Run(2000, 0.01, 0.8);
    const Fit fit = WeightedFit(car.model, {&d});
    const int mass = car.model.front();
    squares += std::pow((fit.x[mass] - Car::kMass_kg) / fit.sd[mass], 2) / kLogs;
  }
  EXPECT_NEAR(std::sqrt(squares), 1, 0.45);  // 4 / sqrt(2 x 40)
}

// Prior of the standard parameters (m, m c, I about the origin, rotor), through differences of the parallel-axis rule.
MatrixXd StandardCovariance(const codegen::Model& model, const VectorXd& mean) {
  MatrixXd P = MatrixXd::Zero(mean.size(), mean.size());
  constexpr double kStep = 1e-6;
  for (int j = 0; j < model.joints(); ++j) {
    const VectorXd centre = ToCentre(mean.segment(11 * j, 10));
    MatrixXd spread = MatrixXd::Zero(11, 11);
    for (int k = 0; k < 10; ++k) {
      VectorXd up = centre, down = centre;
      up[k] += kStep, down[k] -= kStep;
      spread.col(k).head(10) = (ToOrigin(up) - ToOrigin(down)) / (2 * kStep) * model.table()[11 * j + k].sd;
    }
    spread(10, 10) = model.table()[11 * j + 10].sd;
    P.block(11 * j, 11 * j, 11, 11) = spread * spread.transpose();
  }
  return P;
}

TEST(ReadOut, OfBaseParameters_IsTheBayesUpdateOfTheStandardOnes) {
  codegen::Robot robot = Er20();
  for (auto& j : robot.joint) j.motor.torque_constant_tolerance = 0;  // gains make it nonlinear: not this test's matter
  SyntheticArm arm(robot, 7);
  const codegen::Model& model = arm.model();
  const Dataset d = arm.Run(0.8, 8);  // 100 samples: an update small enough to be written out
  const int n = 6, bodies = 66;
  std::vector<int> friction;
  for (int c = 0; c < model.front(); ++c)
    if (model.table()[model.table_index(c)].state == "estimated") friction.push_back(c);
  const int size = bodies + static_cast<int>(friction.size());

  // Columns of each body straight from its file frame, never through the base map.
  MatrixXd A = MatrixXd::Zero(d.samples() * n, size);
  std::vector<MatrixXd> block;
  for (int b = 0; b < n; ++b) {
    model.BodyColumns(d.s, b, block);
    for (int j = 0; j < n; ++j) A.block(d.samples() * j, 11 * b, d.samples(), 10) = block[j];
    A.block(d.samples() * b, 11 * b + 10, d.samples(), 1) = d.s.qdd.col(b);
  }
  for (std::size_t f = 0; f < friction.size(); ++f) {
    const int j = model.column_joint(friction[f]);
    const bool coulomb = model.column_name(friction[f])[1] == 'c';
    for (int k = 0; k < d.samples(); ++k)
      A(d.samples() * j + k, bodies + static_cast<int>(f)) = coulomb ? (d.s.qd(k, j) > 0 ? 1 : -1) : d.s.qd(k, j);
  }
  VectorXd y(d.samples() * n), weight(n), phi0(size), R(d.samples() * n);
  phi0.head(bodies) = BodyMean(model);
  MatrixXd P0 = MatrixXd::Zero(size, size);
  P0.topLeftCorner(bodies, bodies) = StandardCovariance(model, phi0.head(bodies));
  for (std::size_t f = 0; f < friction.size(); ++f) {
    const auto& p = model.table()[model.table_index(friction[f])];
    phi0[bodies + static_cast<int>(f)] = p.mean;
    P0(bodies + static_cast<int>(f), bodies + static_cast<int>(f)) = p.sd * p.sd;
  }
  for (int j = 0; j < n; ++j) {
    weight[j] = 1 / (arm.noise_Nm(j) * arm.noise_Nm(j));
    for (int k = 0; k < d.samples(); ++k) {
      const int row = d.samples() * j + k;
      y[row] = d.tau(k, j), R[row] = 1 / weight[j];
      if (!d.used(k, j)) A.row(row).setZero(), y[row] = 0;
    }
  }
  // phi = phi0 + P0 A' (A P0 A' + R)^-1 (y - A phi0)
  MatrixXd S = A * P0 * A.transpose();
  S.diagonal() += R;
  const VectorXd phi = phi0 + P0 * A.transpose() * S.ldlt().solve(y - A * phi0);

  const Prior prior = MakePrior(model);
  const Information info = Accumulate(model, d, prior.mean.head(model.columns()), {});
  const VectorXd x = SolveWithPrior(info, weight, prior, prior.active, nullptr);
  const VectorXd read = ReadOutBodies(model, x.segment(model.front(), model.rigid()));
  for (int k = 0; k < bodies; ++k)  // both are exact; what is left is round-off of two very different routes
    EXPECT_NEAR(read[k], phi[k], 1e-5 * std::sqrt(P0(k, k)) + 1e-9) << model.table()[k].name;
  for (std::size_t f = 0; f < friction.size(); ++f)
    EXPECT_NEAR(x[friction[f]], phi[bodies + static_cast<int>(f)], 1e-6 * std::abs(phi0[bodies + static_cast<int>(f)]));
}

// Largest move of a coordinate by the physical read-out, in the fit's standard deviations.
double LargestMove(const Fit& fit, const PhysicalReadOut& out) {
  double worst = 0;
  for (const int c : fit.active) worst = std::max(worst, std::abs(out.x[c] - fit.x[c]) / fit.sd[c]);
  return worst;
}

bool BayesIsPhysical(const codegen::Model& model, const Fit& fit) {
  return IsPhysical(ReadOutBodies(model, fit.x.segment(model.front(), model.rigid())));
}

TEST(ReadOutPhysical, GivesBodiesThatExistAndAConsistentEstimate) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {  // 20 % off the CAD: the Bayes solution leaves the cone
    SyntheticArm arm(Er20(), seed);
    const codegen::Model& model = arm.model();
    const Dataset d = arm.Run(10, 200 + seed);
    const Fit fit = WeightedFit(model, {&d});
    EXPECT_FALSE(BayesIsPhysical(model, fit)) << seed;
    const PhysicalReadOut out = ReadOutPhysical(model, fit);
    EXPECT_TRUE(out.converged) << seed;
    EXPECT_TRUE(IsPhysical(out.bodies)) << seed;
    const VectorXd base = model.base_map() * out.bodies;
    EXPECT_LT((base - out.x.segment(model.front(), model.rigid())).norm(), 1e-9 * base.norm()) << seed;
    EXPECT_LT(LargestMove(fit, out), 4) << seed;  // the true arm is in the cone and within 4 sd of the fit
  }
}

TEST(ReadOutPhysical, WhereTheBayesSolutionIsPhysical_StaysNearIt) {
  codegen::Robot robot = Er20();
  robot.link_relative_sd = 0.03, robot.center_floor_m = 0.001, robot.inertia_floor_ratio = 0.003;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SyntheticArm arm(robot, seed);
    const Dataset d = arm.Run(10, 200 + seed);
    const Fit fit = WeightedFit(arm.model(), {&d});
    ASSERT_TRUE(BayesIsPhysical(arm.model(), fit)) << seed;
    // what is left: the barrier at 0.01, and a prior that is Gaussian in the centre, not in m c
    EXPECT_LT(LargestMove(fit, ReadOutPhysical(arm.model(), fit)), 0.2) << seed;
  }
}

TEST(ReadOutPhysical, DataThatPullABodyOutOfTheCone_StillGiveBodiesThatExist) {
  SyntheticArm arm(Er20(), 2);
  Dataset d = arm.Run(10, 9);
  d.tau.col(4) -= 0.05 * d.s.qdd.col(4);  // the wrist's inertia about axis 5 shrinks below what its links can have
  const Fit fit = WeightedFit(arm.model(), {&d});
  EXPECT_FALSE(BayesIsPhysical(arm.model(), fit));
  EXPECT_TRUE(IsPhysical(ReadOutPhysical(arm.model(), fit).bodies));
}

TEST(ReadOutPhysical, ARotorInertiaPulledBelowZero_StaysAboveIt) {
  SyntheticArm arm(Er20(), 2);
  Dataset d = arm.Run(10, 9);
  d.tau.col(5) -= 0.05 * d.s.qdd.col(5);  // as much as the last rotor has; the drive refuses a negative one
  const PhysicalReadOut out = ReadOutPhysical(arm.model(), WeightedFit(arm.model(), {&d}));
  EXPECT_GE(out.bodies[65], 0);
  EXPECT_TRUE(IsPhysical(out.bodies));
}

// A limit on one column is the same as holding this column at the limit, if the fit alone goes beyond it.
TEST(FitWithBarrier, WithinALimit_IsTheFitThatIsHeldThere) {
  SyntheticArm arm(Er20(), 3);
  const codegen::Model& model = arm.model();
  const Dataset d = arm.Run(10, 12);
  const Fit fit = WeightedFit(model, {&d});
  const Prior prior = MakePrior(model);
  BarrierProblem free;
  free.model = &model;
  free.bodies = BodyMean(model);
  free.bodies_sd = VectorXd::Zero(free.bodies.size());
  for (int k = 0; k < free.bodies.size(); ++k) free.bodies_sd[k] = model.table()[k].sd;
  free.x = prior.mean;
  free.x_sd = prior.covariance.diagonal().cwiseSqrt();
  free.data = [&](const VectorXd& x, bool) { return LogsAbout(fit, x); };
  const BarrierFit alone = FitWithBarrier(free);
  const int Fc2 = model.front_begin(1);
  ASSERT_EQ(model.column_name(Fc2), "Fc2");
  for (const double towards : {-1.0, 1.0}) {  // at most, at least
    const double bound = alone.x[Fc2] + towards * 8 * fit.sd[Fc2];
    BarrierProblem limited = free, held = free;
    limited.x[Fc2] = bound + towards * fit.prior_sd[Fc2];  // the prior keeps the limit
    Limit limit{-towards * bound, VectorXd::Zero(free.bodies.size()), VectorXd::Zero(free.x.size())};
    limit.x[Fc2] = towards;
    limited.limits = {limit};
    held.x[Fc2] = bound, held.x_sd[Fc2] = 0;
    const BarrierFit got = FitWithBarrier(limited), expected = FitWithBarrier(held);
    ASSERT_TRUE(got.converged && expected.converged);
    EXPECT_GT(towards * (got.x[Fc2] - bound), 0);
    EXPECT_GT((expected.x - alone.x).cwiseAbs().maxCoeff(), 0);
    for (const int c : fit.active) EXPECT_NEAR(got.x[c], expected.x[c], 0.02 * fit.sd[c]) << model.column_name(c);
  }
}

// The same of a body: link 2 heavier than a limit allows.
TEST(FitWithBarrier, ALimitOfABody_IsKept) {
  SyntheticArm arm(Er20(), 3);
  const codegen::Model& model = arm.model();
  BarrierProblem problem;
  problem.model = &model;
  problem.bodies = BodyMean(model);
  problem.bodies_sd = VectorXd::Zero(problem.bodies.size());
  for (int k = 0; k < problem.bodies.size(); ++k) problem.bodies_sd[k] = model.table()[k].sd;
  problem.x = MakePrior(model).mean, problem.x_sd = VectorXd::Zero(problem.x.size());
  const int mx2 = 12;
  const double first = problem.bodies[mx2], bound = first + 0.1 * std::abs(first);
  const VectorXd base = model.base_map().col(mx2);
  // Data that want the base parameters which hold mx2 to move far.
  problem.data = [&](const VectorXd& x, bool) {
    DataTerm term{0, VectorXd::Zero(x.size()), MatrixXd::Zero(x.size(), x.size())};
    const VectorXd aim = problem.x.segment(model.front(), model.rigid()) + 2 * std::abs(first) * base;
    term.hessian.block(model.front(), model.front(), model.rigid(), model.rigid()).setIdentity();
    term.hessian *= 1e4;
    term.gradient.segment(model.front(), model.rigid()) = 1e4 * (x.segment(model.front(), model.rigid()) - aim);
    return term;
  };
  EXPECT_GT(FitWithBarrier(problem).bodies[mx2], bound);
  Limit limit{bound, VectorXd::Zero(problem.bodies.size()), VectorXd::Zero(problem.x.size())};
  limit.bodies[mx2] = -1;
  problem.limits = {limit};
  const BarrierFit got = FitWithBarrier(problem);
  EXPECT_LT(got.bodies[mx2], bound);
  EXPECT_GT(got.bodies[mx2], bound - 0.01 * std::abs(first));
  EXPECT_TRUE(IsPhysical(got.bodies));
}

TEST(ReadOutPhysical, APriorThatCannotExist_IsRefusedByName) {
  codegen::Robot robot = Er20();
  SyntheticArm arm(robot, 1);
  const Dataset d = arm.Run(2, 1);
  robot.joint[2].link.inertia_kgm2 = {0.1, 0, 0, 0.1, 0, 0.5};  // a plate cannot have more than 0.2
  const codegen::Model model(robot, tests::Records());
  try {
    (void)ReadOutPhysical(model, WeightedFit(model, {&d}));
    FAIL() << "accepted";
  } catch (const io::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("joint[3].link"), std::string::npos) << e.what();
  }
}

TEST(ReadOutPhysical, APriorThatIsALittleBeyond_IsTheNearestThatCanExist) {
  codegen::Robot robot = Er20();
  robot.joint[2].link.center_m = {};  // then the moments about the origin are those of the file
  robot.joint[2].link.inertia_kgm2 = {0.1, 0, 0, 0.1, 0, 0.21};
  const Eigen::VectorXd mean = BodyMean(codegen::Model(robot, tests::Records())).segment(22, 11);
  EXPECT_TRUE(IsPhysical(mean)) << mean.transpose();
  for (int k = 0; k < 10; ++k) {
    const double published = k == 0  ? robot.joint[2].link.mass_kg
                             : k < 4 ? 0.0
                                     : robot.joint[2].link.inertia_kgm2[k - 4];
    EXPECT_NEAR(mean[k], published, k == 0 ? 0 : 0.011) << k;  // the moment is beyond the others' sum by 0.01
  }
}

}  // namespace
}  // namespace armcal::calibration
