// judged set - draws arms and motions by chance.
#include "tests/judged/arm.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::judged {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSmooth_radps = 0.005;  // of the declared tanh

struct Size {
  const char* name;
  double length[4];          // shoulder height, shoulder offset, upper arm, forearm
  double mass[6], reach[6];  // of each link: kg; size of the body in m
  double coulomb[6], sigma[6], gear[6], torque[6], speed[6];
};
const Size kSizes[] = {{"medium",
                        {0.5, 0.17, 0.78, 0.76},
                        {58, 38, 24, 12, 5, 3},
                        {0.3, 0.45, 0.3, 0.25, 0.12, 0.1},
                        {60, 60, 45, 12, 10, 8},
                        {10, 10, 10, 1.8, 1.8, 1.8},
                        {121, 153, 123, 80, 81, 50},
                        {1500, 1700, 900, 160, 140, 80},
                        {2.0, 1.7, 1.9, 3.2, 3.0, 4.0}},
                       {"small",
                        {0.35, 0.02, 0.42, 0.4},
                        {9, 7, 4.5, 2.2, 1.4, 0.6},
                        {0.15, 0.22, 0.2, 0.12, 0.08, 0.05},
                        {8, 8, 6, 2.2, 1.8, 1.2},
                        {0.6, 0.6, 0.5, 0.15, 0.12, 0.1},
                        {101, 101, 101, 80, 80, 50},
                        {150, 150, 90, 30, 25, 15},
                        {2.6, 2.6, 3.0, 4.5, 4.5, 6.0}},
                       {"heavy",
                        {0.7, 0.4, 1.3, 1.4},
                        {420, 310, 210, 95, 40, 22},
                        {0.5, 0.8, 0.6, 0.5, 0.25, 0.2},
                        {420, 450, 300, 110, 90, 60},
                        {55, 60, 45, 12, 10, 8},
                        {250, 265, 250, 220, 240, 150},
                        {12000, 14000, 8000, 1800, 1600, 900},
                        {1.6, 1.4, 1.5, 2.0, 2.0, 3.0}}};

plant::Body DrawBody(double mass, double reach, plant::Random& random) {
  plant::Body b;
  b.mass_kg = mass * random.Uniform(0.8, 1.2);
  for (double& c : b.center_m) c = reach * random.Uniform(-0.45, 0.45);
  // A box's inertia is always one that a body can have.
  double side[3];
  for (double& s : side) s = reach * random.Uniform(0.3, 1.0);
  const double k = b.mass_kg / 12;
  b.inertia_kgm2 = {k * (side[1] * side[1] + side[2] * side[2]), 0, 0,
                    k * (side[0] * side[0] + side[2] * side[2]), 0, k * (side[0] * side[0] + side[1] * side[1])};
  return b;
}

plant::Body CadOf(const plant::Body& truth, double error, plant::Random& random) {
  plant::Body cad = truth;
  const auto off = [&] { return 1 + error * random.Uniform(-1, 1); };
  cad.mass_kg *= off();
  for (double& c : cad.center_m) c *= off();
  const double all = off();
  for (double& i : cad.inertia_kgm2) i *= all;
  return cad;
}

std::vector<plant::Body> OnlyLink(const Arm& arm, int link, const plant::Body& body) {
  std::vector<plant::Body> bodies(static_cast<std::size_t>(arm.joints()));
  bodies[static_cast<std::size_t>(link)] = body;
  return bodies;
}

MatrixXd TorqueOf(const Arm& arm, const std::vector<plant::Body>& bodies, const Motion& m, const KDL::Vector& gravity) {
  plant::Dynamics dynamics(arm.robot, bodies, gravity);
  MatrixXd tau(m.samples(), arm.joints());
  for (int k = 0; k < m.samples(); ++k)
    tau.row(k) = dynamics.Torque(m.q.row(k).transpose(), m.qd.row(k).transpose(), m.qdd.row(k).transpose());
  return tau;
}

}  // namespace

ArrayXd Sign(const ArrayXd& speed) { return (speed / kSmooth_radps).tanh(); }

Arm DrawArm(plant::Random& random, double cad_error) {
  const Size& size = kSizes[static_cast<int>(random.Uniform(0, 2.999))];
  const auto vary = [&](double v, double by) { return v * (1 + by * random.Uniform(-1, 1)); };
  Arm arm;
  arm.name = size.name + std::to_string(static_cast<int>(random.Uniform(1e5, 1e6)));
  arm.robot.name = arm.name;
  arm.robot.gravity_mps2 = KDL::Vector(0, 0, -9.81);
  const double alpha[] = {0, -kPi / 2, 0, -kPi / 2, kPi / 2, -kPi / 2};
  const double a[] = {0, vary(size.length[1], 0.3), vary(size.length[2], 0.1), 0.18 * size.length[2], 0, 0};
  const double d[] = {vary(size.length[0], 0.1), 0, 0, vary(size.length[3], 0.1), 0, 0.16 * size.length[3]};
  const double theta[] = {0, -kPi / 2, 0, 0, 0, kPi};
  const double low[] = {-2.8, -1.0, -1.1, -3.0, -1.9, -5.5}, high[] = {2.8, 1.8, 1.5, 3.0, 1.9, 5.5};
  constexpr int n = 6;
  for (VectorXd* v : {&arm.rotor, &arm.coulomb, &arm.viscous, &arm.sigma_Nm, &arm.q_low, &arm.q_high, &arm.speed,
                      &arm.gear, &arm.torque_limit})
    v->resize(n);
  for (int j = 0; j < n; ++j) {
    plant::JointData joint;
    joint.name = "joint" + std::to_string(j + 1);
    joint.alpha_rad = alpha[j], joint.a_m = a[j], joint.d_m = d[j], joint.theta_rad = theta[j];
    arm.bodies.push_back(DrawBody(size.mass[j], size.reach[j], random));
    joint.body = CadOf(arm.bodies.back(), cad_error, random);
    arm.robot.joint.push_back(joint);
    arm.coulomb[j] = vary(size.coulomb[j], 0.3);
    arm.viscous[j] = vary(0.8 * size.coulomb[j] / size.speed[j], 0.5);
    arm.rotor[j] = vary(2.5e-2 * size.torque[j] / 10, 0.3) / 10;
    arm.sigma_Nm[j] = vary(size.sigma[j], 0.2);
    arm.q_low[j] = low[j], arm.q_high[j] = high[j];
    arm.speed[j] = size.speed[j], arm.gear[j] = size.gear[j], arm.torque_limit[j] = 1.6 * size.torque[j];
  }
  return arm;
}

nlohmann::json RobotJson(const Arm& arm) {
  using nlohmann::json;
  json a = json::array(), alpha = a, d = a, theta = a, links = a;
  for (const plant::JointData& j : arm.robot.joint) {
    a.push_back(j.a_m), alpha.push_back(j.alpha_rad), d.push_back(j.d_m), theta.push_back(j.theta_rad);
    links.push_back({{"m", j.body.mass_kg}, {"com", j.body.center_m}, {"inertia", j.body.inertia_kgm2}});
  }
  const auto list = [](const VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  return {{"name", arm.name},
          {"mdh", {{"a", a}, {"alpha", alpha}, {"d", d}, {"theta_offset", theta}}},
          {"gravity", {0.0, 0.0, -9.81}},
          {"links", links},
          {"vmax", list(arm.speed)},
          {"q_lo", list(arm.q_low)},
          {"q_hi", list(arm.q_high)},
          {"gear", list(arm.gear)},
          {"tau_max", list(arm.torque_limit)}};
}

Motion DrawMotion(const Arm& arm, double duration_s, double rate_Hz, plant::Random& random) {
  const int samples = static_cast<int>(duration_s * rate_Hz), n = arm.joints();
  Motion m;
  m.t = VectorXd::LinSpaced(samples, 0, (samples - 1) / rate_Hz);
  m.q.resize(samples, n), m.qd = m.qdd = m.temp = m.q;
  // Time itself runs slowly now and then, so that every joint spends some seconds near standstill: s(t), ds/dt in
  // [0.06, 1].
  const double slow = 2 * kPi / random.Uniform(11, 17), phase = random.Uniform(0, 2 * kPi);
  const ArrayXd x = slow * m.t.array() + phase;
  const ArrayXd rate = 0.53 + 0.47 * x.cos(), bend = -0.47 * slow * x.sin();
  const ArrayXd s = 0.53 * m.t.array() + 0.47 / slow * x.sin();
  for (int j = 0; j < n; ++j) {
    ArrayXd q = ArrayXd::Zero(samples), v = q, a = q;
    for (int k = 0; k < 6; ++k) {
      const double w = 2 * kPi * random.Uniform(0.04, 0.12 * (k + 1)), p = random.Uniform(0, 2 * kPi);
      const double size = random.Uniform(0.3, 1) / w;
      q += size * (w * s + p).sin(), v += size * w * (w * s + p).cos(), a -= size * w * w * (w * s + p).sin();
    }
    const double half = 0.45 * (arm.q_high[j] - arm.q_low[j]), middle = 0.5 * (arm.q_high[j] + arm.q_low[j]);
    const double center = 0.5 * (q.maxCoeff() + q.minCoeff());
    const double scale =
        std::min({half / (0.5 * (q.maxCoeff() - q.minCoeff())), 0.9 * arm.speed[j] / (v * rate).abs().maxCoeff(),
                  8.0 * arm.speed[j] / a.abs().maxCoeff()});
    m.q.col(j) = middle + scale * (q - center);
    m.qd.col(j) = scale * v * rate;
    m.qdd.col(j) = scale * (a * rate.square() + v * bend);
    const double rise = random.Uniform(4, 16), constant = random.Uniform(15, 60);
    m.temp.col(j) = 26 + rise * (1 - (-m.t.array() / constant).exp()) + 0.4 * (0.2 * m.t.array() + j).sin();
  }
  return m;
}

Motion Every(const Motion& m, int step) {
  const auto pick = Eigen::seq(0, m.samples() - 1, step);
  Motion out;
  out.t = m.t(pick);
  out.q = m.q(pick, Eigen::all), out.qd = m.qd(pick, Eigen::all), out.qdd = m.qdd(pick, Eigen::all);
  out.temp = m.temp(pick, Eigen::all);
  return out;
}

MatrixXd LinkTorque(const Arm& arm, const Motion& m, const KDL::Vector& gravity) {
  return TorqueOf(arm, arm.bodies, m, gravity);
}
MatrixXd LinkTorque(const Arm& arm, const Motion& m) { return LinkTorque(arm, m, arm.robot.gravity_mps2); }

MatrixXd PayloadTorque(const Arm& arm, const Motion& m, const plant::Body& payload) {
  return TorqueOf(arm, OnlyLink(arm, arm.joints() - 1, payload), m, arm.robot.gravity_mps2);
}

MatrixXd DeclaredTorque(const Arm& arm, const Motion& m, const MatrixXd& links) {
  MatrixXd tau = links;
  for (int j = 0; j < arm.joints(); ++j)
    tau.col(j).array() +=
        arm.rotor[j] * m.qdd.col(j).array() + arm.coulomb[j] * Sign(m.qd.col(j)) + arm.viscous[j] * m.qd.col(j).array();
  return tau;
}

std::vector<MatrixXd> DeclaredRows(const Arm& arm, const Motion& m, plant::Random& random) {
  const int n = arm.joints(), bodies = 10 * n;
  std::vector<MatrixXd> rows(static_cast<std::size_t>(n), MatrixXd::Zero(m.samples(), bodies + 3 * n));
  // A link's torque is linear in ten parameters: ten bodies by chance span them.
  for (int link = 0; link < n; ++link)
    for (int k = 0; k < 10; ++k) {
      const MatrixXd tau = TorqueOf(arm, OnlyLink(arm, link, DrawBody(1, 1, random)), m, arm.robot.gravity_mps2);
      for (int j = 0; j < n; ++j) rows[static_cast<std::size_t>(j)].col(10 * link + k) = tau.col(j);
    }
  for (int j = 0; j < n; ++j) {
    MatrixXd& row = rows[static_cast<std::size_t>(j)];
    row.col(bodies + j) = m.qdd.col(j);
    row.col(bodies + n + j) = Sign(m.qd.col(j));
    row.col(bodies + 2 * n + j) = m.qd.col(j);
  }
  return rows;
}

}  // namespace armcal::judged
