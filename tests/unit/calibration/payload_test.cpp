// calibration tests - gains and loads against the plant's KDL arm, whose drives and load are known.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "host_sim/identify/calibration/payload.hpp"
#include "tests/unit/calibration/laden_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using files::test::ErrorOf;
using tests::LadenArm;

// Half the arm's rating; its centre is off the flange's axis.
const plant::Body kTen{10, {0.04, -0.03, 0.12}, {0.09, 0.004, -0.006, 0.08, 0.003, 0.05}};
// Small and compact: an estimate of its moments is mostly noise.
const plant::Body kSmall{0.8, {0.01, 0.0, 0.04}, {4e-4, 0, 0, 4e-4, 0, 3e-4}};

codegen::Payload Known(const plant::Body& b, bool all) {
  codegen::Payload p{b.mass_kg, {}, {}};
  if (all) p.center_m = b.center_m, p.inertia_kgm2 = b.inertia_kgm2;
  return p;
}

VectorXd Values(const plant::Body& b) {
  VectorXd v(10);
  v << b.mass_kg, VectorXd::Map(b.center_m.data(), 3), VectorXd::Map(b.inertia_kgm2.data(), 6);
  return v;
}

// By the definition: positive mass, principal moments about the centre positive, none above the other two's sum.
bool CanExist(const VectorXd& b) {
  Eigen::Matrix3d I;
  I << b[4], b[5], b[6], b[5], b[7], b[8], b[6], b[8], b[9];
  const Eigen::Vector3d moment = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues();
  return b[0] > 0 && moment[0] > 0 && moment[2] < moment[0] + moment[1];
}

// Errors in standard deviations over several draws.
struct Deviations {
  double worst = 0, squares = 0;
  int count = 0;
  void Add(double error, double sd) {
    worst = std::max(worst, std::abs(error / sd));
    squares += error * error / (sd * sd), ++count;
  }
  double rms() const { return std::sqrt(squares / count); }
};

constexpr int kDraws = 10;

TEST(DriveGains, OfDrivesThatAreOff_AreFoundWithinTheirDeviations) {
  for (const bool all : {false, true}) {  // the mass alone is known; or all of the payload
    Deviations deviations;
    double sd = 0;
    for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
      LadenArm arm(seed, 0.15);  // no trajectory twice
      const Dataset without = arm.Run(20, 100 + seed, {}), with = arm.Run(20, 200 + seed, kTen);
      const auto gains = FindDriveGains(arm.model(), {{&without}, {&with}}, Known(kTen, all));
      for (int j = 0; j < 6; ++j) {
        EXPECT_TRUE(gains[j].determined) << seed << ", joint " << j + 1;
        deviations.Add(gains[j].value - arm.gain(j), gains[j].sd);
        sd = std::max(sd, gains[j].sd);
      }
    }
    // 60 Gaussian errors, those of one draw correlated: as few as 20 free ones, 1 +- 3 / sqrt(40).
    EXPECT_NEAR(deviations.rms(), 1, 0.48) << all;
    EXPECT_LT(deviations.worst, 4) << all;
    EXPECT_LT(sd, 0.01) << all;  // of drives that are off by up to 0.15
  }
}

TEST(DriveGains, AreThoseOfTotalLeastSquaresByEigenvalues) {
  // Pooled noise there, each joint's own here. They part where the noise's square counts, so there is little of it.
  LadenArm arm(3, 0.1, 0.1);
  const Dataset without = arm.Run(20, 1, {}), with = arm.Run(20, 2, kTen);
  const int columns = arm.model().columns(), size = 6 + columns + 10;
  // Rows [tau_j, -Y_j, -P_j] of one joint after the other, each over its noise in true torque; the flange's pose by
  // KDL.
  MatrixXd S = MatrixXd::Zero(size, size);
  VectorXd rows(6);
  const KDL::Frame tool(KDL::Rotation::RPY(20 * M_PI / 180, -35 * M_PI / 180, 60 * M_PI / 180),
                        KDL::Vector(0.05, -0.02, 0.11));
  const KDL::RigidBodyInertia at_link =
      tool * KDL::RigidBodyInertia(10, KDL::Vector(0.04, -0.03, 0.12),
                                   KDL::RotationalInertia(0.09, 0.08, 0.05, 0.004, -0.006, 0.003));
  const auto I = at_link.getRotationalInertia();
  VectorXd load(10);
  load << 10, 10 * at_link.getCOG().x(), 10 * at_link.getCOG().y(), 10 * at_link.getCOG().z(), I.data[0], I.data[1],
      I.data[2], I.data[4], I.data[5], I.data[8];
  for (const Dataset* d : {&without, &with}) {
    std::vector<MatrixXd> Y, P;
    arm.model().Regressor(d->s, {}, {}, Y);
    arm.model().BodyColumns(d->s, 5, P);
    for (int j = 0; j < 6; ++j) {
      MatrixXd row = MatrixXd::Zero(d->samples(), size);
      row.col(j) = d->tau.col(j);
      for (const int c : MakePrior(arm.model()).active)
        if (c < columns) row.col(6 + c) = -Y[j].col(c);
      if (d == &with) row.col(size - 1) = -P[j] * load;
      row = d->used.col(j).cast<double>().asDiagonal() * row / (arm.noise_Nm(j) * arm.gain(j));
      S += row.transpose() * row;
      rows[j] = (d == &without ? 0 : rows[j]) + d->used.col(j).sum();
    }
  }
  // Exact columns are projected out; the smallest eigenvalue against the noise of the torque columns is the solution.
  const MatrixXd exact = S.bottomRightCorner(size - 6, size - 6);
  const MatrixXd solved = exact.completeOrthogonalDecomposition().solve(S.bottomLeftCorner(size - 6, 6));
  const MatrixXd left = S.topLeftCorner(6, 6) - S.topRightCorner(6, size - 6) * solved;
  for (int j = 0; j < 6; ++j) rows[j] /= arm.gain(j) * arm.gain(j);
  const VectorXd root = rows.cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(root.asDiagonal() * left * root.asDiagonal()));
  VectorXd gain = root.asDiagonal() * eigen.eigenvectors().col(0);
  gain /= -(solved * gain)[size - 7];  // the payload's own weight is one
  const auto found = FindDriveGains(arm.model(), {{&without}, {&with}}, Known(kTen, true));
  for (int j = 0; j < 6; ++j) EXPECT_NEAR(found[j].value, gain[j], 0.3 * found[j].sd) << j + 1;
}

TEST(DriveGains, OfAJointThatStandsStill_AreNotDetermined) {
  LadenArm arm(1, 0.1);
  const Dataset without = arm.Run(20, 1, {}, {0}), with = arm.Run(20, 2, kTen, {0});
  const auto gains = FindDriveGains(arm.model(), {{&without}, {&with}}, Known(kTen, false));
  for (int j = 0; j < 6; ++j) {
    EXPECT_EQ(gains[j].determined, j != 0) << j + 1;
    if (j == 0) continue;
    EXPECT_LT(std::abs(gains[j].value - arm.gain(j)), 4 * gains[j].sd) << j + 1;
  }
}

TEST(DriveGains, ByAPayloadTooLight_AreNotDetermined) {
  LadenArm arm(1, 0.1);
  const Dataset without = arm.Run(20, 1, {}), with = arm.Run(20, 2, kSmall);
  const auto gains = FindDriveGains(arm.model(), {{&without}, {&with}}, Known(kSmall, false));
  int determined = 0;
  for (int j = 0; j < 6; ++j) {
    determined += gains[j].determined;
    EXPECT_LT(std::abs(gains[j].value - arm.gain(j)), 4 * gains[j].sd) << j + 1;
  }
  EXPECT_LT(determined, 6);
}

TEST(DriveGains, AMassThatIsWrong_MovesEveryGainByAsMuch) {  // planted
  LadenArm arm(2, 0.1);
  const Dataset without = arm.Run(20, 1, {}), with = arm.Run(20, 2, kTen);
  codegen::Payload wrong = Known(kTen, false);
  wrong.mass_kg = 11;
  const auto gains = FindDriveGains(arm.model(), {{&without}, {&with}}, wrong);
  for (int j = 0; j < 6; ++j) EXPECT_NEAR(gains[j].value / arm.gain(j), 1.1, 0.03) << j + 1;
}

TEST(Load, ThatNobodyKnows_IsFoundWithinItsDeviations) {
  for (const bool cad : {true, false}) {
    Deviations deviations;
    for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
      LadenArm arm(seed, 0.03);
      codegen::Robot robot = arm.model().robot();
      robot.has_prior = cad;
      const codegen::Model model(robot, tests::Records());
      const Dataset without = arm.Run(20, 100 + seed, {}), with = arm.Run(20, 200 + seed, kTen);
      const Load load = FindLoad(model, {{&without}, {&with}});
      const VectorXd truth = Values(kTen);
      EXPECT_TRUE(CanExist(load.body));
      for (int i = 0; i < 10; ++i) {
        EXPECT_TRUE(load.determined[i]) << i;
        deviations.Add(load.body[i] - truth[i], load.sd[i]);
      }
      EXPECT_LT(load.sd[0], 0.1) << cad;  // 3 % tolerance, uniform, over six drives
    }
    EXPECT_NEAR(deviations.rms(), 1, 0.48) << cad;  // as few as 20 free ones
    EXPECT_LT(deviations.worst, 4) << cad;
  }
}

TEST(Load, WhoseLeastSquaresEstimateCannotExist_ComesOutAsABody) {
  int impossible = 0;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    LadenArm arm(seed, 0.03);
    const Dataset without = arm.Run(10, 100 + seed, {}), with = arm.Run(10, 200 + seed, kSmall);
    const Load load = FindLoad(arm.model(), {{&without}, {&with}});
    impossible += !load.was_physical;
    EXPECT_TRUE(CanExist(load.body)) << seed;
    EXPECT_LT(std::abs(load.body[0] - 0.8), 4 * load.sd[0]) << seed;
  }
  EXPECT_GT(impossible, kDraws / 2);  // or the test would show nothing
}

TEST(NearestBody, OfABodyThatExists_IsThatBody_AndOfANegativeInertiaOneOnTheEdge) {
  VectorXd estimate = ToOrigin(Values(kTen));
  const MatrixXd information = MatrixXd::Identity(10, 10) * 1e8;  // sd 1e-4 of everything
  EXPECT_LT((NearestBody(estimate, information) - estimate).cwiseAbs().maxCoeff(), 1e-5);
  estimate[7] = -0.05;  // no moment is negative
  const VectorXd nearest = NearestBody(estimate, information);
  EXPECT_TRUE(CanExist(ToCentre(nearest)));
  // The nearest point of a convex set: from there no body of the set lies in the estimate's direction. The barrier
  // leaves it off the edge by some 1e-5 of 1e-4 sd each.
  for (const plant::Body& other : {kTen, kSmall, plant::Body{12, {0.1, 0, 0.1}, {0.05, 0, 0, 0.04, 0, 0.03}}})
    EXPECT_LT((estimate - nearest).dot(ToOrigin(Values(other)) - nearest), 1e-4);
}

TEST(Payload, ThatIsNotThere_IsRefused) {
  LadenArm arm(1, 0.03);
  const Dataset a = arm.Run(20, 1, {}), b = arm.Run(20, 2, {}), laden = arm.Run(20, 3, kTen);
  const auto load = [&](const LoadLogs& logs) { return ErrorOf([&] { FindLoad(arm.model(), logs); }); };
  EXPECT_NE(load({{&a}, {&b}}).find("no load is seen"), std::string::npos) << load({{&a}, {&b}});
  EXPECT_NE(load({{&laden}, {&a}}).find("exchanged"), std::string::npos) << load({{&laden}, {&a}});
  EXPECT_NE(ErrorOf([&] {
              FindDriveGains(arm.model(), {{&a}, {&b}}, Known(kTen, true));
            }).find("no load is seen"),
            std::string::npos);
  EXPECT_EQ(load({{&a}, {&laden}}), "");
}

TEST(Payload, AtTheEndOfARobotFile_IsCarriedByModelAndPlantAlike) {
  const std::string table =
      "\n[payload]\nmass_kg = 10.0\ncenter_m = [0.04, -0.03, 0.12]\n"
      "inertia_kgm2 = [0.09, 0.004, -0.006, 0.08, 0.003, 0.05]\n";
  const std::string bare = tests::RobotWith(tests::kTool, "er20_like");
  const plant::RobotFile file = plant::ReadRobotFile(bare);
  std::vector<plant::Body> bodies;
  for (const plant::JointData& j : file.joint) bodies.push_back(j.body);
  plant::Dynamics expected(file, bodies, file.gravity_mps2, plant::AttachedBody{kTen, file.tool_frame});
  const std::string laden = tests::RobotWith(tests::kTool + table, "er20_like");
  const codegen::Robot robot = codegen::ReadRobot(laden);
  const plant::RobotFile carrying = plant::ReadRobotFile(laden);
  bodies.back() = carrying.joint.back().body;
  plant::Dynamics carried(file, bodies, file.gravity_mps2);
  std::srand(1);
  for (int k = 0; k < 5; ++k) {
    codegen::Signals s;
    s.q = MatrixXd::Random(1, 6), s.qd = MatrixXd::Random(1, 6), s.qdd = 5 * MatrixXd::Random(1, 6);
    const VectorXd tau = expected.Torque(s.q.row(0), s.qd.row(0), s.qdd.row(0));
    EXPECT_LT((carried.Torque(s.q.row(0), s.qd.row(0), s.qdd.row(0)) - tau).norm(), 1e-9 * tau.norm());
    const codegen::Model model(robot, tests::Records());
    std::vector<MatrixXd> row;
    model.Regressor(s, {}, {}, row);
    for (int j = 0; j < 6; ++j) {
      const double rotor = BodyMean(model)[11 * j + 10] * s.qdd(0, j);  // KDL's chain has none
      const double base = row[j].middleCols(model.front(), model.rigid()).row(0) * (model.base_map() * BodyMean(model));
      EXPECT_NEAR(base - rotor, tau[j], 1e-8 * tau.norm()) << j + 1;
    }
  }
}

TEST(Payload, FileThatIsIncomplete_IsRefusedNamingTheKey) {
  const auto error = [](const std::string& text, bool as_robot) {
    return ErrorOf([&] {
      if (as_robot) {
        codegen::ReadRobot(tests::RobotWith(text, "er20_like"));
      } else {
        const files::test::TemporaryFolder folder;
        codegen::ReadPayload(folder.Write("payload.toml", text));
      }
    });
  };
  EXPECT_EQ(error("[payload]\nmass_kg = 5\n", false), "");
  EXPECT_NE(error("[payload]\ncenter_m = [0.0, 0.0, 0.1]\n", false).find("payload.mass_kg"), std::string::npos);
  EXPECT_NE(error("[payload]\nmass_kg = -5\n", false).find("above zero"), std::string::npos);
  EXPECT_NE(error("[payload]\nmass_kg = 5\ninertia_kgm2 = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0]\n", false).find("center_m"),
            std::string::npos);
  EXPECT_NE(error("\n[payload]\nmass_kg = 5\n", true).find("inertia_kgm2"), std::string::npos);
}

}  // namespace
}  // namespace armcal::calibration
