// excitation tests - a motion with a clearance, judged by frames and distances that this file computes by hand.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/analysis/excited.hpp"
#include "host_sim/identify/excitation/compose.hpp"
#include "host_sim/identify/excitation/optimise.hpp"
#include "tests/unit/excitation/arms.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::excitation {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

struct Rod {
  int link;
  Vector3d from, to;
  double radius;
};
const std::vector<Rod> kRods = {{0, {0, 0, 0.15}, {0, 0, 0.3}, 0.2},  {1, {0, 0, -0.05}, {0.17, 0, 0}, 0.18},
                                {2, {0, 0, 0}, {0.78, 0, 0}, 0.1},    {3, {0.14, -0.1, 0}, {0.14, 0.5, 0}, 0.11},
                                {4, {0, 0, -0.15}, {0, 0, 0}, 0.08},  {5, {0, 0, 0}, {0, 0, 0}, 0.07},
                                {6, {0, 0, -0.04}, {0, 0, 0.1}, 0.05}};
constexpr double kTableTop = 0.7, kTableEdge = 1.0, kMargin = 0.03;

codegen::Robot WithRods(const files::test::TemporaryFolder& folder) {
  std::string text = files::test::ReadBytes("codegen/robots/er20_like.toml");
  const auto list = [](const Vector3d& v) {
    return "[" + std::to_string(v.x()) + ", " + std::to_string(v.y()) + ", " + std::to_string(v.z()) + "]";
  };
  for (const Rod& rod : kRods)
    text += "\n[[capsule]]\nlink = " + std::to_string(rod.link) + "\nfrom_m = " + list(rod.from) +
            "\nto_m = " + list(rod.to) + "\nradius_m = " + std::to_string(rod.radius) + "\n";
  return codegen::ReadRobot(folder.Write("rods.toml", text));
}

// A table in front of the arm, and a floor.
collision::Cell TableAndFloor() {
  collision::Cell cell;
  collision::CellBox table;
  table.name = "table";
  table.size = {1, 4, 1}, table.pose.translation() = Vector3d(kTableEdge + 0.5, 0, kTableTop - 0.5);
  cell.box.push_back(table);
  cell.plane.push_back({"floor", Vector3d::UnitZ(), 0});
  return cell;
}

// Ends of all rods in the base frame, by Craig's matrix as the books print it.
std::vector<std::array<Vector3d, 2>> RodsAt(const codegen::Robot& robot, const VectorXd& q) {
  std::vector<Eigen::Matrix4d> frame{Eigen::Matrix4d::Identity()};
  for (int j = 0; j < 6; ++j) {
    const codegen::JointKinematics& k = robot.joint[j].kinematics;
    const double ct = std::cos(k.theta_rad + q[j]), st = std::sin(k.theta_rad + q[j]), ca = std::cos(k.alpha_rad),
                 sa = std::sin(k.alpha_rad);
    Eigen::Matrix4d T;
    T << ct, -st, 0, k.a_m, st * ca, ct * ca, -sa, -sa * k.d_m, st * sa, ct * sa, ca, ca * k.d_m, 0, 0, 0, 1;
    frame.push_back(frame.back() * T);
  }
  std::vector<std::array<Vector3d, 2>> rods;
  for (const Rod& rod : kRods) {
    const Eigen::Matrix4d& T = frame[static_cast<std::size_t>(rod.link)];
    rods.push_back({(T * rod.from.homogeneous()).head<3>(), (T * rod.to.homogeneous()).head<3>()});
  }
  return rods;
}

// Two segments: the distance of a point of one from the other is convex along it.
template <class Distance>
double LeastAlong(const Vector3d& from, const Vector3d& to, Distance distance) {
  double low = 0, high = 1;
  for (int k = 0; k < 60; ++k) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    if (distance(from + a * (to - from)) < distance(from + b * (to - from))) high = b;
    else low = a;
  }
  return distance(from + (low + high) / 2 * (to - from));
}

double PointToSegment(const Vector3d& p, const Vector3d& from, const Vector3d& to) {
  const Vector3d along = to - from;
  const double size = along.squaredNorm();
  return (from + (size > 0 ? std::clamp((p - from).dot(along) / size, 0.0, 1.0) : 0) * along - p).norm();
}

double PointToTable(const Vector3d& p) {
  return Vector3d(std::max({kTableEdge - p.x(), p.x() - kTableEdge - 1, 0.0}), std::max(std::abs(p.y()) - 2, 0.0),
                  std::max({p.z() - kTableTop, kTableTop - 1 - p.z(), 0.0}))
      .norm();
}

// Of all pairs but neighbours, and but base - link 2 and link 4 - link 6, which are always near.
double LeastDistance(const codegen::Robot& robot, const VectorXd& q) {
  const auto rods = RodsAt(robot, q);
  double least = INFINITY;
  for (std::size_t b = 1; b < rods.size(); ++b) {
    const auto& [from, to] = rods[b];
    const double radius = kRods[b].radius;
    least = std::min({least, LeastAlong(from, to, PointToTable) - radius, std::min(from.z(), to.z()) - radius});
    for (std::size_t a = 0; a + 1 < b; ++a) {
      if ((a == 0 && b == 2) || (a == 4 && b == 6)) continue;
      const auto distance = [&, &other = rods[a]](const Vector3d& p) { return PointToSegment(p, other[0], other[1]); };
      least = std::min(least, LeastAlong(from, to, distance) - radius - kRods[a].radius);
    }
  }
  return least;
}

// FCL and Assimp are optional; without them no distance can be measured.
class WithDistances : public testing::Test {
 protected:
  void SetUp() override {
    if (!collision::CanMeasure()) GTEST_SKIP() << "built without FCL or Assimp";
  }
  const files::test::TemporaryFolder folder_;
};

class WithClearance : public WithDistances {
 protected:
  const codegen::Model model_ = test::Arm(WithRods(folder_));
  const Observation observation_{model_};
};

TEST_F(WithClearance, WholeTrajectory_KeepsTheDistanceOnTheCheckGrid_AsReported) {
  const collision::Clearance clearance(model_.robot(), TableAndFloor(), kMargin);
  EXPECT_EQ(clearance.unchecked().size(), 8U);
  OptimiseSettings settings;
  settings.starts = 4, settings.seconds = 1e6;
  const Optimum free = Optimise(observation_, settings);
  settings.clearance = &clearance;
  const Optimum best = Optimise(observation_, settings);
  const auto least = [&](const Composed& composed) {
    const codegen::Signals s = Sampled(trajectory::TrajectorySpline(composed.trajectory));
    double distance = INFINITY;
    for (Eigen::Index k = 0; k < s.q.rows(); k += 5)
      distance = std::min(distance, LeastDistance(model_.robot(), s.q.row(k)));
    return distance;
  };
  ComposeSettings compose;
  compose.periods = 1, compose.slow_speeds = 2;
  EXPECT_LT(least(Compose(observation_, free.series, compose)), 0) << "without a clearance nothing should keep it off";
  compose.clearance = &clearance;
  const Composed composed = Compose(observation_, best.series, compose);
  EXPECT_GE(least(composed), kMargin);
  EXPECT_NEAR(least(composed), composed.nearest.distance_m, 2e-3);  // of every fifth sample, and of all
  EXPECT_LT(best.figure, 2 * free.figure);
}

TEST_F(WithClearance, Gradient_IsTheDifferenceQuotientOfTheValue) {
  const collision::Clearance clearance(model_.robot(), TableAndFloor(), kMargin);
  Objective objective(observation_, {}, {}, {0.9, &clearance}), without(observation_, {}, {}, 0.9);
  // Small motions about a pose near the table: the penalty takes part, and no solids touch.
  VectorXd u = 0.02 * VectorXd::LinSpaced(objective.size(), 0.1, 20).array().sin(), gradient, unused;
  const auto offset = [&](int joint) -> double& { return u[11 * joint + 10]; };
  offset(0) = 0, offset(1) = 0.8, offset(2) = 0.1, offset(3) = 0, offset(4) = 0.2, offset(5) = 0;
  bool found = false;
  for (double lean = 0; lean < 2 && !found; lean += 0.01) {
    offset(1) = lean;
    const codegen::Signals s = objective.Series(u).At(test::OnePeriod(400));
    double least = INFINITY;
    for (Eigen::Index k = 0; k < s.q.rows(); k += 4) least = std::min(least, LeastDistance(model_.robot(), s.q.row(k)));
    found = least > 0.005 && least < 0.02;
  }
  ASSERT_TRUE(found);
  EXPECT_GT(objective(u, gradient), without(u, unused) + 1e-3);
  for (int k = 0; k < u.size(); k += 5) {
    const VectorXd shift = 1e-6 * VectorXd::Unit(u.size(), k);
    const double quotient = (objective(u + shift, unused) - objective(u - shift, unused)) / 2e-6;
    EXPECT_NEAR(gradient[k], quotient, 1e-3 * gradient.norm()) << k;
  }
}

// The forearm's ball is 20.6 mm off the base's where the elbow is straight, and nearer with every degree of bend.
codegen::Robot ThatBendsTowardsItsBase(const files::test::TemporaryFolder& folder) {
  std::string text = files::test::ReadBytes("codegen/robots/two_link.toml");
  text +=
      "\n[[capsule]]\nlink = 0\nfrom_m = [0, 0, 0]\nto_m = [0, 0, 0]\nradius_m = 0.25\n"
      "[[capsule]]\nlink = 2\nfrom_m = [0.02, 0, 0]\nto_m = [0.02, 0, 0]\nradius_m = 0.2494\n";
  return codegen::ReadRobot(folder.Write("bends.toml", text));
}

TEST_F(WithDistances, WithoutRoomForTheDefaultOne_ExciteKeepsASmallerOneAndSaysSo) {
  const codegen::Model model = test::Arm(ThatBendsTowardsItsBase(folder_));
  analysis::ExciteOptions options;
  options.starts = 2, options.periods = 1;
  const analysis::Excited found(model, options);
  EXPECT_EQ(found.too_far_m, std::vector<double>{0.02});
  EXPECT_DOUBLE_EQ(found.clearance->margin_m(), 0.01);
  const codegen::Signals motion = found.Motion();
  // The elbow lies 0.5 m off the shoulder's axis; the law of cosines gives the distance of the two balls.
  const Eigen::ArrayXd distance = (0.25 + 0.0004 + 0.02 * motion.q.col(1).array().cos()).sqrt() - 0.4994;
  EXPECT_GE(distance.minCoeff(), 0.01);
  EXPECT_LT(distance.minCoeff(), 0.02);
  options.clearance_asked = true;
  EXPECT_THROW(analysis::Excited(model, options), io::InputError);
}

}  // namespace
}  // namespace armcal::excitation
