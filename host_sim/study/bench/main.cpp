// bench - compares the generated model with yardsticks in one program. The model is compiled in; no file is read.
//
//   armcal-bench-ROBOT [--quick] GX GY GZ {ALPHA A D THETA PRISMATIC}...      prints JSON
// All of it is compiled with the same flags (-O3 -march=native). armcal bench starts it.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <kdl/chain.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "host_sim/study/bench/bench.hpp"

namespace armcal::bench {
namespace {

// The yardstick is one inverse-dynamics call of Orocos KDL for the same arm.

// One joint as the robot file has it: modified DH (Craig).
struct JointShape {
  double alpha_rad, a_m, d_m, theta_rad;
  bool prismatic;
};

// bodies: 11 a link as in the parameter table: m, m c, I about the link origin (xx xy xz yy yz zz), rotor.
class KdlArm {
 public:
  KdlArm(const std::vector<JointShape>& joints, const double* gravity_mps2, const double* bodies)
      : n_(static_cast<unsigned>(joints.size())), torque_(n_) {
    const auto before = [&](unsigned j) {
      return KDL::Frame::DH_Craig1989(joints[j].a_m, joints[j].alpha_rad, joints[j].d_m, joints[j].theta_rad);
    };
    // A KDL segment is a joint and the tip behind it. DH has the fixed part in front of the joint. So the fixed part of
    // the next joint becomes this segment's tip, and the body is given in the tip's frame, as KDL wants it. Then there
    // are not more segments than joints.
    if (const KDL::Frame first = before(0); !KDL::Equal(first, KDL::Frame::Identity()))
      chain_.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), first));
    for (unsigned j = 0; j < n_; ++j) {
      const double* b = bodies + 11 * j;
      const KDL::Vector c(b[1] / b[0], b[2] / b[0], b[3] / b[0]);
      const KDL::RotationalInertia origin(b[4], b[7], b[9], b[5], b[6], b[8]);
      const KDL::RotationalInertia centre = KDL::RigidBodyInertia(-b[0], c).getRotationalInertia() + origin;
      const KDL::Frame tip = j + 1 < n_ ? before(j + 1) : KDL::Frame::Identity();
      chain_.addSegment(KDL::Segment(KDL::Joint(joints[j].prismatic ? KDL::Joint::TransZ : KDL::Joint::RotZ), tip,
                                     tip.Inverse() * KDL::RigidBodyInertia(b[0], c, centre)));
      rotor_.push_back(b[10]);
    }
    none_.assign(chain_.getNrOfSegments(), KDL::Wrench::Zero());
    solver_ = std::make_unique<KDL::ChainIdSolver_RNE>(chain_,
                                                       KDL::Vector(gravity_mps2[0], gravity_mps2[1], gravity_mps2[2]));
  }

  void Add(const double* q, const double* qd, const double* qdd) {
    State s{KDL::JntArray(n_), KDL::JntArray(n_), KDL::JntArray(n_)};
    for (unsigned j = 0; j < n_; ++j) s.q(j) = q[j], s.qd(j) = qd[j], s.qdd(j) = qdd[j];
    state_.push_back(s);
  }
  std::size_t states() const { return state_.size(); }
  // Only this call is timed.
  [[gnu::noinline]] const KDL::JntArray& Call(std::size_t k) {
    solver_->CartToJnt(state_[k].q, state_[k].qd, state_[k].qdd, none_, torque_);
    return torque_;
  }
  double torque(std::size_t k, unsigned j) { return Call(k)(j) + rotor_[j] * state_[k].qdd(j); }

 private:
  struct State {
    KDL::JntArray q, qd, qdd;
  };
  unsigned n_;
  KDL::Chain chain_;
  KDL::Wrenches none_;
  KDL::JntArray torque_;
  std::vector<double> rotor_;
  std::vector<State> state_;
  std::unique_ptr<KDL::ChainIdSolver_RNE> solver_;
};

using nlohmann::ordered_json;
constexpr int kInputs = 256;  // too many for a branch predictor to learn, few enough for the first-level cache

template <class T>
Work RegressorWork(const std::string& name) {
  auto inputs = std::make_shared<std::vector<Input<T>>>(RandomInputs<T>(kInputs / kLanes<T>, 1));
  auto rows = std::make_shared<Rows<T>>();
  return {name,
          [inputs, rows](int calls) {
            const std::size_t mask = inputs->size() - 1;
            for (int k = 0; k < calls; ++k) {
              Regressor((*inputs)[static_cast<std::size_t>(k) & mask], *rows);
              Touch(rows.get());
            }
          },
          kLanes<T>};
}

Work KdlWork(std::shared_ptr<KdlArm> arm) {
  return {"one inverse-dynamics call of KDL", [arm](int calls) {
            for (int k = 0; k < calls; ++k) Touch(&arm->Call(static_cast<std::size_t>(k) % arm->states()));
          }};
}

Work SinCosWork() {
  auto angles = std::make_shared<std::vector<Input<double>>>(RandomInputs<double>(kInputs, 1));
  return {"sine and cosine of six angles, C library", [angles](int calls) {
            double s[6], c[6];
            for (int k = 0; k < calls; ++k) {
              const Input<double>& x = (*angles)[static_cast<std::size_t>(k) % kInputs];
              const double q[6] = {x.q[0], x.q[1 % n], x.q[2 % n], x.q[3 % n], x.q[4 % n], x.q[5 % n]};
              for (int i = 0; i < 6; ++i) sincos(q[i], s + i, c + i);
              Touch(s), Touch(c);
            }
          }};
}

// The largest difference between the model's torque at its default bodies and KDL's, in units of the largest torque.
// Model::kInfo and the map are float: 1e-6 is agreement.
double Disagreement(KdlArm& arm, const std::vector<Input<double>>& inputs) {
  double base[Model::kRigid] = {}, worst = 0, largest = 0;
  for (int b = 0; b < Model::kRigid; ++b)
    for (int k = Model::kMapBegin[b]; k < Model::kMapBegin[b + 1]; ++k)
      base[b] += static_cast<double>(Model::kMapValue[k]) * Model::kInfo[Model::kMapColumn[k]].mean;
  Rows<double> rows;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    Regressor(inputs[k], rows);
    for (int i = 0; i < n; ++i) {
      double tau = 0;
      for (int b = 0; b < Model::kRigid; ++b) tau += rows.dense[i * Model::kDense + b] * base[b];
      const double kdl = arm.torque(k, static_cast<unsigned>(i));
      worst = std::max(worst, std::abs(tau - kdl));
      largest = std::max(largest, std::abs(kdl));
    }
  }
  return worst / largest;
}

ordered_json Ratio(const char* name, const Work& a, const Work& b, double goal, double stretch, const char* meaning) {
  const double value = a.median_ns() / b.median_ns();
  return {{"name", name},         {"value", value},     {"goal", goal},
          {"met", value <= goal}, {"stretch", stretch}, {"stretch_met", value <= stretch},
          {"meaning", meaning}};
}

int Main(int argc, char** argv) {
  bool quick = false;
  std::vector<double> numbers;
  for (int k = 1; k < argc; ++k)
    if (std::strcmp(argv[k], "--quick") == 0) quick = true;
    else numbers.push_back(std::atof(argv[k]));
  if (numbers.size() != 3 + 5 * n) {
    std::fprintf(stderr, "%s: expected gravity and five numbers a joint; armcal bench gives them\n", argv[0]);
    return 2;
  }
  std::vector<JointShape> joints;
  for (int j = 0; j < n; ++j) {
    const double* v = numbers.data() + 3 + 5 * j;
    joints.push_back({v[0], v[1], v[2], v[3], v[4] != 0});
  }
  double bodies[Model::kBodyParameters];
  for (int k = 0; k < Model::kBodyParameters; ++k) bodies[k] = static_cast<double>(Model::kInfo[k].mean);
  auto arm = std::make_shared<KdlArm>(joints, numbers.data(), bodies);
  const auto states = RandomInputs<double>(kInputs, 1);
  for (const auto& x : states) arm->Add(x.q, x.qd, x.qdd);
  const double disagreement = Disagreement(*arm, states);
  if (!(disagreement < 1e-5)) return std::puts("{}"), 1;  // two different arms cannot be compared

  Work kdl = KdlWork(arm), sines = SinCosWork();
  Work plain = RegressorWork<double>("regressor, double"),
       own_sines = RegressorWork<math::Pack<double, 1>>("regressor, double, own sines"),
       single = RegressorWork<float>("regressor, float"),
       pack = RegressorWork<math::Pack<double, 8>>("regressor, a sample of 8 doubles"),
       single_pack = RegressorWork<math::Pack<float, 16>>("regressor, a sample of 16 floats");
  Measure({&kdl, &sines, &plain, &own_sines, &single, &pack, &single_pack}, quick ? 21 : 401);

  const int samples = quick ? 3000 : 20000;  // the stored regressor of the long one (56 MB) leaves the caches
  const Log log = RandomLog(samples, 2);
  Eigen::MatrixXd stored;
  Eigen::VectorXd right, fused_x, normal_x, householder_x;
  const auto each = [](const auto& work) {
    return [&work](int calls) {
      for (int k = 0; k < calls; ++k) work();
    };
  };
  const auto do_fused = [&] { fused_x = FusedGram(log); };
  const auto do_stored = [&] { MakeStored(log, stored, right), Touch(stored.data()); };
  const auto do_normal = [&] { do_stored(), normal_x = StoredNormal(stored, right); };
  const auto do_householder = [&] { do_stored(), householder_x = StoredHouseholder(stored, right); };
  Work fused{"least squares, fused Gram sums, a sample", each(do_fused), double(samples)},
      storing{"storing the regressor, a sample", each(do_stored), double(samples)},
      normal{"least squares, normal equations of the stored regressor, a sample", each(do_normal), double(samples)},
      householder{"least squares, Householder QR of the stored regressor, a sample", each(do_householder),
                  double(samples)};
  Measure({&fused, &storing, &normal, &householder}, quick ? 3 : 41);
  const double spread =
      std::max((fused_x - householder_x).norm(), (normal_x - householder_x).norm()) / householder_x.norm();

  ordered_json out{{"robot", Model::kName},
                   {"columns", Model::kColumns},
                   {"compiler", "g++ " __VERSION__},
                   {"flags", "-O3 -march=native"},
                   {"quick", quick},
                   {"log_samples", samples}};
  out["ratios"] = {
      Ratio("regressor_over_kdl_rne", plain, kdl, 0.13, 0.09, "double, C library's sines"),
      Ratio("regressor_over_six_sincos", plain, sines, 2.18, 1.5, "double, C library's sines"),
      Ratio("own_sines_over_kdl_rne", own_sines, kdl, 0.13, 0.09, "double, sines of armcal/math/pack.hpp"),
      Ratio("own_sines_over_six_sincos", own_sines, sines, 1.5, 1.33, "double, sines of armcal/math/pack.hpp"),
      Ratio("float_over_double", single, plain, 1, 0.75, "one sample"),
      Ratio("pack_of_8_over_double", pack, plain, 0.15, 0.12, "a sample of a pack against one sample"),
      Ratio("pack_of_16_floats_over_double", single_pack, plain, 0.08, 0.06, "a sample of a pack against one sample"),
      Ratio("batch_over_normal_equations", fused, normal, 0.25, 0.125, "both from the log to the estimate"),
      Ratio("batch_over_householder", fused, householder, 1.0 / 15, 1.0 / 30, "both from the log to the estimate"),
      Ratio("batch_over_storing", fused, storing, 1, 0.25, "the whole estimate against filling a stored regressor"),
  };
  for (const Work* w :
       {&kdl, &sines, &plain, &own_sines, &single, &pack, &single_pack, &fused, &storing, &normal, &householder})
    out["times"].push_back({{"name", w->name},
                            {"median_ns", w->median_ns()},
                            {"min_ns", w->quantile(0)},
                            {"p90_ns", w->quantile(0.9)},
                            {"blocks", w->time_ns.size()}});
  out["torque_differs_from_kdl"] = disagreement;
  out["estimates_differ"] = spread;
  std::puts(out.dump(1).c_str());
  return spread < 1e-8 ? 0 : 1;
}

}  // namespace
}  // namespace armcal::bench

int main(int argc, char** argv) { return armcal::bench::Main(argc, argv); }
