// tests - faults planted on purpose, each of which the check against KDL must catch; the product knows nothing of them.
#include <gtest/gtest.h>

#include <set>

#include <Eigen/LU>

#include "tests/unit/codegen/checked_in.hpp"
#include "tests/unit/codegen/rigid_oracle.hpp"

namespace armcal::tests {
namespace {

using codegen::Node;
using codegen::Op;

constexpr int kStates = 20;  // the real tests look at thousands; what twenty see, thousands see, too

class PlantedFault : public testing::Test {
 protected:
  void Plant(const std::string& name, const codegen::Robot& truth, const TorqueOf& torque) {
    ++planted_;
    if (ErrorAgainstKdl(truth, torque, kStates, 51) > kTolerance) ++caught_;
    else ADD_FAILURE() << "survived: " << name;
  }
  void TearDown() override {
    EXPECT_GE(planted_, least_);
    EXPECT_EQ(planted_, caught_);
    std::printf("planted %d, caught %d\n", planted_, caught_);
  }
  int planted_ = 0, caught_ = 0, least_ = 1;
};

// The graph's base regressor with one node spoilt.
enum class Spoil { kFlipSign, kDropSecond, kSwapSinCos, kOnePercent };
class SpoiltGraph {
 public:
  explicit SpoiltGraph(const GraphArm& arm) : arm_(arm), nodes_(arm.graph().nodes()) {
    std::vector<int> open;
    for (const auto& r : arm.Roots()) open.push_back(r.id()), root_.push_back(r.id());
    while (!open.empty()) {
      const int id = open.back();
      open.pop_back();
      if (id < 0 || !needed_.insert(id).second || nodes_[id].op == Op::kInput) continue;
      open.push_back(nodes_[id].a), open.push_back(nodes_[id].b);
    }
  }
  const std::set<int>& needed() const { return needed_; }
  const Node& node(int id) const { return nodes_[id]; }

  MatrixXd Regressor(const State& s, int spoilt, Spoil how) const {
    const auto inputs = InputValues(arm_.graph(), s);
    std::vector<double> value(nodes_.size());
    for (const int id : needed_) {
      const Node& n = nodes_[id];
      const bool here = id == spoilt;
      Op op = n.op;
      if (here && how == Spoil::kSwapSinCos) op = op == Op::kSin ? Op::kCos : Op::kSin;
      if (op == Op::kConstant) value[id] = n.value * (here ? 1.01 : 1);
      else if (op == Op::kInput) value[id] = inputs[n.a];
      else if (here && how == Spoil::kDropSecond) value[id] = value[n.a];
      else {
        double b = n.b < 0 ? 0 : value[n.b];
        if (here && how == Spoil::kFlipSign) b = -b;
        value[id] = codegen::ApplyOp<double>(op, value[n.a], b);
      }
    }
    std::vector<double> out;
    for (const int r : root_) out.push_back(value[r]);
    return arm_.Shaped(out);
  }

 private:
  const GraphArm& arm_;
  const std::vector<Node>& nodes_;
  std::vector<int> root_;
  std::set<int> needed_;
};

class InGraph : public PlantedFault, public testing::WithParamInterface<const char*> {};

TEST_P(InGraph, EverySignTermFactorSineAndConstant_IsCaught) {
  const codegen::Robot robot = Read(GetParam());
  const GraphArm arm(robot);
  const SpoiltGraph graph(arm);
  const auto& map = arm.base().map;
  ASSERT_LT(ErrorAgainstKdl(robot, arm.Torque(), kStates, 51), kTolerance);
  const auto plant = [&](int id, Spoil how, const char* what) {
    Plant(std::string(what) + " at node " + std::to_string(id), robot,
          [&, id, how](const State& s, const std::vector<Body>& bodies) -> VectorXd {
            return graph.Regressor(s, id, how) * (map * StandardParameters(bodies));
          });
  };
  for (const int id : graph.needed()) {
    const Node& n = graph.node(id);
    if (n.op == Op::kAdd || n.op == Op::kSubtract || n.op == Op::kMultiply) {
      plant(id, Spoil::kFlipSign, "sign");
      plant(id, Spoil::kDropSecond, "term or factor");
    } else if (n.op == Op::kSin || n.op == Op::kCos) {
      plant(id, Spoil::kSwapSinCos, "sine for cosine");
    } else if (n.op == Op::kConstant && n.value != 0 && n.value != 1) {
      plant(id, Spoil::kOnePercent, "constant");
    }
  }
  least_ = 900;
}

TEST_P(InGraph, EveryPairOfNeighbouringColumns_SwappedIsCaught) {
  const codegen::Robot robot = Read(GetParam());
  const GraphArm arm(robot);
  for (int c = 0; c + 1 < arm.base().map.rows(); ++c)
    Plant("columns " + std::to_string(c) + " and the next", robot,
          [&, c](const State& s, const std::vector<Body>& bodies) -> VectorXd {
            MatrixXd Y = arm.Regressor(s);
            Y.col(c).swap(Y.col(c + 1));
            return Y * (arm.base().map * StandardParameters(bodies));
          });
  least_ = 30;
}

TEST_P(InGraph, EveryCoefficientOfTheMap_IsCaught) {
  const codegen::Robot robot = Read(GetParam());
  const GraphArm arm(robot);
  const MatrixXd& map = arm.base().map;
  for (int i = 0; i < map.rows(); ++i)
    for (int c = 0; c < map.cols(); ++c) {
      if (map(i, c) == 0) continue;
      for (const double factor : {-1.0, 0.0, 1.01}) {
        MatrixXd wrong = map;
        wrong(i, c) *= factor;
        Plant("coefficient " + std::to_string(i) + "," + std::to_string(c), robot,
              [&](const State& s, const std::vector<Body>& bodies) -> VectorXd {
                return arm.Regressor(s) * (wrong * StandardParameters(bodies));
              });
      }
    }
  least_ = 200;
}

INSTANTIATE_TEST_SUITE_P(Robots, InGraph, testing::Values("er20_like", "ur10"));

TEST_F(PlantedFault, InTheSlideOfALink_IsCaught) {
  for (const char* name : {"er20_like", "puma560", "ur10", "kuka_kr300", "kuka_lwr4"}) {
    const codegen::Robot robot = Read(name);
    const GraphArm arm(robot);
    const auto slide = codegen::BestSlides(robot);
    const MatrixXd merge = arm.base().map * codegen::SlideMap(robot).inverse();
    for (int j = 0; j < robot.joints(); ++j) {
      if (slide[j] == 0) continue;
      for (const double factor : {-1.0, 0.0, 1.001}) {
        auto wrong = slide;
        wrong[j] *= factor;
        const MatrixXd map = merge * codegen::SlideMap(robot, wrong);
        Plant(std::string(name) + " slide " + std::to_string(j + 1), robot,
              [&](const State& s, const std::vector<Body>& bodies) -> VectorXd {
                return arm.Regressor(s) * (map * StandardParameters(bodies));
              });
      }
    }
  }
  least_ = 15;
}

// An arm without symmetry, so that every fault of a frame must show.
codegen::Robot SkewedArm() {
  codegen::Robot robot;
  robot.gravity_mps2 = {2, -3, -9};
  const double rows[4][4] = {
      {0.4, 0.1, 0.2, 0.3}, {-1.1, 0.3, -0.2, 0.7}, {0.8, -0.25, 0.4, -0.5}, {1.3, 0.2, 0.15, 1.1}};
  for (const auto& r : rows) {
    codegen::Joint joint;
    joint.kinematics = {codegen::JointType::kRevolute, r[0], r[1], r[2], r[3]};
    robot.joint.push_back(joint);
  }
  robot.joint[2].kinematics.type = codegen::JointType::kPrismatic;
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  for (int k = 0; k < 9; ++k) robot.base_rotation[k] = R(k / 3, k % 3);
  return robot;
}

TEST_F(PlantedFault, InTheFramesOrGravity_IsCaught) {
  const codegen::Robot truth = SkewedArm();
  ASSERT_LT(ErrorAgainstKdl(truth, GraphArm(truth).Torque(), kStates, 51), 10 * kTolerance);
  const auto plant = [&](const std::string& name, const codegen::Robot& wrong) {
    const GraphArm arm(wrong);
    Plant(name, truth, arm.Torque());
  };
  for (int j = 0; j < 4; ++j) {
    using codegen::JointKinematics;
    const std::pair<const char*, std::function<void(JointKinematics&)>> faults[] = {
        {"alpha sign", [](JointKinematics& k) { k.alpha_rad = -k.alpha_rad; }},
        {"alpha for theta", [](JointKinematics& k) { std::swap(k.alpha_rad, k.theta_rad); }},
        {"offset left out", [](JointKinematics& k) { k.theta_rad = 0; }},
        {"offset sign", [](JointKinematics& k) { k.theta_rad = -k.theta_rad; }},
        {"type",
         [](JointKinematics& k) {
           k.type =
               k.type == codegen::JointType::kRevolute ? codegen::JointType::kPrismatic : codegen::JointType::kRevolute;
         }},
        {"a for d", [](JointKinematics& k) { std::swap(k.a_m, k.d_m); }},
        {"a sign", [](JointKinematics& k) { k.a_m = -k.a_m; }},
        {"d sign", [](JointKinematics& k) { k.d_m = -k.d_m; }},
    };
    // the first joint's a and d move the whole arm, which no torque sees
    for (int f = 0; f < (j == 0 ? 5 : 8); ++f) {
      codegen::Robot wrong = truth;
      faults[f].second(wrong.joint[j].kinematics);
      plant(faults[f].first + (" of joint " + std::to_string(j + 1)), wrong);
    }
  }
  for (int j = 0; j < 3; ++j) {  // standard DH read as modified: (a, alpha) one row off
    codegen::Robot wrong = truth;
    std::swap(wrong.joint[j].kinematics.alpha_rad, wrong.joint[j + 1].kinematics.alpha_rad);
    plant("alpha of the next row", wrong);
    wrong = truth;
    std::swap(wrong.joint[j].kinematics.a_m, wrong.joint[j + 1].kinematics.a_m);
    plant("a of the next row", wrong);
  }
  for (int k = 0; k < 3; ++k) {
    codegen::Robot wrong = truth;
    wrong.gravity_mps2[k] = -wrong.gravity_mps2[k];
    plant("gravity sign", wrong);
  }
  codegen::Robot wrong = truth;
  for (int k = 0; k < 9; ++k) wrong.base_rotation[k] = truth.base_rotation[3 * (k % 3) + k / 3];
  plant("base rotation transposed", wrong);
  least_ = 35;
}

TEST_F(PlantedFault, InTheInertialConversion_IsCaught) {
  const codegen::Robot truth = SkewedArm();
  const GraphArm arm(truth);
  const auto plant = [&](const std::string& name, const std::function<void(Body&)>& body,
                         const std::function<void(VectorXd&)>& parameters) {
    Plant(name, truth, [&](const State& s, const std::vector<Body>& bodies) -> VectorXd {
      std::vector<Body> wrong = bodies;
      for (Body& b : wrong) body(b);
      VectorXd phi = StandardParameters(wrong);
      parameters(phi);
      return arm.Regressor(s) * (arm.base().map * phi);
    });
  };
  const auto keep_body = [](Body&) {};
  const auto keep = [](VectorXd&) {};
  const auto each = [](auto change) {
    return [change](VectorXd& phi) {
      for (int b = 0; b < phi.size(); b += 11) change(phi.data() + b);
    };
  };
  const auto about_centre = [](double* p,
                               double sign) {  // what Steiner adds, taken away once (centre) or twice (wrong sign)
    const double m = p[0], x = p[1] / m, y = p[2] / m, z = p[3] / m;
    p[4] -= sign * m * (y * y + z * z), p[7] -= sign * m * (x * x + z * z), p[9] -= sign * m * (x * x + y * y);
    p[5] += sign * m * x * y, p[6] += sign * m * x * z, p[8] += sign * m * y * z;
  };
  plant("inertia about the centre", keep_body, each([&](double* p) { about_centre(p, 1); }));
  plant("Steiner with the wrong sign", keep_body, each([&](double* p) { about_centre(p, 2); }));
  plant("products without Steiner", keep_body, each([](double* p) {
          const double m = p[0];
          p[5] += p[1] * p[2] / m, p[6] += p[1] * p[3] / m, p[8] += p[2] * p[3] / m;
        }));
  for (int k = 0; k < 3; ++k) {
    plant("first moment sign", keep_body, each([k](double* p) { p[1 + k] = -p[1 + k]; }));
    plant("first moment without mass", keep_body, each([k](double* p) { p[1 + k] /= p[0]; }));
    plant(
        "centre mirrored", [k](Body& b) { b.c[k] = -b.c[k]; }, keep);
    plant(
        "centres permuted", [k](Body& b) { std::swap(b.c[k], b.c[(k + 1) % 3]); }, keep);
    plant("first moments permuted", keep_body, each([k](double* p) { std::swap(p[1 + k], p[1 + (k + 1) % 3]); }));
  }
  for (const int product : {5, 6, 8})
    plant("product sign", keep_body, each([product](double* p) { p[product] = -p[product]; }));
  for (const auto& [a, b] : std::vector<std::pair<int, int>>{{4, 7}, {7, 9}, {4, 9}, {5, 6}, {6, 8}, {5, 8}, {6, 7}})
    plant("inertia components in another order", keep_body, each([a = a, b = b](double* p) { std::swap(p[a], p[b]); }));
  plant("rotor left out", keep_body, each([](double* p) { p[10] = 0; }));
  plant("links in another order", keep_body, [](VectorXd& phi) {
    const VectorXd first = phi.head(11);
    phi.head(11) = phi.segment(11, 11);
    phi.segment(11, 11) = first;
  });
  least_ = 30;
}

}  // namespace
}  // namespace armcal::tests
