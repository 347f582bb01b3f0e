// collision - measures only pairs that can have come near since they were measured last.
#include "host_sim/identify/collision/clearance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <random>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/watch.hpp"
#include "codegen/src/robot/body.hpp"
#include "codegen/src/robot/frames.hpp"
#include "host_sim/identify/collision/mesh.hpp"

namespace armcal::collision {
namespace {

using codegen::Shape;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kPoses = 1000;          // tried for pairs that are always near
constexpr double kGuard_m = 0.0005;   // beyond the margin: for what lies between the samples that are looked at
constexpr double kKeepOff_m = 0.005;  // beyond the margin: where a search begins to keep off
constexpr double kSoft_m = 0.1;
constexpr Eigen::Index kUnwatched = 64;  // samples between two looks of a watch

Vector3d Size(const Shape& shape) { return Vector3d(shape.size_m.data()); }

// Corners of a box, in its own axes.
std::vector<Vector3d> BoxCorners(const Vector3d& size) {
  std::vector<Vector3d> corners;
  for (int k = 0; k < 8; ++k)
    corners.push_back(size.cwiseProduct(Vector3d(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5)));
  return corners;
}

Hull MeshHull(const Shape& shape) {
  std::vector<Vector3d> points = ReadMesh(shape.file);
  for (Vector3d& p : points) p = p.cwiseProduct(Size(shape));
  Hull hull = ConvexHull(points);
  if (hull.face.empty())
    throw io::InputError(shape.file.string() + ": link \"" + shape.link + "\": expected a mesh that has a volume");
  return hull;
}

// A mesh of a link that is in millimetres, or another shape that was meant so.
void RequireMetres(const Shape& shape, double radius_m) {
  if (2 * radius_m <= codegen::kLongest) return;
  char length[32];
  std::snprintf(length, sizeof length, "%.3g", 2 * radius_m);
  const bool mesh = shape.kind == Shape::Kind::kMesh;
  throw io::InputError((mesh ? shape.file.string() + ": " : "") + "link \"" + shape.link +
                       "\": expected a collision shape in metres, this one is " + length + " m long (millimetres?" +
                       (mesh ? " then <mesh scale=\"0.001 0.001 0.001\"> in the URDF)" : ")"));
}

// The middle of the points' box, and the ball around it that holds them.
std::pair<Vector3d, double> Ball(const std::vector<Vector3d>& points) {
  Vector3d low = points.front(), high = low;
  for (const Vector3d& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const Vector3d middle = (low + high) / 2;
  double radius = 0;
  for (const Vector3d& p : points) radius = std::max(radius, (p - middle).norm());
  return {middle, radius};
}

}  // namespace

std::vector<std::string> MeshFaults(const codegen::Robot& robot) {
  std::vector<std::string> faults;
  if (!CanMeasure()) return faults;
  for (const Shape& shape : robot.shape) {
    if (shape.kind != Shape::Kind::kMesh || shape.file.empty()) continue;
    try {
      RequireMetres(shape, Ball(MeshHull(shape).corner).second);
    } catch (const io::InputError& e) {
      if (std::find(faults.begin(), faults.end(), e.what()) == faults.end()) faults.emplace_back(e.what());
    }
  }
  return faults;
}

std::string WhyUncheckable(const codegen::Robot& robot) {
  if (!CanMeasure())
    return "this program was built without FCL or Assimp; install libfcl-dev and libassimp-dev, then build it again";
  if (robot.shape.empty()) return "the robot has no collision shapes; the URDF's, or [[capsule]] in " + robot.path;
  for (const Shape& shape : robot.shape)
    if (shape.kind == Shape::Kind::kMesh && shape.file.empty())
      return "link \"" + shape.link + "\": no such mesh: " + shape.mesh + "; say where its package is: packages in " +
             robot.path;
  return "";
}

Clearance::Clearance(const codegen::Robot& robot, const Cell& cell, double margin_m)
    : robot_(robot), margin_m_(margin_m) {
  AddArm();
  AddCell(cell);
  ChoosePairs();
}

void Clearance::AddArm() {
  std::map<std::string, int> count, number;
  for (const Shape& shape : robot_.shape) ++count[shape.link];
  for (const Shape& shape : robot_.shape) {
    Part part;
    part.name = shape.link;
    if (count[shape.link] > 1) part.name += "[" + std::to_string(++number[shape.link]) + "]";
    part.body = shape.body;
    part.pose = codegen::ToPose(shape.xyz_m, shape.rotation);
    const Vector3d half(0, 0, shape.size_m[1] / 2);
    switch (shape.kind) {
      case Shape::Kind::kBox:
        part.solid = Box(Size(shape));
        part.extreme = BoxCorners(Size(shape));
        break;
      case Shape::Kind::kSphere:
        part.solid = Sphere(shape.size_m[0]);
        part.extreme = {Vector3d::Zero()}, part.round = shape.size_m[0];
        break;
      case Shape::Kind::kCylinder:
        part.solid = Cylinder(shape.size_m[0], shape.size_m[1]);
        part.extreme = {-half, half}, part.rim = shape.size_m[0];
        break;
      case Shape::Kind::kCapsule:
        part.solid = Capsule(shape.size_m[0], shape.size_m[1]);
        part.extreme = {-half, half}, part.round = shape.size_m[0];
        break;
      case Shape::Kind::kMesh: {
        const Hull hull = MeshHull(shape);
        part.solid = Polyhedron(hull);
        part.extreme = hull.corner;
        break;
      }
    }
    const auto [middle, radius] = Ball(part.extreme);
    part.middle = middle, part.radius = std::hypot(radius, part.rim) + part.round;
    RequireMetres(shape, part.radius);
    part_.push_back(part);
  }
  for (int body = 1; body <= robot_.joints(); ++body)
    if (std::none_of(part_.begin(), part_.end(), [body](const Part& p) { return p.body == body; }))
      shapeless_.push_back(robot_.joint[static_cast<std::size_t>(body) - 1].name);
}

void Clearance::AddCell(const Cell& cell) {
  for (const CellBox& box : cell.box) {
    Part part;
    part.name = box.name, part.is_cell = true, part.pose = box.pose;
    part.solid = Box(box.size);
    part.middle = Vector3d::Zero(), part.radius = box.size.norm() / 2;
    part_.push_back(part);
  }
  for (const CellPlane& plane : cell.plane) {
    Part part;
    part.name = plane.name, part.is_cell = true, part.pose = Isometry3d::Identity();
    part.normal = plane.normal, part.offset = plane.offset;
    part_.push_back(part);
  }
}

// A joint moves the outer solid about its axis. No point of that solid is farther from the axis than the bodies between
// are long.
VectorXd Clearance::Reach(const Part& inner, const Part& outer) const {
  VectorXd reach = VectorXd::Zero(robot_.joints());
  double far = (outer.pose * outer.middle).norm() + outer.radius;
  for (int k = outer.body - 1; k >= inner.body; --k) {
    const codegen::Joint& joint = robot_.joint[static_cast<std::size_t>(k)];
    const bool slide = joint.kinematics.type == codegen::JointType::kPrismatic;
    reach[k] = slide ? 1 : far;
    far += std::hypot(joint.kinematics.a_m, joint.kinematics.d_m);
    if (slide) far += std::max(std::abs(joint.position_limit_rad[0]), std::abs(joint.position_limit_rad[1]));
  }
  return reach;
}

void Clearance::ChoosePairs() {
  for (std::size_t i = 0; i < part_.size(); ++i)
    for (std::size_t k = i + 1; k < part_.size(); ++k) {
      const bool swap = part_[i].body > part_[k].body;
      const std::size_t a = swap ? k : i, b = swap ? i : k;
      if (part_[a].body == part_[b].body) continue;
      if (!part_[a].is_cell && part_[b].body == part_[a].body + 1)
        unchecked_.push_back({part_[a].name, part_[b].name, "neighbours"});
      else pair_.push_back({a, b, Reach(part_[a], part_[b])});
    }
  std::vector<Pair> always = pair_;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int pose = 0; pose < kPoses && !always.empty(); ++pose) {
    VectorXd q(robot_.joints());
    for (int j = 0; j < robot_.joints(); ++j) {
      const auto [low, high] = robot_.joint[static_cast<std::size_t>(j)].position_limit_rad;
      q[j] = low + (high - low) * unit(random);
    }
    const Poses poses = At(q);
    std::erase_if(always, [&](const Pair& pair) { return Meet(pair, poses).distance >= margin_m_ + kGuard_m; });
  }
  for (const Pair& pair : always) {
    unchecked_.push_back({part_[pair.a].name, part_[pair.b].name, "near in every pose that was tried"});
    std::erase_if(pair_, [&](const Pair& other) { return other.a == pair.a && other.b == pair.b; });
  }
}

Clearance::Poses Clearance::At(const VectorXd& q) const {
  Poses poses{Isometry3d::Identity()};
  Isometry3d T = codegen::ToPose(robot_.base_xyz_m, robot_.base_rotation);
  for (int j = 0; j < robot_.joints(); ++j) {
    T = T * codegen::ModifiedDh(robot_.joint[static_cast<std::size_t>(j)].kinematics, q[j]);
    poses.push_back(T);
  }
  return poses;
}

double Clearance::BallsApart(const Pair& pair, const Poses& poses) const {
  const Part &a = part_[pair.a], &b = part_[pair.b];
  const Vector3d middle = PoseOf(b, poses) * b.middle;
  if (!a.solid) return a.normal.dot(middle) - a.offset - b.radius;
  return (PoseOf(a, poses) * a.middle - middle).norm() - a.radius - b.radius;
}

Clearance::Meeting Clearance::MeetPlane(const Part& plane, const Part& part, const Isometry3d& pose) {
  Meeting nearest{std::numeric_limits<double>::infinity(), {}, {}, plane.normal};
  // Across the disc, towards the plane.
  const Vector3d axis = pose.linear().col(2), across = plane.normal.dot(axis) * axis - plane.normal;
  const Vector3d rim = across.norm() > 1e-9 ? Vector3d(part.rim * across.normalized()) : Vector3d::Zero();
  for (const Vector3d& p : part.extreme) {
    const Vector3d point = pose * p + rim - part.round * plane.normal;
    const double distance = plane.normal.dot(point) - plane.offset;
    if (distance < nearest.distance)
      nearest.distance = distance, nearest.on_b = point, nearest.on_a = point - distance * plane.normal;
  }
  return nearest;
}

Clearance::Meeting Clearance::Meet(const Pair& pair, const Poses& poses) const {
  const Part &a = part_[pair.a], &b = part_[pair.b];
  const Isometry3d pose_b = PoseOf(b, poses);
  if (!a.solid) return MeetPlane(a, b, pose_b);
  const Isometry3d pose_a = PoseOf(a, poses);
  const Gap gap = Between(*a.solid, pose_a, *b.solid, pose_b);
  if (gap.distance > 0) return {gap.distance, gap.on_a, gap.on_b, (gap.on_b - gap.on_a).normalized()};
  const Vector3d middle_a = pose_a * a.middle, middle_b = pose_b * b.middle, between = middle_b - middle_a;
  return {std::min(0.0, between.norm() - a.radius - b.radius), middle_a, middle_b,
          between.norm() > 1e-9 ? Vector3d(between.normalized()) : Vector3d::UnitZ()};
}

// Calls visit(sample, pair, poses, meeting) for all pairs that are nearer than `limit`, which visit may lower.
template <class Visit>
void Clearance::ForNearPairs(const Eigen::MatrixXd& q, const double& limit, Visit visit) const {
  std::vector<double> known(pair_.size(), -std::numeric_limits<double>::infinity());
  std::vector<Eigen::Index> measured(pair_.size(), 0);
  for (Eigen::Index sample = 0; sample < q.rows(); ++sample) {
    if (sample % kUnwatched == 0) io::CancellationPoint();
    Poses poses;
    for (std::size_t p = 0; p < pair_.size(); ++p) {
      const Pair& pair = pair_[p];
      const double moved = pair.reach.dot((q.row(sample) - q.row(measured[p])).cwiseAbs());
      if (known[p] - moved >= limit) continue;
      if (poses.empty()) poses = At(q.row(sample));
      measured[p] = sample;
      known[p] = BallsApart(pair, poses);
      if (known[p] >= limit) continue;
      const Meeting meeting = Meet(pair, poses);
      known[p] = meeting.distance;
      if (meeting.distance < limit && !visit(sample, pair, poses, meeting)) return;
    }
  }
}

bool Clearance::Keeps(const Eigen::MatrixXd& q) const {
  bool keeps = true;
  ForNearPairs(q, margin_m_ + kGuard_m,
               [&](Eigen::Index, const Pair&, const Poses&, const Meeting&) { return keeps = false; });
  return keeps;
}

Nearest Clearance::Smallest(const Eigen::MatrixXd& q) const {
  Nearest nearest;
  nearest.distance_m = std::numeric_limits<double>::infinity();
  ForNearPairs(q, nearest.distance_m, [&](Eigen::Index sample, const Pair& pair, const Poses&, const Meeting& meeting) {
    nearest = {std::max(0.0, meeting.distance), sample, part_[pair.a].name, part_[pair.b].name};
    return true;
  });
  return nearest;
}

double Clearance::Penalty(const Eigen::MatrixXd& q, double weight, Eigen::MatrixXd& d_q) const {
  const double from = margin_m_ + kKeepOff_m;
  double sum = 0;
  ForNearPairs(q, from, [&](Eigen::Index sample, const Pair& pair, const Poses& poses, const Meeting& meeting) {
    const double excess = (from - meeting.distance) / kSoft_m;
    sum += excess * excess;
    for (int k = part_[pair.a].body; k < part_[pair.b].body; ++k) {
      const Isometry3d& frame = poses[static_cast<std::size_t>(k) + 1];
      const Vector3d axis = frame.linear().col(2);
      const bool slide = robot_.joint[static_cast<std::size_t>(k)].kinematics.type == codegen::JointType::kPrismatic;
      const Vector3d speed = slide ? axis : Vector3d(axis.cross(meeting.on_b - frame.translation()));
      d_q(sample, k) -= weight * 2 * excess / kSoft_m * meeting.direction.dot(speed);
    }
    return true;
  });
  return sum;
}

}  // namespace armcal::collision
