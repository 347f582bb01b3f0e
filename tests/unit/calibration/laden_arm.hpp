// tests - an arm with and without a load, and drives whose torque constants are off. Motion and torque come from the
// plant (KDL, its own reader of robot files); only the motion's time law is borrowed.
#pragma once

#include <fstream>
#include <random>

#include "host_sim/machine/plant/dynamics.hpp"
#include "host_sim/machine/plant/truth.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::tests {

inline std::string ReadAll(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A robot file with `more` at its end, in a temporary folder.
inline std::string RobotWith(const std::string& more, const std::string& name = "er20_like") {
  static const files::test::TemporaryFolder folder;  // until the program ends
  return folder.Write(name + ".toml", ReadAll("codegen/robots/" + name + ".toml") + more).string();
}

// The flange is neither at the last link's origin nor along its axes.
inline const char* const kTool = "\n[tool_frame]\nxyz_m = [0.05, -0.02, 0.11]\nrpy_deg = [20.0, -35.0, 60.0]\n";

class LadenArm {
 public:
  // gain_spread: half width of the torque constants' error; noise_scale: of the robot file's torque noise.
  LadenArm(std::uint64_t seed, double gain_spread, double noise_scale = 1, std::string path = RobotWith(kTool))
      : noise_scale_(noise_scale),
        path_(std::move(path)),
        file_(plant::ReadRobotFile(path_)),
        truth_(plant::DrawTruth(file_, {0.2, 0.5, gain_spread}, seed)),
        motion_(codegen::ReadRobot(path_), seed),
        random_(seed) {}

  const codegen::Model& model() const { return motion_.model(); }
  double noise_Nm(int j) const { return noise_scale_ * motion_.noise_Nm(j); }
  // True torque over what the drive calls torque.
  double gain(int j) const { return truth_.torque_constant_NmpA[at(j)] / file_.joint[at(j)].torque_constant_NmpA; }

  // A run with a trajectory of its own, up to `speed` of the joints' limits.
  calibration::Dataset Run(double seconds, std::uint64_t seed, const std::optional<plant::Body>& load,
                           const std::vector<int>& still = {}, double speed = 0.5) {
    calibration::Dataset d = motion_.Run(seconds, seed, {}, speed, still);
    d.source = load ? "with.csv" : "without.csv";
    std::optional<plant::AttachedBody> attached;
    if (load) attached = plant::AttachedBody{*load, file_.tool_frame};
    plant::Dynamics dynamics(file_, truth_.body, file_.gravity_mps2, attached);
    std::normal_distribution<double> normal;
    for (int k = 0; k < d.samples(); ++k) {
      const Eigen::VectorXd rigid = dynamics.Torque(d.s.q.row(k), d.s.qd.row(k), d.s.qdd.row(k));
      for (int j = 0; j < d.joints(); ++j) {
        const double qd = d.s.qd(k, j), ratio = file_.joint[at(j)].gear_ratio;
        const double tau = rigid[j] + ratio * ratio * truth_.rotor_inertia_kgm2[at(j)] * d.s.qdd(k, j) +
                           truth_.coulomb_Nm[at(j)] * (qd > 0 ? 1 : -1) + truth_.viscous_Nmsprad[at(j)] * qd;
        d.tau(k, j) = tau / gain(j) + noise_Nm(j) * normal(random_);
      }
    }
    return d;
  }

 private:
  static std::size_t at(int j) { return static_cast<std::size_t>(j); }

  double noise_scale_;
  std::string path_;
  plant::RobotFile file_;
  plant::Truth truth_;
  SyntheticArm motion_;
  std::mt19937_64 random_;
};

}  // namespace armcal::tests
