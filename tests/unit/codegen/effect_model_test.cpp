// tests - records that read the committed model, compiled into one, against KDL: what M, gravity's slope and a payload
// really are. And which law a joint follows.
#include <gtest/gtest.h>

#include <random>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/generator/model.hpp"
#include "codegen/src/io/input_error.hpp"
#include "tests/unit/codegen/effect_run.hpp"
#include "tests/unit/codegen/kdl_arm.hpp"

namespace armcal::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A six-axis arm with one effect, at random poses.
class WithEffect {
 public:
  explicit WithEffect(const codegen::EffectUse& use, const std::string& arm = "er20_like")
      : robot_(Load(arm)), model_(Plus(robot_, use), Records()) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> unit(-1, 1);
    signals_.t = VectorXd::LinSpaced(kSamples, 0, 0.008 * (kSamples - 1));
    for (auto* m : {&signals_.q, &signals_.qd, &signals_.qdd})
      *m = MatrixXd::NullaryExpr(kSamples, 6, [&] { return 2 * unit(random); });
    bodies_.resize(66);
    for (int p = 0; p < 66; ++p) bodies_[p] = model_.table()[p].mean;
  }
  static constexpr int kSamples = 40;
  const codegen::Robot& robot() const { return robot_; }
  const codegen::Model& model() const { return model_; }
  const codegen::Signals& signals() const { return signals_; }
  const VectorXd& bodies() const { return bodies_; }

  // Column by name over the log, [samples x rows].
  MatrixXd Column(const std::string& name, const std::vector<double>& eta) const {
    VectorXd committed = VectorXd::Zero(model_.columns());
    committed.segment(model_.front(), model_.rigid()) = model_.base_map() * bodies_;
    std::vector<MatrixXd> row;
    model_.Regressor(signals_, {committed.data(), static_cast<std::size_t>(committed.size())}, eta, row);
    MatrixXd out = MatrixXd::Zero(kSamples, 6);
    int found = 0;
    for (int c = 0; c < model_.columns(); ++c) {
      if (model_.column_name(c) != name) continue;
      ++found;
      for (int i = 0; i < 6; ++i)
        if (model_.column_joint(c) < 0 || model_.column_joint(c) == i) out.col(i) = row[i].col(c);
    }
    EXPECT_EQ(found, 1) << name;
    return out;
  }

 private:
  static codegen::Robot Load(const std::string& arm) {
    codegen::Robot r = codegen::ReadRobot("codegen/robots/" + arm + ".toml");
    r.effect.clear();
    return r;
  }
  static codegen::Robot Plus(codegen::Robot r, const codegen::EffectUse& use) {
    r.effect.push_back(use);
    return r;
  }
  codegen::Robot robot_;
  codegen::Model model_;
  codegen::Signals signals_;
  VectorXd bodies_;
};

codegen::EffectUse Use(const std::string& effect, const std::vector<int>& joints) {
  codegen::EffectUse use;
  use.effect = effect;
  use.joints = joints;
  return use;
}

const char* const kArms[] = {"er20_like", "puma560", "ur10"};  // all stand upright on joint 1
const VectorXd kRest = VectorXd::Zero(6);

// f1 times the torque of a payload: KDL with the payload bolted on, minus without. 1e-9 of 500 N m: fifty roundings.
TEST(EffectsInAModel, LoadLinear_IsThePayloadsTorque_InTheFileFrame) {
  for (const char* name : kArms) {
    WithEffect arm(Use("load_linear", {1}), name);
    const double mass = 12, c[] = {0.03, -0.05, 0.21};
    VectorXd loaded = arm.bodies();
    loaded[55] += mass;
    for (int k = 0; k < 3; ++k) loaded[56 + k] += mass * c[k];
    KdlArm with(arm.robot(), loaded), without(arm.robot(), arm.bodies());
    const MatrixXd column = arm.Column("load_linear.f12", {mass, c[0], c[1], c[2]});
    for (int k = 0; k < WithEffect::kSamples; ++k) {
      const VectorXd q = arm.signals().q.row(k), v = arm.signals().qd.row(k), a = arm.signals().qdd.row(k);
      EXPECT_NEAR(column(k, 1), with.Torque(q, v, a)[1] - without.Torque(q, v, a)[1], 1e-8) << name;
    }
  }
}

double RotorOf(const codegen::Robot& robot, int joint) {
  const codegen::Motor& motor = robot.joint[static_cast<std::size_t>(joint)].motor;
  return motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kgm2;
}

// M[r, j]: torque of row r for unit acceleration of joint j, at rest, without gravity and without the motor's rotor.
TEST(EffectsInAModel, BeltElasticity_TakesTheMassMatrixsColumn) {
  for (const char* name : kArms) {
    WithEffect arm(Use("belt_elasticity", {2}), name);
    codegen::Robot weightless = arm.robot();
    weightless.gravity_mps2 = {};
    KdlArm kdl(weightless, arm.bodies());
    EffectRun filter("belt_elasticity", {2});  // with M = 1: the filter alone
    Log log;
    for (int k = 0; k < WithEffect::kSamples; ++k) {
      log["qdd3"].push_back(arm.signals().qdd(k, 2));
      log["dt"].push_back(0.008);
      log["M0_2"].push_back(1);
    }
    const auto missing = filter.Column(0, 0, log, {{"w0", 150}});
    const MatrixXd column = arm.Column("belt_elasticity.e3", {150});
    for (int k = 0; k < WithEffect::kSamples; ++k) {
      const VectorXd inertia = kdl.Torque(arm.signals().q.row(k), kRest, VectorXd::Unit(6, 2)) -
                               RotorOf(arm.robot(), 2) * VectorXd::Unit(6, 2);
      for (int i = 0; i < 6; ++i)
        EXPECT_NEAR(column(k, i), inertia[i] * missing[k], 1e-8) << name << " " << k << " " << i;
    }
  }
}

// The links stand lower by C times the load: to first order in C, what gravity's torque then changes by.
TEST(EffectsInAModel, JointCompliance_MovesTheLinksUnderGravity) {
  constexpr double kCompliance = 1e-9;  // rad/(N m); the second order is a millionth
  for (const char* name : kArms) {
    WithEffect arm(Use("joint_compliance", {1}), name);
    KdlArm kdl(arm.robot(), arm.bodies());
    const MatrixXd column = arm.Column("joint_compliance.C2", {});
    for (int k = 0; k < WithEffect::kSamples; ++k) {
      const VectorXd q = arm.signals().q.row(k);
      // The gear carries the links, and not the motor's rotor.
      const double rotor_Nm = RotorOf(arm.robot(), 1) * arm.signals().qdd(k, 1);
      const double load = kdl.Torque(q, arm.signals().qd.row(k), arm.signals().qdd.row(k))[1] - rotor_Nm;
      const VectorXd lower = q - kCompliance * load * VectorXd::Unit(6, 1);
      const VectorXd change = (kdl.Torque(lower, kRest, kRest) - kdl.Torque(q, kRest, kRest)) / kCompliance;
      for (int i = 0; i < 6; ++i) EXPECT_NEAR(column(k, i), change[i], 1e-4 * change.norm() + 1e-4) << name << " " << k;
    }
  }
}

// The link hangs on a spring that carries its load: to first order in C, what its place, speed and acceleration against
// the motor's change of every joint's torque. They follow the load as w0^2 (load - s) + 2 zeta w0 (load' - s') says.
TEST(EffectsInAModel, BeltUnderLoad_MovesTheLinks) {
  constexpr double kStiffness = 2e4, kZeta = 0.3, kCompliance = 1e-9, kStep_s = 0.008;
  constexpr int kParts = 4000;
  for (const char* name : kArms) {
    WithEffect arm(Use("belt_load", {1}), name);
    KdlArm kdl(arm.robot(), arm.bodies());
    const MatrixXd column = arm.Column("belt_load.C2", {kStiffness});
    const VectorXd axis = VectorXd::Unit(6, 1);
    double from = 0, s = 0, rate = 0;
    for (int k = 0; k < WithEffect::kSamples; ++k) {
      const VectorXd q = arm.signals().q.row(k), qd = arm.signals().qd.row(k), qdd = arm.signals().qdd.row(k);
      const VectorXd torque = kdl.Torque(q, qd, qdd);
      const double load = torque[1] - RotorOf(arm.robot(), 1) * qdd[1];
      const double inertia = (kdl.Torque(q, kRest, axis) - kdl.Torque(q, kRest, kRest))[1] - RotorOf(arm.robot(), 1);
      if (k == 0) from = s = load;
      const double w2 = kStiffness / inertia, slope = (load - from) / kStep_s, h = kStep_s / kParts;
      const auto swing = [&](double t, double place, double speed) {
        return w2 * (from + slope * t - place) + 2 * kZeta * std::sqrt(w2) * (slope - speed);
      };
      for (int i = 0; i < kParts; ++i) {  // Heun
        const double t = i * h, a = swing(t, s, rate), b = swing(t + h, s + h * rate, rate + h * a);
        s += h * rate + 0.5 * h * h * a;
        rate += 0.5 * h * (a + b);
      }
      from = load;
      const VectorXd links = kdl.Torque(q - kCompliance * s * axis, qd - kCompliance * rate * axis,
                                        qdd - kCompliance * w2 * (load - s) * axis);
      VectorXd change = (links - torque) / kCompliance;
      change[1] += RotorOf(arm.robot(), 1) * w2 * (load - s);  // the rotor is the motor's
      for (int i = 0; i < 6; ++i) EXPECT_NEAR(column(k, i), change[i], 1e-4 * change.norm()) << name << " " << k;
    }
  }
}

// The hose is held by the joints: over a small step its torque does the work that its energy loses.
TEST(EffectsInAModel, FlangeHose_IsTheSlopeOfItsEnergy) {
  constexpr double kStep_rad = 1e-5, kOut_m = 0.12, kFree_m = 0.7;
  const KDL::Vector anchor(0.4, -1.1, 2.0);
  for (const char* name : kArms) {
    WithEffect arm(Use("flange_hose", {}), name);
    const KdlArm kdl(arm.robot(), arm.bodies());
    const auto energy = [&](const VectorXd& q) {
      const double longer = std::max(0.0, (anchor - kdl.Flange(q) * KDL::Vector(0, 0, kOut_m)).Norm() - kFree_m);
      return 0.5 * longer * longer;
    };
    const MatrixXd column = arm.Column("flange_hose.k", {anchor[0], anchor[1], anchor[2], kOut_m, kFree_m});
    for (int k = 0; k < WithEffect::kSamples; ++k)
      for (int i = 0; i < 6; ++i) {
        const VectorXd q = arm.signals().q.row(k), step = kStep_rad * VectorXd::Unit(6, i);
        EXPECT_NEAR(column(k, i), (energy(q + step) - energy(q - step)) / (2 * kStep_rad), 1e-8) << name << " " << k;
      }
  }
}

// Torque at rest is linear in gravity; rows 2..6 see all of it through the base parameters of an upright arm.
TEST(EffectsInAModel, BaseTilt_IsTheSlopeOfGravityTorque) {
  for (const char* name : kArms) {
    WithEffect arm(Use("base_tilt", {}), name);
    for (int axis = 0; axis < 2; ++axis) {
      codegen::Robot tilted = arm.robot();
      tilted.gravity_mps2 = {};
      tilted.gravity_mps2[axis] = 1;
      KdlArm kdl(tilted, arm.bodies());
      const MatrixXd column = arm.Column(axis ? "base_tilt.gy" : "base_tilt.gx", {});
      for (int k = 0; k < WithEffect::kSamples; ++k) {
        const VectorXd expected = kdl.Torque(arm.signals().q.row(k), kRest, kRest);
        for (int i = 1; i < 6; ++i) EXPECT_NEAR(column(k, i), expected[i], 1e-9) << name << " " << k << " " << i;
      }
    }
  }
}

// A law that replaces Coulomb and viscous friction leaves none of them on its joint, and all on the others.
TEST(EffectsInAModel, ALawThatReplaces_StandsAlone) {
  for (const auto& [name, record] : Records()) {
    if (record.replaces.empty()) continue;
    WithEffect arm(Use(name, {3}));
    int fc = 0, own = 0;
    for (const auto& p : arm.model().table()) {
      fc += p.effect == record.replaces && p.name.rfind("Fc", 0) == 0;
      own += p.effect == name;
      EXPECT_FALSE(p.effect == record.replaces && p.joint == 3) << p.name;
    }
    EXPECT_EQ(fc, 5) << name;
    EXPECT_GT(own, 2) << name;
  }
}

// Compiled in and off: the joint keeps its friction until a table switches the law on.
TEST(EffectsInAModel, ALawOnStandby_LeavesCoulombAndViscousFriction) {
  for (const auto& [name, record] : Records()) {
    if (record.replaces.empty()) continue;
    codegen::EffectUse off = Use(name, {3});
    off.state = "standby";
    WithEffect arm(off);
    double friction = 0;
    for (const auto& p : arm.model().table())
      if (p.effect == record.replaces && p.joint == 3) friction += p.mean;
    EXPECT_GT(friction, 0) << name;
  }
}

TEST(EffectsInAModel, ValuesOfUnknownNames_AreRefusedWithTheNearest) {
  const auto error = [](const codegen::EffectUse& use) -> std::string {
    try {
      WithEffect arm(use);
      return "";
    } catch (const io::InputError& e) {
      return e.what();
    }
  };
  codegen::EffectUse ripple = Use("torque_ripple", {2});
  ripple.nonlinear["k"] = 20;
  EXPECT_EQ(error(ripple), "");
  ripple.nonlinear["kk"] = 20;
  EXPECT_NE(error(ripple).find("effect.torque_ripple.nonlinear.kk: expected k"), std::string::npos) << error(ripple);
  codegen::EffectUse offset = Use("torque_offset", {2});
  offset.mean["Tq"] = 1;
  EXPECT_NE(error(offset).find("effect.torque_offset.mean.Tq: expected "), std::string::npos) << error(offset);
  offset.mean.clear(), offset.nonlinear["k"] = 1;
  EXPECT_NE(error(offset).find("the record has no such parameters"), std::string::npos) << error(offset);
}

// What a column means hangs on the robot's numbers that its law reads, and on no others.
TEST(EffectsInAModel, Schema_ChangesWithTheNumbersThatALawReads) {
  const auto schema = [](const std::string& effect, const std::vector<int>& joints, const auto& change) {
    codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
    robot.effect = {Use(effect, joints)};
    change(robot);
    return codegen::Schema(codegen::Model(robot, Records()));
  };
  const auto same = [](codegen::Robot&) {};
  const auto faster = [](codegen::Robot& r) { r.joint[2].speed_limit_radps *= 2; };
  const auto other = [](codegen::Robot& r) { r.joint[4].speed_limit_radps *= 2; };
  const auto higher = [](codegen::Robot& r) { r.base_xyz_m[2] += 1; };
  EXPECT_NE(schema("friction_table", {2}, faster), schema("friction_table", {2}, same));
  EXPECT_EQ(schema("friction_table", {2}, other), schema("friction_table", {2}, same));
  EXPECT_EQ(schema("torque_offset", {2}, faster), schema("torque_offset", {2}, same));
  EXPECT_NE(schema("flange_hose", {}, higher), schema("flange_hose", {}, same));
  EXPECT_EQ(schema("torque_offset", {2}, higher), schema("torque_offset", {2}, same));
}

}  // namespace
}  // namespace armcal::tests
