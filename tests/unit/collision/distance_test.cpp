// collision tests - distances against alternating projections, which need no more than the nearest point of one solid.
#include "host_sim/identify/collision/distance.hpp"

#include <gtest/gtest.h>

#include <random>

namespace armcal::collision {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

struct Known {
  const char* name;
  SolidPtr solid;
  std::function<Vector3d(const Vector3d&)> nearest;  // the solid's point that is nearest to a point
};

Vector3d OnBox(const Vector3d& p, const Vector3d& half) { return p.cwiseMax(-half).cwiseMin(half); }

Vector3d OnBall(const Vector3d& p, const Vector3d& middle, double radius) {
  const Vector3d from = p - middle;
  return from.norm() <= radius ? p : Vector3d(middle + radius * from.normalized());
}

std::vector<Known> Kinds() {
  const Vector3d half(0.1, 0.25, 0.06);
  std::vector<Vector3d> corners;
  for (int k = 0; k < 8; ++k)
    corners.push_back(half.cwiseProduct(Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int k = 0; k < 60; ++k) corners.push_back(half.cwiseProduct(Vector3d(unit(random), unit(random), unit(random))));
  return {{"box", Box(2 * half), [half](const Vector3d& p) { return OnBox(p, half); }},
          {"sphere", Sphere(0.12), [](const Vector3d& p) { return OnBall(p, Vector3d::Zero(), 0.12); }},
          {"cylinder", Cylinder(0.07, 0.3),
           [](const Vector3d& p) {
             const double out = p.head<2>().norm(), shrink = out > 0.07 ? 0.07 / out : 1;
             return Vector3d(shrink * p.x(), shrink * p.y(), std::clamp(p.z(), -0.15, 0.15));
           }},
          {"capsule", Capsule(0.05, 0.4),
           [](const Vector3d& p) { return OnBall(p, Vector3d(0, 0, std::clamp(p.z(), -0.2, 0.2)), 0.05); }},
          {"polyhedron", Polyhedron(ConvexHull(corners)), [half](const Vector3d& p) { return OnBox(p, half); }}};
}

Isometry3d RandomPose(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Isometry3d T = Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond(unit(random), unit(random), unit(random), unit(random)).normalized().matrix();
  T.translation() = 0.6 * Vector3d(unit(random), unit(random), unit(random));
  return T;
}

// Cheney and Goldstein 1959: the points that are projected to and fro end at two nearest ones.
double Alternating(const Known& a, const Isometry3d& pose_a, const Known& b, const Isometry3d& pose_b) {
  Vector3d on_a = pose_a.translation(), on_b = pose_b.translation();
  for (int k = 0; k < 3000; ++k) {
    on_b = pose_b * b.nearest(pose_b.inverse() * on_a);
    on_a = pose_a * a.nearest(pose_a.inverse() * on_b);
  }
  return (on_a - on_b).norm();
}

TEST(Between, SolidsOfEveryTwoKinds_IsWhatAlternatingProjectionsEndWith) {
  if (!CanMeasure()) GTEST_SKIP() << "built without FCL";
  const std::vector<Known> kinds = Kinds();
  std::mt19937_64 random(1);
  int apart = 0, together = 0;
  for (const Known& a : kinds)
    for (const Known& b : kinds)
      for (int k = 0; k < 12; ++k) {
        const Isometry3d pose_a = RandomPose(random), pose_b = RandomPose(random);
        const double expected = Alternating(a, pose_a, b, pose_b);
        const Gap gap = Between(*a.solid, pose_a, *b.solid, pose_b);
        if (expected < 1e-3) {  // they overlap, or the projections are not there yet
          EXPECT_LE(gap.distance, expected) << a.name << " and " << b.name;
          ++together;
          continue;
        }
        ++apart;
        EXPECT_NEAR(gap.distance, expected, 1e-4) << a.name << " and " << b.name;
        EXPECT_NEAR((gap.on_a - gap.on_b).norm(), gap.distance, 1e-5) << a.name << " and " << b.name;
        const Vector3d in_a = pose_a.inverse() * gap.on_a, in_b = pose_b.inverse() * gap.on_b;
        EXPECT_LT((a.nearest(in_a) - in_a).norm(), 1e-5) << a.name << " before " << b.name;
        EXPECT_LT((b.nearest(in_b) - in_b).norm(), 1e-5) << b.name << " behind " << a.name;
      }
  EXPECT_GT(apart, 150);
  EXPECT_GT(together, 5);
}

}  // namespace
}  // namespace armcal::collision
