// diagnosis tests - compare every quantity that an expression can read with Orocos KDL.
#include <gtest/gtest.h>

#include <fstream>

#include "host_sim/diagnose/diagnosis/work.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::diagnosis {
namespace {

using codegen::Quantity;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using tests::KdlArm;

constexpr double kStep_s = 0.008;
constexpr const char* kParameters[] = {"m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"};

// One word of the language on the rows of a whole arm: how it is written, and what it must be. index: the second one.
struct Word {
  std::string text;
  Quantity quantity;
  int joint;  // -1: the row itself
  int index, parameter;
};

std::vector<Word> WordsOf(const codegen::QuantityInfo& info, int joints) {
  const std::string word = info.word;
  std::vector<Word> out;
  switch (info.indexing) {
    case codegen::Indexing::kNone:
      return {{word, info.quantity, -1, 0, 0}};
    case codegen::Indexing::kJoint:
      return {{word, info.quantity, -1, 0, 0},
              {word + "[r]", info.quantity, -1, 0, 0},
              {word + "[3]", info.quantity, 2, 0, 0}};
    case codegen::Indexing::kBody:
      for (int body = 0; body < joints; ++body)
        for (int p = 0; p < 10; ++p)
          out.push_back(
              {word + "[" + std::to_string(body + 1) + ", " + kParameters[p] + "]", info.quantity, -1, body, p});
      out.push_back({word + "[flange, mx]", info.quantity, -1, joints - 1, 1});
      return out;
    case codegen::Indexing::kRowJoint:
      for (int j = 0; j < joints; ++j)
        out.push_back({word + "[r, " + std::to_string(j + 1) + "]", info.quantity, -1, j, 0});
      return out;
    case codegen::Indexing::kRowAxis:
      for (int axis = 0; axis < 3; ++axis)
        out.push_back({word + "[r, " + "xyz"[axis] + "]", info.quantity, -1, axis, 0});
      return out;
    case codegen::Indexing::kAxis:
      for (int axis = 0; axis < 3; ++axis) out.push_back({word + "[" + "xyz"[axis] + "]", info.quantity, -1, axis, 0});
      return out;
  }
  return out;
}

// With base_tilt in the model, its base parameters are those that gravity in any direction shows.
codegen::Robot TiltedArm() {
  codegen::Robot robot = tests::Er20();
  robot.base_xyz_m = {0.1, -0.2, 0.3};
  codegen::EffectUse tilt;
  tilt.effect = "base_tilt";
  tilt.state = "standby";
  robot.effect.push_back(tilt);
  return robot;
}

class EveryQuantity : public testing::Test {
 protected:
  EveryQuantity() : arm_(TiltedArm(), 5), data_(arm_.Run(1.0, 7)), torque_(arm_.model()) {
    data_.s.temp = MatrixXd::NullaryExpr(data_.samples(), n(), [](auto k, auto j) {
      return 20 + 0.1 * static_cast<double>(k) + 3.0 * static_cast<double>(j);
    });
  }
  int n() const { return arm_.model().joints(); }

  VectorXd At(const MatrixXd& m, int sample) const { return m.row(sample); }
  // KDL's torque of these bodies; gravity: along the base's axes, else the robot's own.
  VectorXd Torque(const VectorXd& bodies, int sample, const VectorXd& qd, const VectorXd& qdd,
                  int gravity_axis = -1) const {
    codegen::Robot robot = arm_.model().robot();
    if (gravity_axis >= 0) robot.gravity_mps2 = {}, robot.gravity_mps2[gravity_axis] = 1;
    return KdlArm(robot, bodies).Torque(At(data_.s.q, sample), qd, qdd);
  }
  VectorXd GravityAt(int sample, int joint, double moved_rad) const {
    const VectorXd none = VectorXd::Zero(n());
    VectorXd q = At(data_.s.q, sample);
    q[joint] += moved_rad;
    return KdlArm(arm_.model().robot(), arm_.bodies()).Torque(q, none, none);
  }
  // Of the arm with one joint a little further and faster.
  VectorXd RigidAt(int sample, int joint, double further_rad, double faster_radps) const {
    VectorXd q = At(data_.s.q, sample), qd = At(data_.s.qd, sample);
    q[joint] += further_rad, qd[joint] += faster_radps;
    return KdlArm(arm_.model().robot(), arm_.bodies()).Torque(q, qd, At(data_.s.qdd, sample));
  }
  double Rotor(int joint) const {  // robot_prior_test.cpp judges what base parameters say of it
    const codegen::RotorInertia& rotor = arm_.model().rotors()[static_cast<std::size_t>(joint)];
    return rotor.rest + rotor.share.dot(arm_.model().base_map() * arm_.bodies());
  }
  VectorXd Rigid(int sample) const {
    return Torque(arm_.bodies(), sample, At(data_.s.qd, sample), At(data_.s.qdd, sample));
  }

  KDL::Frame FlangeAt(int sample, int joint = 0, double moved_rad = 0) const {
    VectorXd q = At(data_.s.q, sample);
    q[joint] += moved_rad;
    return KdlArm(arm_.model().robot(), arm_.bodies()).Flange(q);
  }

  double Oracle(const Word& w, int row, int sample) const {
    const VectorXd none = VectorXd::Zero(n());
    const int joint = w.joint < 0 ? row : w.joint;
    switch (w.quantity) {
      case Quantity::kPosition:
        return data_.s.q(sample, joint);
      case Quantity::kSpeed:
        return data_.s.qd(sample, joint);
      case Quantity::kAcceleration:
        return data_.s.qdd(sample, joint);
      case Quantity::kTemperature:
        return data_.s.temp(sample, joint);
      case Quantity::kTime:
        return data_.s.t[sample];
      case Quantity::kTimeStep:
        return kStep_s;
      case Quantity::kRigidTorque:  // the rotor is no load of the gear
        return Rigid(sample)[joint] - Rotor(joint) * data_.s.qdd(sample, joint);
      case Quantity::kModelTorque:  // the model of this test has no friction
        return Rigid(sample)[joint];
      case Quantity::kDelayedTorque:  // by one sample
        return Rigid(std::max(sample - 1, 0))[joint];
      case Quantity::kGravityTorque:
        return Torque(arm_.bodies(), sample, none, none)[joint];
      case Quantity::kMassMatrix: {
        const VectorXd unit = VectorXd::Unit(n(), w.index);
        return (Torque(arm_.bodies(), sample, none, unit) - Torque(arm_.bodies(), sample, none, none))[row] -
               (row == w.index ? Rotor(row) : 0);
      }
      case Quantity::kGravitySlope:
        return Torque(arm_.bodies(), sample, none, none, w.index)[row];
      case Quantity::kGravityStiffness: {
        constexpr double kStep_rad = 1e-4;
        return (GravityAt(sample, w.index, kStep_rad) - GravityAt(sample, w.index, -kStep_rad))[row] / (2 * kStep_rad);
      }
      case Quantity::kTorqueSlope: {
        constexpr double kStep_rad = 1e-4;
        return (RigidAt(sample, w.index, kStep_rad, 0) - RigidAt(sample, w.index, -kStep_rad, 0))[row] /
               (2 * kStep_rad);
      }
      case Quantity::kTorqueSpeedSlope:  // a parabola over the speed
        return (RigidAt(sample, w.index, 0, 1) - RigidAt(sample, w.index, 0, -1))[row] / 2;
      case Quantity::kFlangePosition:
        return FlangeAt(sample).p[w.index];
      case Quantity::kApproach:
        return FlangeAt(sample).M.UnitZ()[w.index];
      case Quantity::kFlangeJacobian:
      case Quantity::kApproachSlope: {
        constexpr double kStep_rad = 1e-5;
        const KDL::Frame after = FlangeAt(sample, row, kStep_rad), before = FlangeAt(sample, row, -kStep_rad);
        const KDL::Vector change =
            w.quantity == Quantity::kFlangeJacobian ? after.p - before.p : after.M.UnitZ() - before.M.UnitZ();
        return change[w.index] / (2 * kStep_rad);
      }
      case Quantity::kBodyColumn: {  // the torque is linear in the bodies
        VectorXd more = arm_.bodies();
        more[11 * w.index + w.parameter] += 1;
        return (Torque(more, sample, At(data_.s.qd, sample), At(data_.s.qdd, sample)) - Rigid(sample))[row];
      }
      default:
        ADD_FAILURE() << "no oracle for " << w.text;
        return 0;
    }
  }

  codegen::EffectRecord Record(const codegen::QuantityInfo& info, const std::string& expression) {
    const bool sensor = info.sensor_only;
    std::ofstream file(folder_ / "word.toml");
    file << "name = \"word\"\ntitle = \"w\"\nscope = \"arm\"\ninputs = [\"" << info.declared << "\"]\n"
         << (sensor ? "class = \"sensor\"\nremedy = \"none\"\napply = { how = \"delay\", by = \"d\" }\n"
                    : "class = \"static\"\n")
         << "[[linear]]\nname = \"a\"\nunit = \"1\"\nrows = { all = \"" << expression << "\" }\n"
         << "[[nonlinear]]\nname = \"d\"\nunit = \"s\"\nlower = 0\nupper = 1\ninitial = " << kStep_s << "\n";
    file.close();
    return codegen::ReadEffect(folder_ / "word.toml");
  }

  // The largest error of the column that diagnosis evaluates, relative to the largest value.
  double Error(const codegen::QuantityInfo& info, const Word& word) {
    const codegen::EffectRecord record = Record(info, word.text);
    const Candidate candidate(record, arm_.model().robot(), {});
    VectorXd x = VectorXd::Zero(arm_.model().columns() + n());
    x.segment(arm_.model().front(), arm_.model().rigid()) = arm_.model().base_map() * arm_.bodies();
    Quantities quantities = MakeQuantities(arm_.model(), data_, candidate.inputs());
    Follow(arm_.model(), torque_, x, {}, candidate.inputs(), quantities);
    std::vector<std::vector<VectorXd>> value;
    candidate.Evaluate(quantities, {kStep_s}, value);
    double error = 0, scale = 1e-3;
    for (std::size_t r = 0; r < candidate.rows().size(); ++r)
      for (const int sample : {1, 40, 90}) {
        const double expected = Oracle(word, candidate.rows()[r], sample);
        error = std::max(error, std::abs(value[0][r][sample] - expected)), scale = std::max(scale, std::abs(expected));
      }
    return error / scale;
  }

  files::test::TemporaryFolder folder_;
  tests::SyntheticArm arm_;
  calibration::Dataset data_;
  codegen::ArmTorque torque_;
};

// 1e-8: a body's column is a difference of torques a thousand times as large, and the base map has 14 digits.
TEST_F(EveryQuantity, IsEvaluated_AsKdlHasIt) {
  for (const codegen::QuantityInfo& info : codegen::QuantityTable())
    for (const Word& word : WordsOf(info, n())) EXPECT_LT(Error(info, word), 1e-8) << word.text;
}

// The oracle can tell two bodies apart.
TEST_F(EveryQuantity, AnotherBodysColumn_IsNoticed) {
  const codegen::QuantityInfo& info = *codegen::FindWord("Y");
  Word wrong = WordsOf(info, n())[20];  // Y[3, m] ...
  wrong.index = n() - 1;                // ... against the flange's
  EXPECT_GT(Error(info, wrong), 0.1);
}

}  // namespace
}  // namespace armcal::diagnosis
