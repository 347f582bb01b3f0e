// tests - a made-up true arm: KDL torque, bodies that differ from CAD, friction and noise. So the right answer is
// known.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "host_sim/identify/calibration/weighted_fit.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::tests {

// What an undeclared effect may read: joint (0-based), position, speed, and the torque of the true bodies alone.
struct State {
  int joint;
  double q, qd, tau_rigid;
};
using Effect = std::function<double(const State&)>;

inline const codegen::Catalogue& Records() {
  static const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  return records;
}
inline codegen::Robot Er20() { return codegen::ReadRobot("codegen/robots/er20_like.toml"); }
inline const codegen::Model& Er20Model() {
  static const codegen::Model model(Er20(), Records());
  return model;
}

class SyntheticArm {
 public:
  SyntheticArm(const codegen::Robot& robot, std::uint64_t truth_seed) : model_(robot, Records()), random_(truth_seed) {
    const int n = model_.joints();
    bodies_.resize(11 * n);
    do {  // drawn from the prior itself, again until they can exist
      for (int j = 0; j < n; ++j) {
        Eigen::VectorXd table = calibration::ToCentre(Mean().segment(11 * j, 10));
        for (int k = 0; k < 10; ++k) table[k] += model_.table()[11 * j + k].sd * Normal();
        bodies_.segment(11 * j, 10) = calibration::ToOrigin(table);
        bodies_[11 * j + 10] = std::abs(Mean()[11 * j + 10] + model_.table()[11 * j + 10].sd * Normal());
      }
    } while (!calibration::IsPhysical(bodies_));
    truth_ = Eigen::VectorXd::Zero(model_.columns() + n);
    truth_.segment(model_.front(), model_.rigid()) = model_.base_map() * bodies_;
    for (int c = 0; c < model_.front(); ++c) {
      const auto& p = model_.table()[model_.table_index(c)];
      if (p.effect == "coulomb_viscous") truth_[c] = p.mean * (1 + 0.3 * Uniform());
    }
    for (int j = 0; j < n; ++j)
      truth_[model_.columns() + j] = Uniform() * robot.joint[j].motor.torque_constant_tolerance;
  }

  const codegen::Model& model() const { return model_; }
  const Eigen::VectorXd& truth() const { return truth_; }  // filter columns and torque gain deviations
  const Eigen::VectorXd& bodies() const { return bodies_; }

  // Five harmonics of 0.1 Hz a joint, up to `speed` of its limit; joints in `still` do not move.
  calibration::Dataset Run(double seconds, std::uint64_t seed, const Effect& effect = {}, double speed = 0.5,
                           const std::vector<int>& still = {}) {
    constexpr double kRate_Hz = 125;
    random_.seed(seed);
    const int n = model_.joints(), samples = static_cast<int>(seconds * kRate_Hz);
    const codegen::Robot& robot = model_.robot();
    calibration::Dataset d;
    d.s.t = Eigen::VectorXd::LinSpaced(samples, 0, (samples - 1) / kRate_Hz);
    d.s.q.setZero(samples, n), d.s.qd = d.s.q, d.s.qdd = d.s.q, d.tau = d.s.q;
    for (int j = 0; j < n; ++j) Move(robot.joint[j], speed, d.s, j);
    for (const int j : still) d.s.qd.col(j).setZero(), d.s.qdd.col(j).setZero(), d.s.q.col(j).setConstant(0.3);
    KdlArm arm(robot, bodies_);
    d.moving.setZero(samples, n), d.used.setZero(samples, n), d.scored.setZero(samples);
    d.sound.setOnes(samples, n);
    for (int k = 0; k < samples; ++k) {
      const Eigen::VectorXd rigid = arm.Torque(d.s.q.row(k), d.s.qd.row(k), d.s.qdd.row(k));
      d.scored[k] = d.s.t[k] >= 0.5 && d.s.t[k] <= d.s.t[samples - 1] - 0.5;
      for (int j = 0; j < n; ++j) {
        const double qd = d.s.qd(k, j), sign = qd > 0 ? 1 : qd < 0 ? -1 : 0;
        double tau = rigid[j] + Friction("Fc", j) * sign + Friction("Fv", j) * qd;
        if (effect) tau += effect({j, d.s.q(k, j), qd, rigid[j]});
        d.tau(k, j) = (1 + truth_[model_.columns() + j]) * tau + noise_Nm(j) * Normal();
        d.moving(k, j) = d.used(k, j) = std::abs(qd) > robot.joint[j].v_min_radps;
      }
    }
    d.source = "synthetic";
    return d;
  }

  double noise_Nm(int j) const { return model_.robot().joint[j].torque_noise_Nm / std::sqrt(8.0); }
  double Friction(const std::string& name, int j) const {
    for (int c = 0; c < model_.front(); ++c)
      if (model_.column_name(c) == name + std::to_string(j + 1)) return truth_[c];
    throw std::logic_error("no column " + name);
  }

 private:
  Eigen::VectorXd Mean() const { return calibration::BodyMean(model_); }
  double Normal() { return std::normal_distribution<double>()(random_); }
  double Uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }

  void Move(const codegen::Joint& joint, double speed, codegen::Signals& s, int j) {
    double a[5], phase[5];
    for (int h = 0; h < 5; ++h) a[h] = Uniform() / (h + 1), phase[h] = std::numbers::pi * Uniform();
    for (int k = 0; k < s.samples(); ++k)
      for (int h = 0; h < 5; ++h) {
        const double w = 2 * std::numbers::pi * 0.1 * (h + 1), x = w * s.t[k] + phase[h];
        s.q(k, j) += a[h] * std::sin(x);
        s.qd(k, j) += a[h] * w * std::cos(x);
        s.qdd(k, j) -= a[h] * w * w * std::sin(x);
      }
    const auto& limit = joint.position_limit_rad;
    const double scale = std::min({speed * joint.speed_limit_radps / s.qd.col(j).cwiseAbs().maxCoeff(),
                                   0.8 * joint.acceleration_limit_radps2 / s.qdd.col(j).cwiseAbs().maxCoeff(),
                                   0.45 * (limit[1] - limit[0]) / s.q.col(j).cwiseAbs().maxCoeff()});
    s.q.col(j) *= scale, s.qd.col(j) *= scale, s.qdd.col(j) *= scale;
    s.q.col(j).array() += 0.5 * (limit[0] + limit[1]);
  }

  codegen::Model model_;
  std::mt19937_64 random_;
  Eigen::VectorXd bodies_, truth_;
};

}  // namespace armcal::tests
