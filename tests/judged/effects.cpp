// judged set - computes the effects, one function each.
#include "tests/judged/effects.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace armcal::judged {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

using Maker = std::function<void(const Arm& arm, plant::Random& random, Effect& effect)>;
constexpr int kHeavy = 3;  // joints that carry more than noise

// On one joint by chance, one of the first `joints`.
void OnJoint(const Arm& arm, plant::Random& random, Effect& e, const Curve& curve, int joints = 0) {
  OnJoint(e, static_cast<int>(random.Uniform(0, (joints ? joints : arm.joints()) - 1e-9)), curve);
}

// Dahl's bristles: dz/dt = v (1 - sgn(v) z), z in units of the sliding level.
ArrayXd Bristles(const Motion& m, int j, double length_rad, double power) {
  ArrayXd z(m.samples());
  double now = 0;
  for (Index k = 0; k < z.size(); ++k) {
    if (k > 0) {
      const double step = m.q(k, j) - m.q(k - 1, j);
      constexpr int kParts = 20;
      for (int i = 0; i < kParts; ++i) {
        const double dq = step / kParts, against = std::clamp(1 - std::copysign(now, dq > 0 ? now : -now), 0.0, 2.0);
        now += dq / length_rad * std::pow(against, power);
      }
      now = std::clamp(now, -1.0, 1.0);
    }
    z[k] = now;
  }
  return z;
}

// What a mass does on a spring and a damper whose other end moves as u does; w rad/s, d of the critical damping; small
// steps. Before the start u runs as its own mirror image does, until what the beginning rang has died out.
ArrayXd OnSpring(const ArrayXd& u, double step_s, double w, double d) {
  ArrayXd y(u.size());
  const Index before = std::min(u.size() - 2, static_cast<Index>(8 / (d * w * step_s)));
  const auto at = [&](Index k) { return k < 0 ? 2 * u[0] - u[-k] : u[k]; };
  double x = at(-before), v = (at(1 - before) - x) / step_s;
  for (Index k = -before; k < u.size(); ++k) {
    const double from = at(std::max(-before, k - 1)), rate = (at(k) - from) / step_s;
    constexpr int kParts = 10;
    for (int i = 1; i <= kParts; ++i) {
      const double h = step_s / kParts, now = from + rate * h * i;
      v += h * (w * w * (now - x) + 2 * d * w * (rate - v));
      x += h * v;
    }
    if (k >= 0) y[k] = x;
  }
  return y;
}

const std::map<std::string, Maker>& Makers() {
  static const std::map<std::string, Maker> makers = {
      {"coulomb_asymmetry",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.factor = "dFc";
         e.accept = {"coulomb_asymmetry", "torque_offset"}, e.signals = {"sgn(qd)"};
         OnJoint(a, r, e, [](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return 0.5 * (1 + S(m, j)); });
       }},
      {"viscous_asymmetry",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.factor = "dFv";
         e.signals = {"qd"};
         OnJoint(a, r, e, [](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return V(m, j) + V(m, j).abs(); });
       }},
      {"stribeck",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"stribeck", "viscous_cuberoot"}, e.signals = {"qd"}, e.held_by_a_record = false;
         const double share = r.Uniform(0.03, 0.08);
         OnJoint(a, r, e, [&a, share](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return S(m, j) / (1 + (V(m, j) / (share * a.speed[j])).square());
         });
       }},
      {"viscous_quadratic",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.factor = "Fv2";
         e.accept = {"viscous_quadratic", "viscous_cubic"}, e.signals = {"qd"};
         OnJoint(a, r, e, [](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return V(m, j) * V(m, j).abs(); });
       }},
      {"viscous_cubic",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"viscous_quadratic", "viscous_cubic"}, e.signals = {"qd"}, e.held_by_a_record = false;
         OnJoint(a, r, e,
                 [](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return S(m, j) * V(m, j).abs().pow(2.7); });
       }},
      {"viscous_cuberoot",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.factor = "f1";
         e.accept = {"stribeck", "viscous_cuberoot"}, e.signals = {"qd"};
         OnJoint(a, r, e, [](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return V(m, j).sign() * V(m, j).abs().pow(1.0 / 3);
         });
       }},
      {"load_friction",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"load_friction", "position_friction"}, e.signals = {"load", "sgn(qd)"}, e.held_by_a_record = false;
         OnJoint(
             a, r, e,
             [largest = LargestLoad()](const Motion& m, const MatrixXd& links, int j) -> ArrayXd {
               const ArrayXd load = links.col(j);
               const double preload = 0.1 * largest(load);
               return ((load.square() + preload * preload).sqrt() - preload) * S(m, j);
             },
             kHeavy);
       }},
      {"temp_viscous",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"temp_viscous", "time_varying_viscous"}, e.signals = {"temp", "qd"};
         e.held_by_a_record = false, e.needs_temperature = true;
         OnJoint(a, r, e, [](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return V(m, j) * (700 / (m.temp.col(j).array() + 60) - 700.0 / 90).exp();
         });
       }},
      {"temp_coulomb",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"temp_coulomb", "time_varying_coulomb"}, e.signals = {"temp", "sgn(qd)"},
         e.needs_temperature = true;
         OnJoint(a, r, e, [](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return (30 - m.temp.col(j).array()) * S(m, j);
         });
       }},
      {"time_varying_viscous",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"time_varying_viscous", "temp_viscous"}, e.signals = {"t", "qd"}, e.run_state = true;
         const double constant = r.Uniform(8, 30);
         OnJoint(a, r, e, [constant](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return V(m, j) * (-m.t.array() / constant).exp();
         });
       }},
      {"time_varying_coulomb",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"time_varying_coulomb", "temp_coulomb"}, e.signals = {"t", "sgn(qd)"}, e.run_state = true;
         const double constant = r.Uniform(8, 30);
         OnJoint(a, r, e, [constant](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return S(m, j) * (-m.t.array() / constant).exp();
         });
       }},
      {"torque_drift",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.signals = {"t"}, e.run_state = true;
         const double constant = r.Uniform(8, 30);
         OnJoint(a, r, e, [constant](const Motion& m, const MatrixXd&, int) -> ArrayXd {
           return 1 - (-m.t.array() / constant).exp();
         });
       }},
      {"torque_ripple",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.signals = {"q"};
         const double per_turn = std::floor(r.Uniform(1, 2.99)), phase = r.Uniform(0, 2 * kPi);
         const bool free = r.Uniform(0, 1) < 0.4;
         const double other = r.Uniform(15, 140);
         OnJoint(a, r, e, [&a, per_turn, phase, free, other](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return ((free ? other : per_turn * a.gear[j]) * Q(m, j) + phase).cos();
         });
       }},
      {"meshing_friction",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.signals = {"q", "sgn(qd)"};
         const double k = r.Uniform(15, 120), phase = r.Uniform(0, 2 * kPi);
         e.others = {{"k", k}};
         OnJoint(a, r, e, [k, phase](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return (k * Q(m, j) + phase).cos() * S(m, j);
         });
       }},
      {"gravity_spring",
       [](const Arm& a, plant::Random& r, Effect& e) {
         const double crank = r.Uniform(0.2, 0.4), anchor = r.Uniform(0.7, 1), free = r.Uniform(0.3, 0.6),
                      top = r.Uniform(-0.5, 0.5);
         (void)a;
         e.accept = {"gravity_spring", "position_torque", "cable_pack"}, e.signals = {"q2"};
         e.joint = 2, e.seen_on = 1;
         e.torque = [=](const Motion& m, const MatrixXd& links) {
           MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
           const ArrayXd angle = Q(m, 1) - top;
           const ArrayXd length = (crank * crank + anchor * anchor - 2 * crank * anchor * angle.cos()).sqrt();
           tau.col(1) = (1 - free / length) * angle.sin();
           return tau;
         };
       }},
      {"cable_pack",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"cable_pack", "position_torque", "gravity_spring"}, e.signals = {"q"}, e.held_by_a_record = false;
         const double neutral = r.Uniform(-0.4, 0.4), stiffening = r.Uniform(0.7, 1.2);
         OnJoint(a, r, e, [=](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return ((Q(m, j) - neutral) / stiffening).sinh();
         });
       }},
      {"position_torque",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"position_torque", "cable_pack", "gravity_spring", "unknown"}, e.signals = {"q"};
         e.held_by_a_record = false;
         const auto bumps = Bumps(r);
         OnJoint(a, r, e, [bumps](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return bumps(Q(m, j)); });
       }},
      {"position_friction",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"position_friction", "load_friction", "unknown"}, e.signals = {"q", "sgn(qd)"};
         e.held_by_a_record = false;
         const auto bumps = Bumps(r);
         OnJoint(a, r, e,
                 [bumps](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return bumps(Q(m, j)) * S(m, j); });
       }},
      {"position_viscous",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"position_viscous", "unknown"}, e.signals = {"q", "qd"}, e.held_by_a_record = false;
         const auto bumps = Bumps(r);
         OnJoint(a, r, e,
                 [bumps](const Motion& m, const MatrixXd&, int j) -> ArrayXd { return bumps(Q(m, j)) * V(m, j); });
       }},
      {"presliding_dahl",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"presliding_dahl", "presliding_lugre"}, e.signals = {"qd"};
         const double length = r.Uniform(0.008, 0.04);
         OnJoint(a, r, e, [length](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return Bristles(m, j, length, 1) - S(m, j);
         });
       }},
      {"cross_ripple",
       [](const Arm& a, plant::Random& r, Effect& e) {
         const int j = static_cast<int>(r.Uniform(0, 5.999)), of = (j + 1 + static_cast<int>(r.Uniform(0, 4.999))) % 6;
         const double k = r.Uniform(15, 80), phase = r.Uniform(0, 2 * kPi);
         e.others = {{"w", k}};
         e.joint = {j + 1, of + 1}, e.seen_on = j, e.signals = {Signal("q", of)};
         (void)a;
         e.torque = [=](const Motion& m, const MatrixXd& links) {
           MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
           tau.col(j) = (k * Q(m, of) + phase).cos();
           return tau;
         };
       }},
      {"wrist_coupling",
       [](const Arm& a, plant::Random& r, Effect& e) {
         const double ratio = r.Uniform(0.3, 0.9);
         e.joint = "5-6", e.seen_on = 5, e.signals = {"qd5", "qd6"}, e.accept = {"wrist_coupling", "coupled_friction"};
         (void)a;
         e.torque = [ratio](const Motion& m, const MatrixXd& links) {
           MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
           const ArrayXd slip = V(m, 5) + ratio * V(m, 4), friction = Sign(slip) + 0.3 * slip;
           tau.col(5) = friction, tau.col(4) = ratio * friction;
           return tau;
         };
       }},
      {"velocity_product",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.factor = "c";
         const int j = static_cast<int>(r.Uniform(0, 4.999));
         e.joint = {j + 1, j + 2}, e.seen_on = j, e.signals = {Signal("qd", j), Signal("qd", j + 1)};
         (void)a;
         e.torque = [j](const Motion& m, const MatrixXd& links) {
           MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
           tau.col(j) = V(m, j) * V(m, j + 1);
           return tau;
         };
       }},
      {"payload_step",
       [](const Arm& a, plant::Random& r, Effect& e) {
         plant::Body body;
         body.mass_kg = 1;
         body.center_m = {r.Uniform(-0.05, 0.05), r.Uniform(-0.05, 0.05), r.Uniform(0.08, 0.2)};
         body.inertia_kgm2 = {0.004, 0, 0, 0.004, 0, 0.003};
         const double from = r.Uniform(8, 18);
         e.joint = "flange", e.seen_on = 1, e.signals = {"t", "link6"}, e.run_state = true;
         e.torque = [&a, body, from](const Motion& m, const MatrixXd&) {
           MatrixXd tau = PayloadTorque(a, m, body);
           for (Index k = 0; k < tau.rows(); ++k)
             if (m.t[k] < from) tau.row(k).setZero();
           return tau;
         };
       }},
      {"base_tilt",
       [](const Arm& a, plant::Random& r, Effect& e) {
         const double angle = 1e-3, about = r.Uniform(0, 2 * kPi);
         e.joint = "base", e.seen_on = 1, e.signals = {"q1"};
         e.torque = [&a, angle, about](const Motion& m, const MatrixXd& links) {
           const KDL::Vector turned(9.81 * std::sin(angle) * std::cos(about), 9.81 * std::sin(angle) * std::sin(about),
                                    -9.81 * std::cos(angle));
           return MatrixXd(LinkTorque(a, m, turned) - links);
         };
       }},
      {"belt_elasticity",  // the link follows the motor, whose position is logged, through a spring
       [](const Arm& a, plant::Random& r, Effect& e) {
         const int j = static_cast<int>(r.Uniform(0, 2.999));  // those whose motors stand apart
         e.accept = {"belt_elasticity", "time_delay"}, e.joint = j + 1, e.seen_on = j, e.held_by_a_record = false;
         e.signals = {Signal("qdd", j)};
         const double damping = r.Uniform(0.02, 0.1);
         const auto softness = e.Strength(1 / std::pow(2 * kPi * 10, 2), 1 / std::pow(2 * kPi * 4.5, 2));  // 1 / w^2
         e.torque = [&a, j, softness, damping](const Motion& m, const MatrixXd& links) {
           Motion moved = m;
           const double h = m.t[1] - m.t[0], w = 1 / std::sqrt(*softness);
           moved.q.col(j) = OnSpring(Q(m, j), h, w, damping);
           moved.qd.col(j) = OnSpring(V(m, j), h, w, damping);
           moved.qdd.col(j) = OnSpring(m.qdd.col(j), h, w, damping);
           return MatrixXd(LinkTorque(a, moved) - links);
         };
       }},
      {"torque_saturation",
       [](const Arm& a, plant::Random& r, Effect& e) {
         e.accept = {"torque_saturation", "torque_gain_error", "load_friction"}, e.signals = {"load"};
         const auto early = e.Strength(1.5, 8);  // torque limit over the torque at which the amplifier saturates
         OnJoint(a, r, e, [&a, early](const Motion& m, const MatrixXd& links, int j) -> ArrayXd {
           const ArrayXd tau = links.col(j).array() + a.coulomb[j] * S(m, j) + a.viscous[j] * V(m, j);
           const double edge = a.torque_limit[j] / *early;
           return tau.max(-edge).min(edge) - tau;
         });
       }},
      {"time_delay",
       [](const Arm& a, plant::Random&, Effect& e) {
         const auto delay_s = e.Strength(0.005, 0.02);
         e.joint = "all", e.seen_on = 1, e.signals = {"time shift"};
         e.torque = [&a, delay_s](const Motion& m, const MatrixXd& links) {
           MatrixXd tau = links;
           for (int j = 0; j < a.joints(); ++j)
             tau.col(j).array() += a.coulomb[j] * S(m, j) + a.viscous[j] * V(m, j) + a.rotor[j] * m.qdd.col(j).array();
           const double h = m.t[1] - m.t[0], whole = *delay_s / h;
           MatrixXd out(tau.rows(), tau.cols());
           for (Index k = 0; k < tau.rows(); ++k) {
             const double at = std::max(0.0, static_cast<double>(k) - whole);
             const auto below = static_cast<Index>(at);
             const double share = at - static_cast<double>(below);
             out.row(k) =
                 (1 - share) * tau.row(below) + share * tau.row(std::min(below + 1, tau.rows() - 1)) - tau.row(k);
           }
           return out;
         };
       }},
      {"external_contact",
       [](const Arm& a, plant::Random& r, Effect& e) {
         double at[3], length[3];
         for (int k = 0; k < 3; ++k) at[k] = r.Uniform(3, 36), length[k] = r.Uniform(0.15, 0.5);
         e.signals = {"t"}, e.run_state = true;
         OnJoint(a, r, e,
                 [at0 = at[0], at1 = at[1], at2 = at[2], l0 = length[0], l1 = length[1], l2 = length[2]](
                     const Motion& m, const MatrixXd&, int) -> ArrayXd {
                   ArrayXd out = ArrayXd::Zero(m.samples());
                   const double begin[] = {at0, at1, at2}, span[] = {l0, l1, l2};
                   for (int k = 0; k < 3; ++k) {
                     const ArrayXd u = (m.t.array() - begin[k]) / span[k];
                     out += (u > 0 && u < 1).select((kPi * u).sin(), 0);
                   }
                   return out;
                 });
       }},
  };
  return makers;
}

}  // namespace

void OnJoint(Effect& e, int j, const Curve& curve) {
  e.joint = j + 1, e.seen_on = j;
  for (std::string& s : e.signals)
    s = s == "sgn(qd)" ? Signal("sgn(qd", j) + ")" : std::isalpha(s.back()) ? Signal(s, j) : s;
  e.torque = [curve, j](const Motion& m, const MatrixXd& links) {
    MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
    tau.col(j) = curve(m, links, j);
    return tau;
  };
}

std::function<ArrayXd(const ArrayXd&)> Bumps(plant::Random& random) {
  double at[3], height[3];
  const double width = random.Uniform(0.25, 0.6);
  for (int k = 0; k < 3; ++k) at[k] = random.Uniform(-1.2, 1.2), height[k] = random.Uniform(-1, 1);
  return [=](const ArrayXd& q) {
    ArrayXd out = ArrayXd::Zero(q.size());
    for (int k = 0; k < 3; ++k) out += height[k] * (-((q - at[k]) / width).square()).exp();
    return out;
  };
}

std::function<double(const ArrayXd& load)> LargestLoad() {
  return [most = std::make_shared<double>(0)](const ArrayXd& load) {
    if (*most == 0) *most = load.abs().maxCoeff();
    return *most;
  };
}

const std::vector<std::string>& Kinds() {
  static const std::vector<std::string> kinds = [] {
    std::vector<std::string> out;
    for (const auto& [kind, make] : Makers()) out.push_back(kind);
    return out;
  }();
  return kinds;
}

Effect DrawEffect(const std::string& kind, const Arm& arm, plant::Random& random) {
  Effect e;
  e.kind = kind;
  Makers().at(kind)(arm, random, e);
  if (e.accept.empty()) e.accept = {kind};
  return e;
}

Effect DrawUnknown(const Arm& arm, plant::Random& random) {
  Effect e;
  e.kind = "unknown", e.accept = {"unknown"}, e.held_by_a_record = false;
  const double place = random.Uniform(0.25, 0.6), width = random.Uniform(0.04, 0.1);
  switch (static_cast<int>(random.Uniform(0, 4.999))) {
    case 0:  // a resonance that one speed excites
      e.signals = {"qd"};
      OnJoint(arm, random, e, [&arm, place, width](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
        const ArrayXd u = V(m, j).abs() / arm.speed[j];
        return S(m, j) * (-((u - place) / width).square()).exp();
      });
      break;
    case 1: {  // what one joint's pose does to another's torque
      const int j = static_cast<int>(random.Uniform(0, 5.999)), of = (j + 2) % 6;
      const auto bumps = Bumps(random);
      e.joint = j + 1, e.seen_on = j, e.signals = {Signal("q", of)};
      e.torque = [j, of, bumps](const Motion& m, const MatrixXd& links) {
        MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
        tau.col(j) = bumps(Q(m, of));
        return tau;
      };
      break;
    }
    case 2: {  // friction that another joint's pose changes: a squeezed cable
      const int j = static_cast<int>(random.Uniform(0, 5.999)), of = (j + 1) % 6;
      const auto bumps = Bumps(random);
      e.joint = j + 1, e.seen_on = j, e.signals = {Signal("q", of), "sgn(" + Signal("qd", j) + ")"};
      e.torque = [j, of, bumps](const Motion& m, const MatrixXd& links) {
        MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
        tau.col(j) = bumps(Q(m, of)) * S(m, j);
        return tau;
      };
      break;
    }
    case 3:  // a gear that loses more beyond a load
      e.signals = {"load"};
      OnJoint(
          arm, random, e,
          [place, largest = LargestLoad()](const Motion&, const MatrixXd& links, int j) -> ArrayXd {
            const ArrayXd u = links.col(j).array() / largest(links.col(j));
            return (u.abs() - place).max(0) * u;
          },
          kHeavy);
      break;
    default:  // a detent: sharp steps of position
      e.signals = {"q"};
      OnJoint(arm, random, e, [place](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
        return (8 * (Q(m, j) - 2 * place)).tanh() - (8 * (Q(m, j) - 2 * place - 0.5)).tanh();
      });
  }
  return e;
}

}  // namespace armcal::judged
