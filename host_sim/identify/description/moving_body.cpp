// description - finds where an arm stands in a file by the axes of its joints, and takes bodies apart.
#include "host_sim/identify/description/moving_body.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/description/file_text.hpp"

namespace armcal::description {

namespace {

using codegen::Body;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSame_m = 1e-3, kSame_rad = 1e-3;  // the files round their numbers
constexpr double kParallel = 1e-6;

Matrix3d AboutFrame(const Body& b) {
  return b.inertia + b.mass * (b.center.squaredNorm() * Matrix3d::Identity() - b.center * b.center.transpose());
}

// The joint's axis in the arm's base frame, all joints at zero.
std::vector<FileJoint> AxesOf(const codegen::Robot& robot) {
  std::vector<FileJoint> axes;
  for (std::size_t j = 0; j < robot.joint.size(); ++j) {
    const Isometry3d T = PoseAtZero(robot, j);
    axes.push_back({T.translation(), T.linear().col(2), Slides(robot.joint[j]), {}});
  }
  return axes;
}

// The body without its parts, all in one frame; mass may come out zero or below.
Body Without(const Body& body, const std::vector<Body>& parts) {
  double mass = body.mass;
  Vector3d first = body.mass * body.center;
  Matrix3d second = AboutFrame(body);
  for (const Body& part : parts) mass -= part.mass, first -= part.mass * part.center, second -= AboutFrame(part);
  Body rest{mass, mass > 0 ? Vector3d(first / mass) : Vector3d::Zero(), second};
  const Body point{rest.mass, rest.center, Matrix3d::Zero()};
  if (mass > 0) rest.inertia -= AboutFrame(point);
  return rest;
}

Vector3d Across(const Vector3d& axis, const Vector3d& v) { return v - axis * axis.dot(v); }

}  // namespace

Isometry3d BaseInFile(const DescribedArm& arm, const std::vector<FileJoint>& joint, const std::string& file) {
  const std::vector<FileJoint> own = AxesOf(arm.robot);
  const auto fault = [&](std::size_t j, const std::string& what) {
    return io::InputError(
        fmt::format("{}: joint \"{}\": {}; expected the arm of robot {}, with the same axes where all "
                    "joints are at zero",
                    file, arm.robot.joint[j].name, what, arm.robot.name));
  };
  // Directions of axes, and of the shortest way between axes that are parallel: the rotation of least squares.
  Matrix3d H = Matrix3d::Zero();
  for (std::size_t j = 0; j < own.size(); ++j) {
    if (own[j].slides != joint[j].slides) throw fault(j, own[j].slides ? "turns" : "slides");
    H += joint[j].axis * own[j].axis.transpose();
    for (std::size_t k = 0; k < j; ++k) {
      if (own[j].slides || own[k].slides || own[j].axis.cross(own[k].axis).norm() > kParallel) continue;
      const Vector3d a = Across(own[j].axis, own[j].point - own[k].point);
      const Vector3d b = Across(joint[j].axis, joint[j].point - joint[k].point);
      if (a.norm() > kSame_m && b.norm() > kSame_m) H += b.normalized() * a.normalized().transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3d U = svd.matrixU(), V = svd.matrixV();
  const double sign = U.determinant() * V.determinant();
  const Matrix3d R = U * Vector3d(1, 1, sign).asDiagonal() * V.transpose();
  // The translation that brings the lines of turning joints onto each other; the shortest one where they leave a
  // choice.
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (std::size_t j = 0; j < own.size(); ++j) {
    if (own[j].slides) continue;
    A += Matrix3d::Identity() - joint[j].axis * joint[j].axis.transpose();
    b += Across(joint[j].axis, joint[j].point - R * own[j].point);
  }
  Isometry3d base = Isometry3d::Identity();
  base.linear() = R;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  base.translation() = solver.setThreshold(kParallel).compute(Eigen::MatrixXd(A)).solve(Eigen::VectorXd(b));
  for (std::size_t j = 0; j < own.size(); ++j) {
    const Vector3d axis = R * own[j].axis;
    const double angle = std::atan2(axis.cross(joint[j].axis).norm(), axis.dot(joint[j].axis));
    if (angle > kSame_rad) throw fault(j, fmt::format("its axis is {:.3g} rad away from the arm's", angle));
    const double off = Across(joint[j].axis, base * own[j].point - joint[j].point).norm();
    if (!own[j].slides && off > kSame_m) throw fault(j, fmt::format("its axis is {:.3g} m away from the arm's", off));
  }
  return base;
}

Body RestOf(const codegen::Link& body, const Isometry3d& dh_frame, const FileJoint& joint, bool whole) {
  const Isometry3d to_link = joint.part[0].pose.inverse();
  std::vector<Body> kept;
  for (std::size_t k = 1; k < joint.part.size() && !whole; ++k)
    if (const FilePart& part = joint.part[k]; part.body.mass > 0)  // else a frame, whatever inertia is written for it
      kept.push_back(codegen::Moved(to_link * part.pose, part.body));
  return Without(codegen::Moved(to_link * dh_frame, codegen::ToBody(body)), kept);
}

std::string WhyNoRest(const Body& rest, const FileJoint& joint, const std::string& file, const std::string& remedy) {
  const std::string missing = codegen::Impossible(rest);
  if (missing.empty()) return "";
  std::string names;
  for (std::size_t k = 1; k < joint.part.size(); ++k)
    if (joint.part[k].body.mass > 0) names += (names.empty() ? "" : ", ") + joint.part[k].link;
  return file + ": link \"" + joint.part[0].link + "\" without " + names + ": expected " + missing + "; " + remedy;
}

}  // namespace armcal::description
