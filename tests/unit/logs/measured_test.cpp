// logs tests - load the public measured logs with the shipped channel maps, if these logs are there.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdlib>
#include <filesystem>

#include "host_sim/data/logs/channels.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/data/logs/signals.hpp"

namespace armcal::logs {
namespace {

namespace fs = std::filesystem;

// ARMCAL_DATA, or the folder beside the checkout that tests/run.sh takes.
fs::path Measured() {
  const char* given = std::getenv("ARMCAL_DATA");
  return fs::path(given != nullptr ? given : "../shared/data") / "measured";
}

#define SKIP_WITHOUT(path) \
  if (!fs::exists(path)) GTEST_SKIP() << (path) << " is not there; set ARMCAL_DATA to the folder of measured logs"

TEST(Measured, Kr300_LoadsInJointCoordinates) {
  const fs::path path = Measured() / "kuka_kr300/run_A.csv.gz";
  SKIP_WITHOUT(path);
  const Log log = ReadLog(path, ReadChannelMap("host_sim/data/channels/kuka_kr300.toml"));
  EXPECT_EQ(log.joints, 6);
  EXPECT_EQ(log.samples(), 2501);
  EXPECT_NEAR(log.step_s(), 0.004, 1e-6);
  EXPECT_NEAR(log.q(0, 1), -1.5707, 1e-3);  // home: upper arm upright
  EXPECT_NEAR(log.tau(0, 0), 2.09807038 * 1798 / 7, 1e-4);
  const Derivatives d = DeriveSignals(log, {100.0 * Eigen::MatrixXd::Identity(6, 6)});
  EXPECT_LT(d.qd.cwiseAbs().maxCoeff(), 0.8);  // the data set's README: slow, up to 0.76 rad/s
}

TEST(Measured, Emps_PublishedInertiaAndFrictionExplainTheForce) {
  const fs::path path = Measured() / "emps/emps_ident.csv.gz";
  SKIP_WITHOUT(path);
  const Log log = ReadLog(path, ReadChannelMap("host_sim/data/channels/emps.toml"));
  ASSERT_EQ(log.joints, 1);
  EXPECT_EQ(log.samples(), 24841);
  EXPECT_EQ(log.ext.size(), 0);
  const Derivatives d = DeriveSignals(log, {95.0 * Eigen::MatrixXd::Identity(1, 1)});
  double error = 0, force = 0;
  for (Eigen::Index k = 500; k + 500 < log.samples(); ++k) {
    const double qd = d.qd(k, 0);
    if (std::abs(qd) < 0.01) continue;
    const double model = 95.1089 * d.qdd(k, 0) + 203.5034 * qd + (qd > 0 ? 20.3935 : -20.3935) - 3.1648;
    error += std::pow(log.tau(k, 0) - model, 2);
    force += std::pow(log.tau(k, 0), 2);
  }
  EXPECT_LT(std::sqrt(error / force), 0.06);  // the published model on its own log
}

TEST(Measured, EmpsPulses_AreACommandInsideTheForce_NotAnExternalForce) {
  const fs::path path = Measured() / "emps/emps_pulses.csv.gz";
  SKIP_WITHOUT(path);
  const Log log = ReadLog(path, ReadChannelMap("host_sim/data/channels/emps.toml"));
  ASSERT_EQ(log.tauff.cols(), 1);
  const Derivatives d = DeriveSignals(log, {95.0 * Eigen::MatrixXd::Identity(1, 1)});
  const Eigen::Index count = log.samples() - 1000;
  Eigen::MatrixXd balance(count, 5), control(count, 4);
  Eigen::VectorXd force(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index k = i + 500;
    const double qd = d.qd(k, 0), pulse = log.tauff(k, 0);
    const bool moving = std::abs(qd) > 0.01;
    force[i] = log.tau(k, 0);
    balance.row(i) << d.qdd(k, 0), qd, (qd > 0 ? 1 : -1), 1, pulse;
    if (!moving) balance.row(i).setZero();
    control.row(i) << log.qref(k - 1, 0) - log.q(k - 1, 0), qd, 1, pulse;
  }
  const auto solve = [&force](const Eigen::MatrixXd& a) {
    return Eigen::VectorXd((a.transpose() * a).ldlt().solve(a.transpose() * force));
  };
  EXPECT_NEAR(solve(balance)[4], 0.0, 0.02);  // an external force would have -1
  EXPECT_NEAR(solve(control)[3], 1.19, 0.1);  // a command has its gain
}

}  // namespace
}  // namespace armcal::logs
