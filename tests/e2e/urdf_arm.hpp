// end-to-end tests - a seven-axis arm as a URDF, and logs of an arm of that shape by Orocos KDL.
#pragma once

#include <gtest/gtest.h>
#include <algorithm>
#include <sstream>

#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#include <kdl_parser/kdl_parser.hpp>
#include <numbers>
#include <random>

#include "host_sim/data/logs/log.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {

struct UrdfJoint {
  std::string type, parent, child, origin, axis;
  double lower, upper, torque, speed;
  double mass;
  std::string center, inertia;  // "xx xy xz yy yz zz"
};

inline std::string Numbered(const std::string& values) {
  std::istringstream in(values);
  std::string text, v;
  for (const char* name : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"})
    in >> v, text += std::string(" ") + name + "=\"" + v + "\"";
  return text;
}

inline std::string LinkText(const std::string& name, double mass, const std::string& center,
                            const std::string& inertia) {
  std::ostringstream o;
  o << "  <link name=\"" << name << "\">\n";
  if (mass > 0)
    o << "    <inertial><origin xyz=\"" << center << "\"/><mass value=\"" << mass << "\"/><inertia" << Numbered(inertia)
      << "/></inertial>\n";
  o << "  </link>\n";
  return o.str();
}

inline std::string JointText(const std::string& name, const UrdfJoint& j, const std::string& dynamics) {
  std::ostringstream o;
  o << "  <joint name=\"" << name << "\" type=\"" << j.type << "\"><parent link=\"" << j.parent << "\"/><child link=\""
    << j.child << "\"/><origin " << j.origin << "/><axis xyz=\"" << j.axis << "\"/>";
  if (j.type != "fixed")
    o << "<limit lower=\"" << j.lower << "\" upper=\"" << j.upper << "\" effort=\"" << j.torque << "\" velocity=\""
      << j.speed << "\"/>" << dynamics;
  o << "</joint>\n";
  return o.str();
}

// Shoulder, elbow and wrist with offsets; not an arm that is sold.
inline std::vector<UrdfJoint> SevenJoints() {
  return {{"revolute", "base", "a1", "xyz=\"0 0 0.31\"", "0 0 1", -2.8, 2.8, 90, 2.2, 4.2, "0.01 -0.03 -0.1",
           "0.04 0.001 0.002 0.038 -0.003 0.015"},
          {"revolute", "a1", "a2", "xyz=\"0 0 0\" rpy=\"-1.5708 0 0\"", "0 0 1", -1.7, 1.7, 90, 2.2, 3.9,
           "-0.005 -0.09 0.03", "0.035 0.001 -0.001 0.012 0.003 0.034"},
          {"revolute", "a2", "a3", "xyz=\"0 -0.33 0\" rpy=\"1.5708 0 0\"", "0 0 1", -2.8, 2.8, 80, 2.1, 3.1,
           "0.03 0.03 -0.06", "0.022 -0.002 -0.003 0.021 0.002 0.011"},
          {"revolute", "a3", "a4", "xyz=\"0.08 0 0\" rpy=\"1.5708 0 0\"", "0 0 1", -2.9, 0.1, 80, 2.1, 3.2,
           "-0.045 0.07 0.02", "0.024 0.004 -0.001 0.015 0.001 0.026"},
          {"revolute", "a4", "a5", "xyz=\"-0.08 0.37 0\" rpy=\"-1.5708 0 0\"", "0 0 1", -2.8, 2.8, 15, 2.6, 2.9,
           "0 0.03 -0.12", "0.03 0 0.001 0.027 0.004 0.007"},
          {"revolute", "a5", "a6", "xyz=\"0 0 0\" rpy=\"1.5708 0 0\"", "0 0 1", 0.1, 3.6, 15, 2.6, 1.6,
           "0.05 0.005 -0.01", "0.003 0.0003 -0.0004 0.006 0.0001 0.006"},
          {"revolute", "a6", "a7", "xyz=\"0.09 0 0\" rpy=\"1.5708 0 0\"", "0 0 1", -2.8, 2.8, 15, 2.6, 0.9,
           "0.01 0.008 0.06", "0.0022 0.0001 -0.0003 0.0021 -0.0002 0.0009"}};
}

inline std::string SevenAxisUrdf(const std::vector<UrdfJoint>& joints, const std::string& dynamics) {
  std::string text = "<robot name=\"seven\">\n" + LinkText("base", 3, "0 0 0.1", "0.01 0 0 0.01 0 0.01");
  for (std::size_t j = 0; j < joints.size(); ++j)
    text += LinkText(joints[j].child, joints[j].mass, joints[j].center, joints[j].inertia) +
            JointText("joint" + std::to_string(j + 1), joints[j], dynamics);
  return text + "</robot>\n";
}

// What the arm has and its URDF does not say.
struct TrueDrive {
  double coulomb_Nm, viscous_Nmsprad, rotor_kgm2, noise_Nm;
  double load_friction = 0;  // friction per torque of the links
};

class UrdfArm {
 public:
  // text: the URDF of the true arm, whose masses differ from the declared one. names: the joints that move, outward;
  // held: where the others stand.
  UrdfArm(const std::string& text, const std::vector<std::string>& names, const std::vector<UrdfJoint>& joints,
          const std::vector<TrueDrive>& drive, const std::map<std::string, double>& held = {})
      : joints_(joints), drive_(drive) {
    EXPECT_TRUE(kdl_parser::treeFromString(text, tree_));
    rest_ = KDL::JntArray(tree_.getNrOfJoints());
    for (const auto& [name, segment] : tree_.getSegments()) {
      const std::string joint = segment.segment.getJoint().getName();
      if (const auto at = held.find(joint); at != held.end()) rest_(segment.q_nr) = at->second;
      place_[joint] = segment.q_nr;
    }
    for (const std::string& name : names) order_.push_back(place_.at(name));
  }

  // Five harmonics a joint inside limits; torque with friction, rotor inertia and noise.
  logs::Log Run(double seconds, double rate_Hz, std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::normal_distribution<double> normal;
    const int n = static_cast<int>(joints_.size()), samples = static_cast<int>(seconds * rate_Hz);
    logs::Log log;
    log.joints = n;
    log.t = Eigen::VectorXd::LinSpaced(samples, 0, (samples - 1) / rate_Hz);
    log.q.setZero(samples, n), log.tau = log.q;
    Eigen::MatrixXd qd = log.q, qdd = log.q;
    for (int j = 0; j < n; ++j) {
      for (int h = 1; h <= 5; ++h) {
        const double w = 2 * std::numbers::pi * 0.1 * h, a = uniform(random) / h,
                     phase = std::numbers::pi * uniform(random);
        for (int k = 0; k < samples; ++k) {
          const double x = w * log.t[k] + phase;
          log.q(k, j) += a * std::sin(x), qd(k, j) += a * w * std::cos(x), qdd(k, j) -= a * w * w * std::sin(x);
        }
      }
      const UrdfJoint& joint = joints_[static_cast<std::size_t>(j)];
      const double scale = std::min(0.45 * (joint.upper - joint.lower) / log.q.col(j).cwiseAbs().maxCoeff(),
                                    0.7 * joint.speed / qd.col(j).cwiseAbs().maxCoeff());
      log.q.col(j) *= scale, qd.col(j) *= scale, qdd.col(j) *= scale;
      log.q.col(j).array() += 0.5 * (joint.lower + joint.upper);
    }
    KDL::TreeIdSolver_RNE solver(tree_, KDL::Vector(0, 0, -9.81));
    KDL::JntArray q = rest_, v(rest_.rows()), a(rest_.rows()), tau(rest_.rows());
    for (int k = 0; k < samples; ++k) {
      for (int j = 0; j < n; ++j) {
        const unsigned at = order_[static_cast<std::size_t>(j)];
        q(at) = log.q(k, j), v(at) = qd(k, j), a(at) = qdd(k, j);
      }
      EXPECT_GE(solver.CartToJnt(q, v, a, {}, tau), 0);
      for (int j = 0; j < n; ++j) {
        const TrueDrive& d = drive_[static_cast<std::size_t>(j)];
        const unsigned at = order_[static_cast<std::size_t>(j)];
        const double sliding_Nm = d.coulomb_Nm + d.load_friction * std::abs(tau(at));
        log.tau(k, j) = tau(at) + d.rotor_kgm2 * a(at) + sliding_Nm * (v(at) > 0 ? 1 : -1) + d.viscous_Nmsprad * v(at) +
                        d.noise_Nm * normal(random);
      }
    }
    return log;
  }

 private:
  std::vector<UrdfJoint> joints_;
  std::vector<TrueDrive> drive_;
  KDL::Tree tree_;
  KDL::JntArray rest_;
  std::map<std::string, unsigned> place_;
  std::vector<unsigned> order_;
};

}  // namespace armcal::tests
