// trajectory tests - compare the spline with closed forms, and damage its file.
#include "host_sim/data/trajectory/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::trajectory {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Trajectory Random(int points, int joints) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  return {0.004, MatrixXd::NullaryExpr(points, joints, [&] { return unit(random); })};
}

TEST(TrajectorySpline, ThroughPointsOfACubicAtRestAtBothEnds_IsThatCubic) {
  Trajectory trajectory{0.1, MatrixXd(21, 2)};
  const double T = trajectory.duration_s();
  const auto q = [&](double t) { return 3 * t * t / (T * T) - 2 * t * t * t / (T * T * T); };
  for (int k = 0; k < 21; ++k) trajectory.q.row(k) << q(0.1 * k), -5 * q(0.1 * k) + 1;
  const TrajectorySpline spline(trajectory);
  for (double t = 0; t <= T; t += 0.0137) {
    EXPECT_NEAR(spline.Position(t)[0], q(t), 1e-14);
    EXPECT_NEAR(spline.Position(t)[1], 1 - 5 * q(t), 1e-14);
    EXPECT_NEAR(spline.Speed(t)[0], 6 * t / (T * T) - 6 * t * t / (T * T * T), 1e-13);
    EXPECT_NEAR(spline.Acceleration(t)[0], 6 / (T * T) - 12 * t / (T * T * T), 1e-11);  // round-off times 1 / step^2
  }
}

TEST(TrajectorySpline, ThroughAnyPoints_MeetsThemAndIsTwiceContinuous) {
  const Trajectory trajectory = Random(200, 3);
  const TrajectorySpline spline(trajectory);
  const double h = trajectory.step_s;
  // Speeds are of order 1 / h, accelerations of order 10 / h^2; a side step of 1e-9 h changes them by 1e-8 of that.
  const double side = 1e-9 * h;
  for (int k = 1; k < 199; ++k) {
    const double t = k * h;
    EXPECT_LT((spline.Position(t).transpose() - trajectory.q.row(k)).norm(), 1e-9);
    EXPECT_LT((spline.Speed(t + side) - spline.Speed(t - side)).norm() * h, 1e-6);
    EXPECT_LT((spline.Acceleration(t + side) - spline.Acceleration(t - side)).norm() * h * h, 1e-5);
  }
}

TEST(TrajectorySpline, SpeedAndAcceleration_AreTheDerivativesOfPosition) {
  const Trajectory trajectory = Random(50, 2);
  const TrajectorySpline spline(trajectory);
  const double d = 1e-3 * trajectory.step_s, h = trajectory.step_s;
  for (double t = 0.3 * h; t < trajectory.duration_s() - h; t += 0.77 * h) {
    const VectorXd speed = (spline.Position(t + d) - spline.Position(t - d)) / (2 * d);
    const VectorXd acceleration = (spline.Speed(t + d) - spline.Speed(t - d)) / (2 * d);
    EXPECT_LT((speed - spline.Speed(t)).norm() * h, 1e-4);
    EXPECT_LT((acceleration - spline.Acceleration(t)).norm() * h * h, 2e-2);  // the interval may hold a knot: |jerk| d
  }
}

TEST(TrajectorySpline, AtAndBeyondTheEnds_IsAtRest) {
  const Trajectory trajectory = Random(30, 2);
  const TrajectorySpline spline(trajectory);
  EXPECT_LT(spline.Speed(0).norm(), 1e-12);
  EXPECT_LT(spline.Speed(trajectory.duration_s()).norm(), 1e-12);
  for (const double t : {-1.0, trajectory.duration_s() + 1}) {
    EXPECT_EQ(spline.Speed(t).norm(), 0);
    EXPECT_EQ(spline.Acceleration(t).norm(), 0);
  }
  EXPECT_TRUE(spline.Position(-1).isApprox(trajectory.q.row(0).transpose()));
  EXPECT_TRUE(spline.Position(9).isApprox(trajectory.q.row(29).transpose()));
}

TEST(TrajectoryFile, WrittenAndRead_IsTheSame) {
  const files::test::TemporaryFolder folder;
  const Trajectory written = Random(1000, 6);
  for (const char* name : {"a.csv", "a.csv.gz"}) {
    WriteTrajectory(folder / name, written);
    const Trajectory read = ReadTrajectory(folder / name, 6);
    EXPECT_NEAR(read.step_s, written.step_s, 1e-12);
    EXPECT_LT((read.q - written.q).cwiseAbs().maxCoeff(), 1e-12);  // 13 digits
  }
}

std::string Rows(int rows, const std::string& header = "t,q1,q2") {
  std::string text = header + "\n";
  for (int k = 0; k < rows; ++k) text += std::to_string(0.01 * k) + ",0.5,-0.5\n";
  return text;
}

class BadTrajectory : public testing::Test {
 protected:
  std::string ErrorOf(const std::string& text, int joints = 2) {
    const auto path = folder_.Write("x.csv", text);
    return files::test::ErrorOf([&] { ReadTrajectory(path, joints); });
  }
  files::test::TemporaryFolder folder_;
};

TEST_F(BadTrajectory, OfNoFault_IsRead) { EXPECT_EQ(ErrorOf(Rows(20)), ""); }

TEST_F(BadTrajectory, WithOtherColumns_IsRefusedNamingThem) {
  EXPECT_NE(ErrorOf(Rows(20), 3).find("x.csv:1: expected the columns t,q1..q3"), std::string::npos);
  EXPECT_NE(ErrorOf(Rows(20), 1).find("expected the columns t,q1"), std::string::npos);
  EXPECT_NE(ErrorOf(Rows(20, "t,q2,q1")), "");
}

TEST_F(BadTrajectory, WithFewRows_IsRefusedWithTheNumberExpected) {
  EXPECT_NE(ErrorOf(Rows(9)).find("9 rows, expected 10"), std::string::npos);
  EXPECT_EQ(ErrorOf(Rows(10)), "");
}

TEST_F(BadTrajectory, WithANumberThatIsNotFinite_IsRefusedWithLineAndColumn) {
  EXPECT_NE(ErrorOf(Rows(12) + "0.12,nan,1\n").find("x.csv:14: column 'q1'"), std::string::npos);
}

TEST_F(BadTrajectory, WithAGapInTime_IsRefusedWithTheLine) {
  EXPECT_NE(ErrorOf(Rows(100) + "1.01,0.5,-0.5\n").find("equal steps"), std::string::npos);
  EXPECT_NE(ErrorOf(Rows(12) + "0.11,0.5,-0.5\n").find("equal steps"), std::string::npos);
}

TEST_F(BadTrajectory, WhereTimeStandsStillOrRunsBack_IsRefused) {
  std::string still = "t,q1,q2\n", back = still;
  for (int k = 0; k < 20; ++k) still += "0,0,0\n", back += std::to_string(-0.01 * k) + ",0,0\n";
  EXPECT_NE(ErrorOf(still).find("equal steps"), std::string::npos);
  EXPECT_NE(ErrorOf(back).find("equal steps"), std::string::npos);
}

TEST_F(BadTrajectory, ThatIsNotThere_IsRefused) {
  EXPECT_NE(files::test::ErrorOf([&] { ReadTrajectory(folder_ / "none.csv", 2); }), "");
}

}  // namespace
}  // namespace armcal::trajectory
