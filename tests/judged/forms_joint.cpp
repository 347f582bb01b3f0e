// judged set - makes the forms of one joint that have no memory.
#include <cmath>

#include "tests/judged/forms.hpp"

namespace armcal::judged {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using plant::Random;

namespace {

using Names = std::vector<std::string>;

const Names kSlowFriction{"stribeck", "viscous_cuberoot", "friction_exponential", "friction_sech_tanh",
                          "stribeck_basis"};
const Names kPositionTorque{"position_torque", "cable_pack", "gravity_spring", "unknown"};

int AnyJoint(Random& r, int of = 6) { return static_cast<int>(r.Uniform(0, of - 1e-9)); }

void Make(Effect& e, Names accept, Names signals, int joint, const Curve& curve) {
  e.accept = std::move(accept), e.signals = std::move(signals), e.held_by_a_record = false;
  OnJoint(e, joint, curve);
}

// Loads over the largest of training; kept by the effect.
struct LoadShare {
  std::function<double(const ArrayXd&)> largest = LargestLoad();
  ArrayXd operator()(const MatrixXd& links, int j) const {
    const ArrayXd load = links.col(j);
    return load / largest(load);
  }
};

double RippleNumber(const Arm& a, Random& r, int j) {
  return r.Uniform(0, 1) < 0.5 ? r.Uniform(15, 140) : a.gear[j] * std::floor(r.Uniform(1, 2.99));
}

std::vector<Form> FrictionForms() {
  return {
      {"stribeck_laplace", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double slow = r.Uniform(0.02, 0.06) * a.speed[j];
         Make(e, kSlowFriction, {"qd"}, j, [slow](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return S(m, i) * (-V(m, i).abs() / slow).exp();
         });
       }},
      {"stribeck_long_tail", true, true,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double slow = r.Uniform(0.02, 0.06) * a.speed[j];
         Make(e, kSlowFriction, {"qd"}, j, [slow](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return S(m, i) / (1 + (V(m, i).abs() / slow).pow(1.3));
         });
       }},
      {"viscous_power", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const double power = r.Uniform(0, 1) < 0.5 ? r.Uniform(1.4, 1.8) : r.Uniform(2.3, 3.2);
         Make(e, {"viscous_quadratic", "viscous_cubic"}, {"qd"}, AnyJoint(r),
              [power](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return S(m, i) * V(m, i).abs().pow(power);
              });
       }},
      {"eyring_shear", true, true,  // an oil film that thins under shear: asinh
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double shear = r.Uniform(0.03, 0.15) * a.speed[j];
         Names accept = kSlowFriction;
         accept.push_back("viscous_quadratic");
         Make(e, accept, {"qd"}, j,
              [shear](const Motion& m, const MatrixXd&, int i) -> ArrayXd { return (V(m, i) / shear).asinh(); });
       }},
      {"viscous_one_way", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double soft = 0.15 * a.speed[j];
         Make(e, {"viscous_asymmetry"}, {"qd"}, j, [soft](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return V(m, i) * (1 + (V(m, i) / soft).tanh());
         });
       }},
      {"fan", false, false,  // a drag that begins at a speed
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double from = r.Uniform(0.3, 0.6) * a.speed[j];
         Make(e, {}, {"qd"}, j, [from](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return S(m, i) * (V(m, i).abs() - from).max(0);
         });
       }},
      {"gear_loss_by_power_flow", true, false,  // a gear loses more when it is driven backwards
       [](const Arm&, Random& r, Effect& e) {
         const double back = r.Uniform(0.15, 0.4);
         Make(e, {"load_friction", "position_friction"}, {"load", "sgn(qd)"}, AnyJoint(r, 3),
              [back, share = LoadShare{}](const Motion& m, const MatrixXd& links, int i) -> ArrayXd {
                const ArrayXd load = share(links, i);
                return load.abs() * S(m, i) * (1 - back * (load * V(m, i) * 50).tanh());
              });
       }},
      {"load_friction_power", true, true,
       [](const Arm&, Random& r, Effect& e) {
         const double power = r.Uniform(0.6, 0.8);
         Make(e, {"load_friction", "position_friction"}, {"load", "sgn(qd)"}, AnyJoint(r, 3),
              [power, share = LoadShare{}](const Motion& m, const MatrixXd& links, int i) -> ArrayXd {
                return share(links, i).abs().pow(power) * S(m, i);
              });
       }},
      {"load_viscous", false, false,
       [](const Arm&, Random& r, Effect& e) {
         Make(e, {}, {"load", "qd"}, AnyJoint(r, 3),
              [share = LoadShare{}](const Motion& m, const MatrixXd& links, int i) -> ArrayXd {
                return share(links, i).abs() * V(m, i);
              });
       }},
      {"inertia_friction", false, true,  // bearings that carry what the joint accelerates
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double base = 0.5 * a.speed[j];
         Make(e, {}, {"qdd", "sgn(qd)", "load"}, j, [base](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return S(m, i) * ((m.qdd.col(i).array().square() + base * base).sqrt() - base);
         });
       }},
  };
}

std::vector<Form> TemperatureForms() {
  return {
      {"temp_viscous_power", true, false,
       [](const Arm&, Random& r, Effect& e) {
         e.needs_temperature = true;
         Make(e, {"temp_viscous", "time_varying_viscous"}, {"temp", "qd"}, AnyJoint(r),
              [](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return V(m, i) * ((m.temp.col(i).array() / 30).pow(-1.5) - 1);
              });
       }},
      {"temp_stribeck", false, true,  // oil that warms builds its film later
       [](const Arm& a, Random& r, Effect& e) {
         e.needs_temperature = true;
         const int j = AnyJoint(r);
         const double slow = 0.08 * a.speed[j];
         Make(e, {}, {"temp", "qd"}, j, [slow](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return S(m, i) * (-V(m, i).abs() / slow).exp() * (m.temp.col(i).array() - 26) / 10;
         });
       }},
      {"warming_by_loss", true, false,  // friction falls with the heat that friction made
       [](const Arm& a, Random& r, Effect& e) {
         e.run_state = true;
         const int j = AnyJoint(r);
         const double constant = r.Uniform(10, 30), unit = a.speed[j];
         Make(e, {"time_varying_coulomb", "temp_coulomb"}, {"t", "sgn(qd)"}, j,
              [constant, unit](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                ArrayXd heat(m.samples());
                const double h = m.t[1] - m.t[0];
                double now = 0;
                for (int k = 0; k < m.samples(); ++k) {
                  now += h / constant * (std::abs(m.qd(k, i)) / unit - now);
                  heat[k] = now;
                }
                return -heat * S(m, i);
              });
       }},
      {"drift_two_rates", true, false,
       [](const Arm&, Random& r, Effect& e) {
         e.run_state = true;
         const double fast = r.Uniform(4, 8), slow = r.Uniform(25, 60);
         Make(e, {"torque_drift"}, {"t"}, AnyJoint(r), [=](const Motion& m, const MatrixXd&, int) -> ArrayXd {
           return 1 - 0.4 * (-m.t.array() / fast).exp() - 0.6 * (-m.t.array() / slow).exp();
         });
       }},
      {"drift_wave", true, true,
       [](const Arm&, Random& r, Effect& e) {
         e.run_state = true;
         const double w = 2 * kPi / r.Uniform(35, 80), phase = r.Uniform(0, 2 * kPi);
         Make(e, {"torque_drift", "unknown"}, {"t"}, AnyJoint(r),
              [=](const Motion& m, const MatrixXd&, int) -> ArrayXd { return (w * m.t.array() + phase).sin(); });
       }},
      {"contact_tap", true, true,  // three knocks that die out
       [](const Arm&, Random& r, Effect& e) {
         e.run_state = true;
         const double at[] = {r.Uniform(3, 12), r.Uniform(13, 22), r.Uniform(23, 36)}, dies = r.Uniform(0.1, 0.4);
         Make(e, {"external_contact"}, {"t"}, AnyJoint(r),
              [=, a0 = at[0], a1 = at[1], a2 = at[2]](const Motion& m, const MatrixXd&, int) -> ArrayXd {
                ArrayXd out = ArrayXd::Zero(m.samples());
                for (const double from : {a0, a1, a2}) {
                  const ArrayXd u = (m.t.array() - from) / dies;
                  out += (u > 0).select((-u.max(0)).exp(), 0.0);
                }
                return out;
              });
       }},
  };
}

std::vector<Form> PositionForms() {
  return {
      {"cogging_saw", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = AnyJoint(r);
         const double k = RippleNumber(a, r, j), p1 = r.Uniform(0, 6), p2 = r.Uniform(0, 6), p3 = r.Uniform(0, 6);
         Make(e, {"torque_ripple"}, {"q"}, j, [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return (k * Q(m, i) + p1).cos() + (2 * k * Q(m, i) + p2).cos() / 4 + (3 * k * Q(m, i) + p3).cos() / 9;
         });
       }},
      {"ripple_of_load", true, true,
       [](const Arm&, Random& r, Effect& e) {
         const double k = r.Uniform(15, 140), phase = r.Uniform(0, 6);
         Make(e, {"torque_ripple", "unknown"}, {"q"}, AnyJoint(r, 3),
              [=, share = LoadShare{}](const Motion& m, const MatrixXd& links, int i) -> ArrayXd {
                return (0.3 + share(links, i).abs()) * (k * Q(m, i) + phase).cos();
              });
       }},
      {"meshing_pulses", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const double k = r.Uniform(15, 110), phase = r.Uniform(0, 6);
         Make(e, {"meshing_friction"}, {"q", "sgn(qd)"}, AnyJoint(r),
              [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return S(m, i) * (2 * (k * Q(m, i) + phase).cos() - 2).exp();
              });
       }},
      {"eccentric_wheel", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const double k = r.Uniform(2, 6), p1 = r.Uniform(0, 6), p2 = r.Uniform(0, 6);
         Make(e, {"torque_ripple", "position_torque", "cable_pack", "unknown"}, {"q"}, AnyJoint(r),
              [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return (k * Q(m, i) + p1).cos() + 0.3 * (2 * k * Q(m, i) + p2).cos();
              });
       }},
      {"hose_comes_tight", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const double from = r.Uniform(0, 0.6), side = r.Uniform(0, 1) < 0.5 ? -1 : 1;
         Make(e, kPositionTorque, {"q"}, AnyJoint(r), [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           return side * (side * Q(m, i) - from).max(0).pow(1.5);
         });
       }},
      {"tight_spot", true, true,
       [](const Arm&, Random& r, Effect& e) {
         const double at = r.Uniform(-0.8, 0.8), width = r.Uniform(0.15, 0.5);
         Make(e, {"position_friction", "load_friction", "unknown"}, {"q", "sgn(qd)"}, AnyJoint(r),
              [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return S(m, i) / (1 + ((Q(m, i) - at) / width).square());
              });
       }},
      {"grease_pool", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const double at = r.Uniform(-0.6, 0.6), width = r.Uniform(0.2, 0.6);
         Make(e, {"position_viscous", "unknown"}, {"q", "qd"}, AnyJoint(r),
              [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return V(m, i) * ((Q(m, i) - at) / width).tanh();
              });
       }},
      {"gas_strut", true, true,  // its pressure rises as it is pushed in
       [](const Arm&, Random& r, Effect& e) {
         const double crank = r.Uniform(0.2, 0.35), anchor = r.Uniform(0.7, 1), top = r.Uniform(-0.5, 0.5);
         Make(e, kPositionTorque, {"q"}, 1, [=](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
           const ArrayXd angle = Q(m, i) - top;
           const ArrayXd length = (crank * crank + anchor * anchor - 2 * crank * anchor * angle.cos()).sqrt();
           return (length - anchor + crank + 0.3).pow(-1.2) * angle.sin() / length;
         });
       }},
      {"one_way_cam", false, true,  // a torque over position that acts in one direction of motion only
       [](const Arm&, Random& r, Effect& e) {
         Make(e, {}, {"q", "sgn(qd)"}, AnyJoint(r),
              [bumps = Bumps(r)](const Motion& m, const MatrixXd&, int i) -> ArrayXd {
                return bumps(Q(m, i)) * 0.5 * (1 + S(m, i));
              });
       }},
      {"gain_by_sign", false, true,  // an amplifier whose halves differ
       [](const Arm&, Random& r, Effect& e) {
         Make(e, {}, {"load"}, AnyJoint(r, 3),
              [share = LoadShare{}](const Motion&, const MatrixXd& links, int i) -> ArrayXd {
                return share(links, i).abs();
              });
       }},
      {"soft_saturation", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         const auto early = e.Strength(2, 10);
         Make(e, {"torque_saturation", "torque_gain_error", "load_friction"}, {"load"}, AnyJoint(r, 3),
              [&a, early](const Motion& m, const MatrixXd& links, int i) -> ArrayXd {
                const ArrayXd tau = links.col(i).array() + a.coulomb[i] * S(m, i) + a.viscous[i] * V(m, i);
                const double edge = a.torque_limit[i] / *early;
                const ArrayXd beyond = (tau.abs() - edge).max(0);
                return -tau.sign() * beyond.square() / (beyond + 0.2 * edge);
              });
       }},
  };
}

}  // namespace

const std::vector<Form>& JointForms() {
  static const std::vector<Form> forms = [] {
    std::vector<Form> all = FrictionForms();
    for (const auto& more : {TemperatureForms(), PositionForms()}) all.insert(all.end(), more.begin(), more.end());
    return all;
  }();
  return forms;
}

}  // namespace armcal::judged
