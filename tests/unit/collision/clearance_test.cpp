// collision tests - a flat arm of three capsules, whose distances this file computes by school geometry.
#include "host_sim/identify/collision/clearance.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::collision {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using files::test::ErrorOf;
using files::test::TemporaryFolder;

constexpr double kLength = 0.5, kRadius = 0.04, kWall = 1.5;

// Three links in the x-y plane; the base is a post beside the first axis.
codegen::Robot FlatArm() {
  codegen::Robot robot;
  robot.path = "flat.toml";
  for (int j = 0; j < 3; ++j) {
    codegen::Joint joint;
    joint.name = "j" + std::to_string(j + 1);
    joint.kinematics.a_m = j == 0 ? 0 : kLength;
    joint.position_limit_rad = {-3, 3};
    robot.joint.push_back(joint);
    codegen::Shape shape;
    shape.kind = codegen::Shape::Kind::kCapsule;
    shape.link = "l" + std::to_string(j + 1), shape.body = j + 1;
    shape.size_m = {kRadius, kLength};
    shape.xyz_m = {kLength / 2, 0, 0};
    shape.rotation = {0, 0, 1, 0, 1, 0, -1, 0, 0};  // z of the capsule along x
    robot.shape.push_back(shape);
  }
  codegen::Shape post;
  post.kind = codegen::Shape::Kind::kSphere;
  post.link = "post", post.size_m = {0.1}, post.xyz_m = {0, -0.4, 0}, post.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  robot.shape.push_back(post);
  return robot;
}

double ToSegment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + along * (b - a) - p).norm();
}

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double SegmentToSegment(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const bool cross = Cross(b - a, c - a) * Cross(b - a, d - a) < 0 && Cross(d - c, a - c) * Cross(d - c, b - c) < 0;
  return cross ? 0 : std::min({ToSegment(a, c, d), ToSegment(b, c, d), ToSegment(c, a, b), ToSegment(d, a, b)});
}

// The smallest distance of the pairs that are checked: post with 2 and 3, 1 with 3, and a wall at x = wall with all.
double Expected(const VectorXd& q, double wall) {
  Vector2d joint[4] = {Vector2d::Zero()};
  double angle = 0, farthest = -1e9;
  for (int j = 0; j < 3; ++j) {
    angle += q[j];
    joint[j + 1] = joint[j] + kLength * Vector2d(std::cos(angle), std::sin(angle));
    farthest = std::max({farthest, joint[j].x(), joint[j + 1].x()});
  }
  const Vector2d post(0, -0.4);
  return std::max(0.0, std::min({ToSegment(post, joint[1], joint[2]) - 0.1 - kRadius,
                                 ToSegment(post, joint[2], joint[3]) - 0.1 - kRadius,
                                 SegmentToSegment(joint[0], joint[1], joint[2], joint[3]) - 2 * kRadius,
                                 wall - farthest - kRadius}));
}

MatrixXd Motion(int seed, double size) {
  std::mt19937_64 random(static_cast<std::uint64_t>(seed));
  std::uniform_real_distribution<double> unit(-1, 1);
  MatrixXd q(400, 3);
  for (int j = 0; j < 3; ++j) {
    const double offset = unit(random), a = unit(random), b = unit(random);
    for (int k = 0; k < q.rows(); ++k) q(k, j) = size * (offset + a * std::sin(0.05 * k) + b * std::cos(0.13 * k));
  }
  return q;
}

class FlatArmTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!CanMeasure()) GTEST_SKIP() << "built without FCL";
    cell_.plane.push_back({"wall", Vector3d(-1, 0, 0), -kWall});
  }
  Cell cell_;
};

TEST_F(FlatArmTest, SmallestDistanceOfAMotion_IsThatOfEverySampleAndPair) {
  const Clearance clearance(FlatArm(), cell_, 0.02);
  EXPECT_EQ(clearance.pairs(), 6U);
  int free = 0;
  for (int seed = 1; seed <= 60; ++seed) {
    const MatrixXd q = Motion(seed, 0.5);
    double expected = INFINITY;
    for (int k = 0; k < q.rows(); ++k) expected = std::min(expected, Expected(q.row(k), kWall));
    const Nearest nearest = clearance.Smallest(q);
    EXPECT_NEAR(nearest.distance_m, expected, 1e-6) << seed;
    EXPECT_NEAR(Expected(q.row(nearest.sample), kWall), expected, 1e-6) << seed;
    EXPECT_EQ(clearance.Keeps(q), expected > 0.0205) << seed;
    free += expected > 0.0205;
  }
  EXPECT_GT(free, 5);
  EXPECT_LT(free, 55);
}

TEST_F(FlatArmTest, PenaltysDerivative_IsItsDifferenceQuotient) {
  const Clearance clearance(FlatArm(), cell_, 0.1);
  MatrixXd unused = MatrixXd::Zero(1, 3);
  int taking_part = 0;
  for (int seed = 1; seed <= 30; ++seed) {
    const MatrixXd all = Motion(seed, 0.6);
    for (int k = 0; k < all.rows(); k += 40) {
      const MatrixXd q = all.row(k);
      const double distance = Expected(q.row(0), kWall);
      if (distance < 0.01) continue;  // the value jumps where solids touch
      MatrixXd d_q = MatrixXd::Zero(1, 3);
      const double value = clearance.Penalty(q, 2, d_q);
      taking_part += value > 0;
      EXPECT_EQ(value > 0, distance < 0.105) << seed << " " << k;
      for (int j = 0; j < 3; ++j) {
        MatrixXd up = q, down = q;
        up(0, j) += 1e-5, down(0, j) -= 1e-5;
        const double quotient = (clearance.Penalty(up, 1, unused) - clearance.Penalty(down, 1, unused)) / 2e-5;
        EXPECT_NEAR(d_q(0, j), 2 * quotient, 1e-3) << seed << " " << k;
      }
    }
  }
  EXPECT_GT(taking_part, 20);
}

TEST_F(FlatArmTest, PairsThatAreNeverChecked_AreListed) {
  codegen::Robot robot = FlatArm();
  robot.joint[1].position_limit_rad = {-0.1, 0.1};
  robot.shape[2].size_m = {0.8, 0.1};  // a ball on the third link that is never away from the first
  const Clearance clearance(robot, {}, 0.02);
  std::vector<std::string> found;
  for (const Unchecked& u : clearance.unchecked()) found.push_back(u.a + " " + u.b + ": " + u.why);
  const std::string near = ": near in every pose that was tried", beside = ": neighbours";
  EXPECT_EQ(found, (std::vector<std::string>{"l1 l2" + beside, "post l1" + beside, "l2 l3" + beside, "l1 l3" + near}));
  robot.shape.erase(robot.shape.begin() + 1);
  EXPECT_EQ(Clearance(robot, {}, 0.02).shapeless(), (std::vector<std::string>{"j2"}));
}

TEST(WhyUncheckable, SaysWhatIsMissing) {
  if (!CanMeasure()) GTEST_SKIP() << "built without FCL";
  codegen::Robot robot = FlatArm();
  EXPECT_EQ(WhyUncheckable(robot), "");
  robot.shape[0].kind = codegen::Shape::Kind::kMesh, robot.shape[0].mesh = "package://arm/l1.stl";
  EXPECT_NE(WhyUncheckable(robot).find("package://arm/l1.stl"), std::string::npos);
  robot.shape.clear();
  EXPECT_NE(WhyUncheckable(robot).find("[[capsule]]"), std::string::npos);
}

TEST(MeshFaults, NameMeshesInMillimetres_AndThoseThatCannotBeRead) {
  if (!CanMeasure()) GTEST_SKIP() << "built without FCL or Assimp";
  const TemporaryFolder folder;
  codegen::Robot robot = FlatArm();
  EXPECT_EQ(MeshFaults(robot), std::vector<std::string>());
  codegen::Shape& mesh = robot.shape[0];
  mesh.kind = codegen::Shape::Kind::kMesh, mesh.size_m = {1, 1, 1};
  mesh.file = folder.Write("mm.obj", "v 0 0 0\nv 120 0 0\nv 0 80 0\nv 0 0 300\n");
  const std::vector<std::string> faults = MeshFaults(robot);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].find("millimetres"), std::string::npos) << faults[0];
  const auto refused = [&robot] { return ErrorOf([&robot] { Clearance(robot, {}, 0.02); }); };
  EXPECT_EQ(refused(), faults[0]);
  mesh.size_m = {1e-3, 1e-3, 1e-3};
  EXPECT_EQ(MeshFaults(robot), std::vector<std::string>());
  mesh.file = folder.Write("m.dae", "<COLLADA/>");
  EXPECT_NE(MeshFaults(robot).at(0).find("[[capsule]]"), std::string::npos);
  robot.shape[0].kind = codegen::Shape::Kind::kBox, robot.shape[0].size_m = {100, 200, 50};
  EXPECT_NE(refused().find("millimetres"), std::string::npos) << refused();
}

TEST(ReadCell, SaysAllFaultsAtOnce) {
  const TemporaryFolder folder;
  const std::string error = ErrorOf([&] {
    ReadCell(folder.Write("cell.toml",
                          "[[box]]\nname = \"table\"\ncenter_m = [0, 0, 0]\nsize_m = [1, 0, 1]\n"
                          "[[plane]]\nname = \"floor\"\npoint_m = [0, 0]\nnormal = [0, 0, 0]\n[[wall]]\n"));
  });
  for (const char* part : {"box[1].size_m", "plane[1].point_m", "plane[1].normal", "wall"})
    EXPECT_NE(error.find(part), std::string::npos) << error;
  EXPECT_NE(ErrorOf([&] { ReadCell(folder.Write("empty.toml", "")); }).find("[[box]]"), std::string::npos);
  const Cell cell =
      ReadCell(folder.Write("good.toml",
                            "[[box]]\nname = \"a\"\ncenter_m = [1, 2, 3]\nsize_m = [1, 1, 1]\nrpy_deg = [0, 0, 90]\n"
                            "[[plane]]\nname = \"b\"\npoint_m = [5, 5, 0.5]\nnormal = [0, 0, 2]\n"));
  EXPECT_LT((cell.box[0].pose * Vector3d::UnitX() - Vector3d(1, 3, 3)).norm(), 1e-12);
  EXPECT_NEAR(cell.plane[0].offset, 0.5, 1e-12);
}

}  // namespace
}  // namespace armcal::collision
