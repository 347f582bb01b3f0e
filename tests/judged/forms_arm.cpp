// judged set - makes the forms of several joints, the flange or the base, and lists all forms.
#include <algorithm>
#include <cmath>

#include "tests/judged/forms.hpp"

namespace armcal::judged {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;
using plant::Random;

namespace {

// Joint `j` and another one at least `apart` away.
std::pair<int, int> TwoJoints(Random& r, int apart = 1) {
  for (;;) {
    const int j = static_cast<int>(r.Uniform(0, 5.999)), of = static_cast<int>(r.Uniform(0, 5.999));
    if (std::abs(j - of) >= apart) return {j, of};
  }
}

using PairCurve = std::function<ArrayXd(const Motion& m, const MatrixXd& links)>;
// On joint j over what `of` does; a term of the pair says the same.
void OnOther(Effect& e, int j, int of, std::vector<std::string> accept, std::vector<std::string> signals,
             const PairCurve& curve) {
  OnJoint(e, j, [curve](const Motion& m, const MatrixXd& links, int) { return curve(m, links); });
  e.joint = j + 1, e.also_joints = {{j + 1, of + 1}};
  e.accept = std::move(accept), e.signals = std::move(signals), e.held_by_a_record = false;
}

// What a force at the flange, in the base frame, asks of the joints: [samples x joints].
MatrixXd HoldForce(const Arm& arm, const Motion& m,
                   const std::function<KDL::Vector(int k, const KDL::Vector& flange)>& force) {
  const int n = arm.joints();
  MatrixXd tau(m.samples(), n);
  std::vector<KDL::Frame> frame(static_cast<std::size_t>(n));
  for (int k = 0; k < m.samples(); ++k) {
    KDL::Frame now = KDL::Frame::Identity();
    for (int j = 0; j < n; ++j) {
      const plant::JointData& d = arm.robot.joint[static_cast<std::size_t>(j)];
      now = now * KDL::Frame::DH_Craig1989(d.a_m, d.alpha_rad, d.d_m, d.theta_rad + m.q(k, j));
      frame[static_cast<std::size_t>(j)] = now;
    }
    const KDL::Vector at = now * KDL::Vector(0, 0, 0.1), f = force(k, at);
    for (int j = 0; j < n; ++j) {
      const KDL::Frame& own = frame[static_cast<std::size_t>(j)];
      tau(k, j) = -KDL::dot(own.M.UnitZ(), (at - own.p) * f);
    }
  }
  return tau;
}

KDL::Vector Direction(Random& r) {
  const double about = r.Uniform(0, 2 * kPi), up = r.Uniform(-0.9, 0.9), flat = std::sqrt(1 - up * up);
  return {flat * std::cos(about), flat * std::sin(about), up};
}

void AtFlange(Effect& e, std::vector<std::string> accept, std::vector<std::string> signals) {
  e.joint = "flange", e.seen_on = 1, e.held_by_a_record = false;
  e.also_joints = {"all", 1, 2, 3, 4, 5, 6};  // a push is seen joint by joint
  e.accept = std::move(accept), e.signals = std::move(signals);
}

std::vector<Form> PairForms() {
  return {
      {"friction_by_other_load", false, false,
       [](const Arm&, Random& r, Effect& e) {
         const int of = 1 + static_cast<int>(r.Uniform(0, 1.999));
         int j = static_cast<int>(r.Uniform(0, 4.999));
         if (j >= of) ++j;
         OnOther(e, j, of, {}, {Signal("load", of), Signal("sgn(qd", j) + ")"},
                 [=, largest = LargestLoad()](const Motion& m, const MatrixXd& links) -> ArrayXd {
                   return links.col(of).array().abs() / largest(links.col(of)) * S(m, j);
                 });
       }},
      {"speed_product_far", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const auto [j, of] = TwoJoints(r, 2);
         OnOther(e, j, of, {"velocity_product"}, {Signal("qd", j), Signal("qd", of)},
                 [j = j, of = of](const Motion& m, const MatrixXd&) -> ArrayXd { return V(m, j) * V(m, of); });
       }},
      {"speed_product_saturating", false, true,
       [](const Arm& a, Random& r, Effect& e) {
         const auto [j, of] = TwoJoints(r);
         const double edge = 0.2 * a.speed[of];
         OnOther(e, j, of, {}, {Signal("qd", j), Signal("qd", of)},
                 [=, j = j, of = of](const Motion& m, const MatrixXd&) -> ArrayXd {
                   return V(m, j) * (V(m, of) / edge).tanh();
                 });
       }},
      {"position_product", false, false,
       [](const Arm&, Random& r, Effect& e) {
         const auto [j, of] = TwoJoints(r);
         const double phase = r.Uniform(0, 6);
         OnOther(e, j, of, {}, {Signal("q", j), Signal("q", of)},
                 [=, j = j, of = of, bumps = Bumps(r)](const Motion& m, const MatrixXd&) -> ArrayXd {
                   return bumps(Q(m, j)) * (1.7 * Q(m, of) + phase).sin();
                 });
       }},
      {"position_product_of_others", false, true,
       [](const Arm&, Random& r, Effect& e) {
         const auto [j, of] = TwoJoints(r);
         const int third =
             (std::max(j, of) + 1) % 6 == std::min(j, of) ? (std::max(j, of) + 3) % 6 : (std::max(j, of) + 1) % 6;
         OnOther(e, j, of, {}, {Signal("q", of), Signal("q", third)},
                 [=, of = of, f = Bumps(r), g = Bumps(r)](const Motion& m, const MatrixXd&) -> ArrayXd {
                   return f(Q(m, of)) * g(Q(m, third));
                 });
         e.also_joints.push_back({j + 1, third + 1});
       }},
      {"motor_coupling", false, true,  // one motor's oil drags the neighbour's
       [](const Arm& a, Random& r, Effect& e) {
         const auto [j, of] = TwoJoints(r);
         const double slow = 0.1 * a.speed[of];
         OnOther(e, j, of, {}, {Signal("qd", of)}, [=, of = of](const Motion& m, const MatrixXd&) -> ArrayXd {
           return V(m, of) / (1 + (V(m, of) / slow).abs().sqrt());
         });
       }},
      {"cross_cogging_saw", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const auto [j, of] = TwoJoints(r);
         const double k = r.Uniform(15, 80), p1 = r.Uniform(0, 6), p2 = r.Uniform(0, 6);
         OnOther(e, j, of, {"cross_ripple"}, {Signal("q", of)},
                 [=, of = of](const Motion& m, const MatrixXd&) -> ArrayXd {
                   return (k * Q(m, of) + p1).cos() + 0.3 * (2 * k * Q(m, of) + p2).cos();
                 });
       }},
      {"wrist_of_three", true, false,
       [](const Arm&, Random& r, Effect& e) {
         const double five = r.Uniform(0.3, 0.9), four = r.Uniform(0.2, 0.6);
         e.accept = {"wrist_coupling", "coupled_friction"}, e.held_by_a_record = false;
         e.joint = "5-6", e.also_joints = {{4, 6}, {4, 5}, "4-5-6"}, e.seen_on = 5;
         e.signals = {"qd4", "qd5", "qd6"};
         e.torque = [=](const Motion& m, const MatrixXd& links) {
           MatrixXd tau = MatrixXd::Zero(m.samples(), links.cols());
           const ArrayXd slip = V(m, 5) + five * V(m, 4) + four * V(m, 3), friction = Sign(slip) + 0.4 * slip;
           tau.col(5) = friction, tau.col(4) = five * friction, tau.col(3) = four * friction;
           return tau;
         };
       }},
  };
}

std::vector<Form> FlangeForms() {
  return {
      {"push_at_flange", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         AtFlange(e, {"external_contact", "payload_step"}, {"t"});
         e.run_state = true;
         const KDL::Vector along = Direction(r);
         const double at[] = {r.Uniform(3, 12), r.Uniform(14, 22), r.Uniform(24, 34)}, span = r.Uniform(0.5, 2);
         e.torque = [&a, along, span, a0 = at[0], a1 = at[1], a2 = at[2]](const Motion& m, const MatrixXd&) {
           return HoldForce(a, m, [&](int k, const KDL::Vector&) {
             double f = 0;
             for (const double from : {a0, a1, a2}) {
               const double u = (m.t[k] - from) / span;
               if (u > 0 && u < 1) f += std::pow(std::sin(kPi * u), 2);
             }
             return along * f;
           });
         };
       }},
      {"leaning_on_flange", true, true,  // a constant force for some seconds, put on and taken off within one
       [](const Arm& a, Random& r, Effect& e) {
         AtFlange(e, {"external_contact", "payload_step"}, {"t"});
         e.run_state = true;
         const KDL::Vector along = Direction(r);
         const double from = r.Uniform(5, 12), to = from + r.Uniform(5, 9);
         e.torque = [=, &a](const Motion& m, const MatrixXd&) {
           return HoldForce(a, m, [&](int k, const KDL::Vector&) {
             return along * (0.5 * (std::tanh(4 * (m.t[k] - from)) - std::tanh(4 * (m.t[k] - to))));
           });
         };
       }},
      {"hose_to_flange", true, false,  // a spring that pulls the flange to a point of the cell
       [](const Arm& a, Random& r, Effect& e) {
         AtFlange(e, {"flange_hose"}, {"q1", "q2", "q3", "q4", "q5", "q6"});
         e.held_by_a_record = true;
         double reach = 0;
         for (const plant::JointData& d : a.robot.joint) reach += std::abs(d.a_m) + std::abs(d.d_m);
         const KDL::Vector point = Direction(r) * (0.5 * reach) + KDL::Vector(0, 0, 0.8 * reach);
         const double free = r.Uniform(0.2, 0.4) * reach;
         e.torque = [=, &a](const Motion& m, const MatrixXd&) {
           return HoldForce(a, m, [&](int, const KDL::Vector& p) {
             const KDL::Vector to = point - p;
             return to * (std::max(0.0, 1 - free / (to.Norm() + 1e-6)));
           });
         };
       }},
      {"payload_twice", true, false,
       [](const Arm& a, Random& r, Effect& e) {
         plant::Body body;
         body.mass_kg = 1;
         body.center_m = {r.Uniform(-0.05, 0.05), r.Uniform(-0.05, 0.05), r.Uniform(0.08, 0.2)};
         body.inertia_kgm2 = {0.004, 0, 0, 0.004, 0, 0.003};
         const double on = r.Uniform(4, 8), off = r.Uniform(10, 14), again = r.Uniform(17, 24);
         AtFlange(e, {"payload_step"}, {"t", "link6"});
         e.also_joints = json::array(), e.run_state = true;
         e.torque = [=, &a](const Motion& m, const MatrixXd&) {
           MatrixXd tau = PayloadTorque(a, m, body);
           for (Eigen::Index k = 0; k < tau.rows(); ++k)
             if (m.t[k] < on || (m.t[k] > off && m.t[k] < again)) tau.row(k).setZero();
           return tau;
         };
       }},
  };
}

Form OfSetOne(const char* kind, bool report_only) {
  return {kind, true, report_only, [kind](const Arm& a, Random& r, Effect& e) { e = DrawEffect(kind, a, r); }};
}

}  // namespace

const std::vector<Form>& ArmForms() {
  static const std::vector<Form> forms = [] {
    std::vector<Form> all = PairForms();
    for (const Form& f : FlangeForms()) all.push_back(f);
    for (const char* kind : {"coulomb_asymmetry", "viscous_asymmetry", "viscous_quadratic", "meshing_friction",
                             "velocity_product", "temp_coulomb", "wrist_coupling", "presliding_dahl"})
      all.push_back(OfSetOne(kind, false));
    for (const char* kind :
         {"viscous_cuberoot", "cross_ripple", "base_tilt", "gravity_spring", "time_varying_coulomb", "torque_ripple"})
      all.push_back(OfSetOne(kind, true));
    return all;
  }();
  return forms;
}

std::vector<Form> AllForms(bool report) {
  std::vector<Form> all;
  const std::vector<Form>* const lists[] = {&ArmForms(), &JointForms(), &MemoryForms()};
  for (std::size_t k = 0; k < JointForms().size(); ++k)  // the longest
    for (const auto* list : lists)
      if (k < list->size() && (report || !(*list)[k].report_only)) all.push_back((*list)[k]);
  return all;
}

Effect DrawForm(const Form& form, const Arm& arm, Random& random) {
  Effect e;
  form.make(arm, random, e);
  e.kind = form.name;
  return e;
}

}  // namespace armcal::judged
