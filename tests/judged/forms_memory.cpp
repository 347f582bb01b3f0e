// judged set - makes the forms of one joint with memory: hysteresis, play, springs between motor and link.
#include <algorithm>
#include <cmath>

#include "tests/judged/forms.hpp"

namespace armcal::judged {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using plant::Random;

namespace {

constexpr double kStep_s = 1e-4;

// The inertia of all that a joint moves, at each sample; links only.
VectorXd InertiaAbout(const Arm& arm, const Motion& m, int joint) {
  const int every = std::max(1, static_cast<int>(0.05 / (m.t[1] - m.t[0])));
  plant::Dynamics dynamics(arm.robot, arm.bodies, arm.robot.gravity_mps2);
  VectorXd out(m.samples()), bias(arm.joints());
  MatrixXd mass(arm.joints(), arm.joints());
  for (int k = 0; k < m.samples(); ++k) {
    if (k % every == 0) dynamics.MassAndBias(m.q.row(k).transpose(), VectorXd::Zero(arm.joints()), mass, bias);
    out[k] = mass(joint, joint);
  }
  return out;
}

// What a joint's load changes by where its link stands a little further, N m/rad.
VectorXd LoadSlope(const Arm& arm, const Motion& m, const MatrixXd& links, int joint) {
  constexpr double kStep_rad = 1e-4;
  Motion moved = m;
  moved.q.col(joint).array() += kStep_rad;
  return (LinkTorque(arm, moved).col(joint) - links.col(joint)) / kStep_rad;
}

double AtRest(const GearLaw& law, double load_Nm, double slope_Nmprad) {
  double low = -0.3, high = 0.3;  // a gear's torque falls as the link runs ahead
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (law(middle, 0) > load_Nm + slope_Nmprad * middle ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

struct Cells {
  std::vector<double> share, length_rad;
};
Cells DrawCells(Random& r, int count) {
  Cells c;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    c.share.push_back(r.Uniform(0.3, 1)), sum += c.share.back();
    c.length_rad.push_back(0.002 * std::pow(50, r.Uniform(0, 1)));
  }
  for (double& s : c.share) s /= sum;
  return c;
}

// Elastic cells that slip at their level (Maxwell); z of all together, 1 while sliding.
ArrayXd Slip(const Cells& cells, const ArrayXd& q) {
  ArrayXd z = ArrayXd::Zero(q.size());
  for (std::size_t i = 0; i < cells.share.size(); ++i) {
    double now = 0;
    for (Eigen::Index k = 1; k < q.size(); ++k) {
      now = std::clamp(now + (q[k] - q[k - 1]) / cells.length_rad[i], -1.0, 1.0);
      z[k] += cells.share[i] * now;
    }
  }
  return z;
}

// Cells whose level follows the speed and is approached at a rate once they slip (generalized Maxwell slip).
ArrayXd GeneralizedSlip(const Cells& cells, const Motion& m, int j, double more, double slow, double rate) {
  ArrayXd z = ArrayXd::Zero(m.samples());
  constexpr int kParts = 10;
  const double h = (m.t[1] - m.t[0]) / kParts;
  for (std::size_t i = 0; i < cells.share.size(); ++i) {
    double now = 0;
    for (int k = 1; k < m.samples(); ++k) {
      const double v = m.qd(k, j), level = 1 + more * std::exp(-std::abs(v) / slow);
      for (int p = 0; p < kParts; ++p) {
        const double to = std::copysign(level, v);
        if (std::abs(now) < level || now * v < 0) now = std::clamp(now + h * v / cells.length_rad[i], -level, level);
        else now += std::min(1.0, h * rate) * (to - now);
      }
      z[k] += cells.share[i] * now;
    }
  }
  return z;
}

const std::vector<std::string> kHysteresis{"hysteresis", "presliding_dahl", "presliding_lugre"};
const std::vector<std::string> kElastic{"belt_elasticity", "time_delay"};

void OnGear(Effect& e, int j, std::vector<std::string> accept,
            const std::function<MatrixXd(const Motion&, const MatrixXd&)>& torque) {
  e.accept = std::move(accept), e.held_by_a_record = false;
  e.joint = j + 1, e.seen_on = j, e.signals = {Signal("qdd", j), Signal("load", j), Signal("q", j)};
  e.torque = torque;
}

std::vector<Form> SlipForms() {
  return {
      {"maxwell_cells", true, false,
       [](const Arm&, Random& r, Effect& e) {
         e.accept = kHysteresis, e.signals = {"qd", "q"}, e.held_by_a_record = false;
         OnJoint(e, static_cast<int>(r.Uniform(0, 5.999)),
                 [cells = DrawCells(r, 8)](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
                   return Slip(cells, Q(m, j)) - S(m, j);
                 });
       }},
      {"maxwell_cells_of_load", true, true,  // the levels rise with the load
       [](const Arm&, Random& r, Effect& e) {
         e.accept = kHysteresis, e.accept.push_back("load_friction");
         e.signals = {"qd", "q", "load"}, e.held_by_a_record = false;
         OnJoint(e, static_cast<int>(r.Uniform(0, 2.999)),
                 [cells = DrawCells(r, 6), largest = LargestLoad()](const Motion& m, const MatrixXd& links,
                                                                    int j) -> ArrayXd {
                   const ArrayXd load = links.col(j);
                   return (0.4 + (load / largest(load)).abs()) * Slip(cells, Q(m, j)) - 0.4 * S(m, j);
                 });
       }},
      {"generalized_maxwell", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         e.accept = kHysteresis;
         for (const char* s : {"stribeck", "viscous_cuberoot", "stribeck_basis"}) e.accept.push_back(s);
         e.signals = {"qd", "q"}, e.held_by_a_record = false;
         const int joint = static_cast<int>(r.Uniform(0, 5.999));
         const double more = r.Uniform(0.2, 0.6), slow = 0.04 * a.speed[joint], rate = r.Uniform(5, 20);
         OnJoint(e, joint, [=, cells = DrawCells(r, 5)](const Motion& m, const MatrixXd&, int j) -> ArrayXd {
           return GeneralizedSlip(cells, m, j, more, slow, rate) - S(m, j);
         });
       }},
  };
}

GearLaw Gap(double play_rad, double k, double c) {
  return [=](double y, double rate) {
    const double in = std::abs(y) - 0.5 * play_rad;
    return in > 0 ? -std::copysign(k * in, y) - c * rate : 0.0;
  };
}

std::vector<Form> GearForms() {
  return {
      {"play", true, false,  // the link falls through a gap at each change of its load's sign
       [](const Arm& a, Random& r, Effect& e) {
         const int j = static_cast<int>(r.Uniform(0, 5.999));
         const double w = 2 * kPi * r.Uniform(20, 40);
         const auto play = e.Strength(0.002, 0.03);
         OnGear(e, j, {"backlash", "belt_elasticity"}, [=, &a](const Motion& m, const MatrixXd& links) {
           return BehindGear(a, m, links, j, [=](double M) { return Gap(*play, w * w * M, 0.6 * w * M); });
         });
       }},
      {"play_of_soft_teeth", true, true,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = static_cast<int>(r.Uniform(0, 5.999));
         const double w = 2 * kPi * r.Uniform(10, 20);
         const auto play = e.Strength(0.002, 0.03);
         OnGear(e, j, {"backlash", "belt_elasticity"}, [=, &a](const Motion& m, const MatrixXd& links) {
           return BehindGear(a, m, links, j, [=](double M) -> GearLaw {
             return [=](double y, double rate) {  // stiffness falls smoothly to a tenth inside the play
               const double soft = y / (0.5 * *play);
               return -w * w * M * y * (1 - 0.9 / (1 + soft * soft)) - 0.4 * w * M * rate;
             };
           });
         });
       }},
      {"two_masses", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = static_cast<int>(r.Uniform(0, 2.999));
         const double damping = r.Uniform(0.02, 0.1);
         const auto softness = e.Strength(1 / std::pow(2 * kPi * 12, 2), 1 / std::pow(2 * kPi * 4.5, 2));  // 1 / w^2
         OnGear(e, j, kElastic, [=, &a](const Motion& m, const MatrixXd& links) {
           return BehindGear(a, m, links, j, [=](double M) -> GearLaw {
             const double k = M / *softness, c = 2 * damping * M / std::sqrt(*softness);
             return [=](double y, double rate) { return -k * y - c * rate; };
           });
         });
       }},
      {"two_masses_stiffening", true, true,
       [](const Arm& a, Random& r, Effect& e) {
         const int j = static_cast<int>(r.Uniform(0, 2.999));
         const double damping = r.Uniform(0.02, 0.1), from = r.Uniform(0.002, 0.01);
         const auto softness = e.Strength(1 / std::pow(2 * kPi * 12, 2), 1 / std::pow(2 * kPi * 4.5, 2));
         OnGear(e, j, kElastic, [=, &a](const Motion& m, const MatrixXd& links) {
           return BehindGear(a, m, links, j, [=](double M) -> GearLaw {
             const double k = M / *softness, c = 2 * damping * M / std::sqrt(*softness);
             return [=](double y, double rate) { return -k * y * (1 + y * y / (from * from)) - c * rate; };
           });
         });
       }},
      {"deflection_under_load", true, false,  // quasi-static: the link hangs where its load bends the gear to
       [](const Arm& a, Random& r, Effect& e) {
         const int j = 1 + static_cast<int>(r.Uniform(0, 1.999));
         const double stiffening = r.Uniform(0.5, 2);
         const auto bend_rad = e.Strength(0.01, 0.06);  // at the largest load
         OnGear(e, j, {"belt_elasticity", "joint_compliance"},
                [=, &a, largest = LargestLoad()](const Motion& m, const MatrixXd& links) {
                  const ArrayXd load = links.col(j).array() / largest(links.col(j));
                  Motion moved = m;
                  moved.q.col(j).array() -= *bend_rad * (1 + stiffening) * load / (1 + stiffening * load.abs());
                  return MatrixXd(LinkTorque(a, moved) - links);
                });
       }},
  };
}

}  // namespace

MatrixXd BehindGear(const Arm& arm, const Motion& m, const MatrixXd& links, int joint,
                    const std::function<GearLaw(double inertia_kgm2)>& law) {
  const VectorXd inertia = InertiaAbout(arm, m, joint), stiffness = LoadSlope(arm, m, links, joint);
  const GearLaw gear = law(inertia.mean());
  const int parts = static_cast<int>(std::ceil((m.t[1] - m.t[0]) / kStep_s));
  const double h = (m.t[1] - m.t[0]) / parts;
  Motion moved = m;
  VectorXd passed(m.samples());
  double y = AtRest(gear, links(0, joint), stiffness[0]), rate = 0;
  for (int k = 0; k < m.samples(); ++k) {
    const double torque = gear(y, rate);
    passed[k] = torque;
    moved.q(k, joint) += y, moved.qd(k, joint) += rate;
    moved.qdd(k, joint) += (torque - links(k, joint) - stiffness[k] * y) / inertia[k];
    if (k + 1 == m.samples()) break;
    const double slope = (links(k + 1, joint) - links(k, joint)) / parts;
    for (int i = 0; i < parts; ++i) {
      rate += h * (gear(y, rate) - links(k, joint) - slope * i - stiffness[k] * y) / inertia[k];
      y += h * rate;
    }
  }
  MatrixXd out = LinkTorque(arm, moved) - links;
  out.col(joint) = passed - links.col(joint);
  return out;
}

const std::vector<Form>& MemoryForms() {
  static const std::vector<Form> forms = [] {
    std::vector<Form> all = SlipForms();
    for (const Form& f : GearForms()) all.push_back(f);
    return all;
  }();
  return forms;
}

}  // namespace armcal::judged
