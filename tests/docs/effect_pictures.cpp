// tests - draws one picture for each effect record: the torque of its columns over the signal that tells the effect.
//
// The columns are those that diagnosis evaluates. The arm is er20_like: joint 2, or joints 5 and 6.
#include <fmt/format.h>

#include <functional>
#include <numbers>

#include "host_sim/diagnose/diagnosis/work.hpp"
#include "tests/docs/drawn.hpp"
#include "tests/docs/pictures.hpp"

namespace armcal::tests {
namespace {

using codegen::Quantity;
using codegen::Signals;
using Eigen::VectorXd;
using Values = std::map<std::string, double>;
using Motion = std::function<void(Signals&)>;

constexpr int kPoints = 1601, kJoint = 1;

// One line: the torque of a joint for these parameters, by their keys in the record. Linear parameters that are not
// named are 0. Nonlinear ones have their initial value.
struct Line {
  std::string name;
  Values value = {};
  int row = kJoint;
  Motion besides = {};  // changes the sheet's motion
  bool dashed = false;
  int colour = -1;
};

struct Sheet {
  Quantity over = Quantity::kSpeed;  // the axis
  int joint = kJoint;                // of the axis
  double low = 0, high = 0;          // a sweep over it ...
  Motion motion = {};                // ... or a motion
  bool logarithmic = false, with_model = false;
  std::vector<Line> lines = {};
};

class Bench {
 public:
  const codegen::Catalogue& records() const { return records_; }
  const codegen::Robot& robot() const { return model_.robot(); }
  std::string Draw(const codegen::EffectRecord& record) const;

 private:
  using Candidate = diagnosis::Candidate;
  Sheet Default(const Candidate& candidate) const;
  Signals Move(const Sheet& sheet) const;
  VectorXd Read(const Sheet& sheet, Signals s) const;
  VectorXd Torque(const Candidate& candidate, const Line& line, const Signals& s, bool with_model) const;
  diagnosis::Quantities Follow(const calibration::Dataset& data, const std::set<codegen::InputId>& reads) const;

  codegen::Catalogue records_ = codegen::ReadCatalogue("codegen/effects");
  codegen::Model model_{codegen::ReadRobot("codegen/robots/er20_like.toml"), records_};
  codegen::ArmTorque arm_{model_};
  VectorXd x_ = calibration::MakePrior(model_).mean;
};

calibration::Dataset DataOf(const Signals& s) {
  calibration::Dataset data;
  data.s = s, data.tau.setZero(s.samples(), s.q.cols());
  return data;
}

diagnosis::Quantities Bench::Follow(const calibration::Dataset& data, const std::set<codegen::InputId>& reads) const {
  diagnosis::Quantities out = diagnosis::MakeQuantities(model_, data, reads);
  diagnosis::Follow(model_, arm_, x_, calibration::MeanUnknowns(model_), reads, out);
  return out;
}

// At rest in one pose; 1 kHz.
Signals Rest(int joints, int samples) {
  Signals s;
  s.t = VectorXd::LinSpaced(samples, 0, 1e-3 * (samples - 1));
  s.q = s.qd = s.qdd = Eigen::MatrixXd::Zero(samples, joints);
  for (int j = 0; j < joints; ++j) s.q.col(j).setConstant(0.3 + 0.1 * j);
  s.temp = Eigen::MatrixXd::Constant(samples, joints, 40);
  return s;
}

// The signal that is the axis; null: it follows from the arm.
double* Signal(Quantity over, int joint, Signals& s) {
  switch (over) {
    case Quantity::kTime:
      return s.t.data();
    case Quantity::kPosition:
      return s.q.col(joint).data();
    case Quantity::kSpeed:
      return s.qd.col(joint).data();
    case Quantity::kAcceleration:
      return s.qdd.col(joint).data();
    case Quantity::kTemperature:
      return s.temp.col(joint).data();
    default:
      return nullptr;
  }
}

VectorXd Bench::Read(const Sheet& sheet, Signals s) const {
  if (const double* signal = Signal(sheet.over, sheet.joint, s)) return Eigen::Map<const VectorXd>(signal, s.samples());
  const calibration::Dataset data = DataOf(s);
  const diagnosis::Quantities all = Follow(data, {{sheet.over, sheet.joint}});
  return (sheet.over == Quantity::kModelTorque ? all.tau_model : all.parts.rigid).col(sheet.joint);
}

Signals Bench::Move(const Sheet& sheet) const {
  Signals s = Rest(model_.joints(), kPoints);
  if (sheet.motion) return sheet.motion(s), s;
  VectorXd u = VectorXd::LinSpaced(kPoints, sheet.low, sheet.high);
  if (sheet.logarithmic) u = VectorXd::LinSpaced(kPoints, std::log(sheet.low), std::log(sheet.high)).array().exp();
  const double step = 1e-6 * (sheet.high - sheet.low);  // so that zero is zero
  u = (u / step).array().round() * step;
  if (double* signal = Signal(sheet.over, sheet.joint, s)) return Eigen::Map<VectorXd>(signal, kPoints) = u, s;
  const VectorXd at_rest = Read(sheet, s);  // of a load; a joint's acceleration makes any load
  auto acceleration = s.qdd.col(sheet.joint);
  acceleration.setOnes();
  return acceleration = (u - at_rest).cwiseQuotient(Read(sheet, s) - at_rest), s;
}

VectorXd Bench::Torque(const Candidate& candidate, const Line& line, const Signals& s, bool with_model) const {
  const calibration::Dataset data = DataOf(s);
  std::set<codegen::InputId> reads = candidate.inputs();
  if (with_model) reads.insert({Quantity::kModelTorque, line.row});
  const diagnosis::Quantities quantities = Follow(data, reads);
  std::vector<double> eta = candidate.Initial();
  const auto look_up = [&](const std::string& key, double& value) {
    if (const auto it = line.value.find(key); it != line.value.end()) value = it->second;
  };
  for (std::size_t k = 0; k < eta.size(); ++k) look_up(candidate.unknowns()[k].key, eta[k]);
  VectorXd amplitude = VectorXd::Zero(candidate.columns(eta));
  for (int c = 0; c < amplitude.size(); ++c) look_up(candidate.column(c).key, amplitude[c]);
  const VectorXd torque = CandidateTorque(candidate, quantities, eta, amplitude).col(line.row);
  return with_model ? VectorXd(torque + quantities.tau_model.col(line.row)) : torque;
}

Motion Speed(int joint, double radps) {
  return [=](Signals& s) { s.qd.col(joint).setConstant(radps); };
}

// The first signal of the record is the axis. If friction acts, its joint moves at 1 rad/s, and a dashed line shows the
// other direction.
Sheet Bench::Default(const Candidate& candidate) const {
  const codegen::EffectRecord& record = candidate.record();
  const std::vector<int>& joints = candidate.joints();
  const int own = joints.empty() ? kJoint : joints[0];
  const auto speed = [](const std::string& signal) { return signal.find("qd") != signal.npos; };
  std::string word = record.signals[0];
  Sheet sheet;
  sheet.joint = word.find("[k]") != word.npos ? joints[1] : own;
  if (word.rfind("sgn(", 0) == 0) word = word.substr(4, word.size() - 5);
  if (const auto* info = codegen::FindWord(word.substr(0, word.find('[')))) sheet.over = info->quantity;
  const codegen::Joint& joint = robot().joint[sheet.joint];
  if (sheet.over == Quantity::kPosition)
    sheet.low = joint.position_limit_rad[0], sheet.high = joint.position_limit_rad[1];
  else if (sheet.over == Quantity::kAcceleration) sheet.high = joint.acceleration_limit_radps2;
  else if (sheet.over == Quantity::kTemperature) sheet.low = 20, sheet.high = 60;
  else if (sheet.over == Quantity::kSpeed) sheet.high = joint.speed_limit_radps;
  else sheet.high = joint.torque_limit_Nm;
  if (sheet.low == 0) sheet.low = -sheet.high;
  for (const codegen::EffectUnknown& u : candidate.unknowns()) {
    if (u.key == "lo" || u.key == "t_begin" || u.key == "t_on") sheet.low = u.initial;
    if (u.key == "hi" || u.key == "t_end" || u.key == "t_off") sheet.high = u.initial;
  }
  const bool moves = !speed(record.signals[0]) && record.signals.size() > 1 && speed(record.signals[1]);
  const int columns = static_cast<int>(candidate.instance().columns.size());
  for (int c = 0; c < columns; ++c) {
    const codegen::EffectColumn& column = candidate.column(c);
    Line line{column.key, {{column.key, 1}}, column.rows.contains(own) ? own : column.rows.begin()->first};
    line.dashed = c >= report::kColours;
    if (moves) line.besides = Speed(own, 1);
    sheet.lines.push_back(line);
  }
  if (moves) {
    Line back = sheet.lines[static_cast<std::size_t>(columns) / 2];
    back.name += ", backward", back.besides = Speed(own, -1), back.dashed = true, back.colour = columns / 2;
    sheet.lines.push_back(back);
  }
  return sheet;
}

std::string Axis(Quantity over, int joint) {
  const std::string of = fmt::format(" of joint {}", joint + 1);
  switch (over) {
    case Quantity::kTime:
      return "time / s";
    case Quantity::kPosition:
      return "position" + of + " / rad";
    case Quantity::kSpeed:
      return "speed" + of + " / (rad/s)";
    case Quantity::kAcceleration:
      return "acceleration" + of + " / (rad/s^2)";
    case Quantity::kTemperature:
      return "temperature" + of + " / deg C";
    case Quantity::kModelTorque:
      return "true torque" + of + " / (N m)";
    default:
      return "load" + of + " / (N m)";
  }
}

using Change = std::function<void(Sheet&)>;
constexpr double kPi = std::numbers::pi;

Change Range(double low, double high) {
  return [=](Sheet& s) { s.low = low, s.high = high; };
}

// Over the position of joint 2: a sine that starts upwards. It ends a little after a whole loop, so that no sample lies
// at a turn, where rounding would decide the sign of speed.
Motion Loops(double amplitude_rad, double frequency_Hz = 0.5) {
  return [=](Signals& s) {
    const double w = 2 * kPi * frequency_Hz;
    s.t.setLinSpaced(0, 1.52 / frequency_Hz);
    s.q.col(kJoint) = amplitude_rad * (w * s.t.array()).sin();
    s.qd.col(kJoint) = amplitude_rad * w * (w * s.t.array()).cos();
  };
}
Change Looped(const Motion& motion, const std::vector<Line>& lines = {}) {
  return [=](Sheet& s) {
    s.over = Quantity::kPosition, s.motion = motion;
    if (!lines.empty()) s.lines = lines;
  };
}

// Joints 2 and 3 swing about an upright arm, so that their loads change sign.
void Swing(Signals& s) {
  s.t.setLinSpaced(0, 3.5);
  for (const int j : {1, 2}) {
    const double w = 2 * kPi * 0.25 * j, a = 0.5 / j;
    s.q.col(j) = a * (w * s.t.array()).sin() - (j == 2 ? 0.8 : 0.0);
    s.qd.col(j) = a * w * (w * s.t.array()).cos();
    s.qdd.col(j) = -a * w * w * (w * s.t.array()).sin();
  }
}

// Joint 2 starts and stops with a constant acceleration.
void Jump(Signals& s) {
  s.t.setLinSpaced(0, 0.8);
  const double step_s = s.t[1];
  for (int k = 1; k < s.samples(); ++k) {
    const double t_s = s.t[k] + 1e-9;  // no tie that rounding decides
    s.qdd(k, kJoint) = t_s < 0.1 || t_s > 0.7 ? 0 : t_s < 0.4 ? 5 : -5;
    s.qd(k, kJoint) = s.qd(k - 1, kJoint) + step_s * s.qdd(k, kJoint);
    s.q(k, kJoint) = s.q(k - 1, kJoint) + step_s * s.qd(k, kJoint);
  }
}
Change InTime(const Motion& motion, const std::vector<Line>& lines = {}, bool with_model = false) {
  return [=](Sheet& s) {
    s.over = Quantity::kTime, s.motion = motion, s.with_model = with_model;
    if (!lines.empty()) s.lines = lines;
  };
}

Change Over(Quantity over, int joint, double low, double high, const std::vector<Line>& lines,
            bool with_model = false) {
  return [=](Sheet& s) { s = {over, joint, low, high, {}, false, with_model, lines}; };
}

// The same parameters on several joints.
std::vector<Line> OnJoints(const std::vector<int>& rows, const Values& value) {
  std::vector<Line> lines;
  for (const int row : rows) lines.push_back({fmt::format("joint {}", row + 1), value, row});
  return lines;
}

// The same parameters at several places of another signal.
std::vector<Line> At(const std::vector<double>& places, const std::string& unit, int row, const Values& value,
                     const std::function<void(Signals&, double)>& besides) {
  std::vector<Line> lines;
  for (const double u : places)
    lines.push_back({fmt::format("joint 6 at {:g} {}", u, unit), value, row, [=](Signals& s) { besides(s, u); }});
  return lines;
}

Line Reference(const std::string& name) { return {.name = name, .dashed = true}; }

// Beside the joint's own friction, where the arm has no load.
Change OnFriction(const std::string& key, double size) {
  return [=](Sheet& s) {
    const Motion balanced = [](Signals& at) { at.q.col(kJoint).setConstant(-0.346); };
    s.with_model = true;
    s.lines = {Reference("without"), {fmt::format("with {} = {:g} N m", key, size), {{key, size}}}};
    for (Line& line : s.lines) line.besides = balanced;
  };
}

void Cells(Sheet& s) {
  s.over = Quantity::kPosition, s.motion = Loops(0.01);
  s.lines.pop_back();  // the other direction is in the loop
  for (Line& line : s.lines) line.besides = {};
}

// What a picture needs beyond the record's first signal.
const std::map<std::string, Change>& Changes() {
  static const std::map<std::string, Change> changes = {
      {"backlash", Looped(Loops(1e-3), {{"K = 1e6 N m/rad", {{"K", 1e6}}}, {"L = 0.5", {{"L", 0.5}}}})},
      {"backlash_load", InTime(Swing)},
      {"base_tilt", Over(Quantity::kPosition, 0, -kPi, kPi,
                         {{"gx, joint 2", {{"gx", 0.1}}},
                          {"gy, joint 2", {{"gy", 0.1}}},
                          {"hx, joint 1", {{"hx", 10}}, 0},
                          {"hy, joint 1", {{"hy", 10}}, 0}})},
      {"belt_elasticity", InTime(Jump)},
      {"belt_load", InTime(Jump, {{"", {{"C", 1e-5}}}})},
      {"coulomb_asymmetry", OnFriction("dFc", 30)},
      {"cross_ripple", Range(-0.5, 0.5)},
      {"curve_two_positions",
       [](Sheet& s) {
         s.lines = At({-3, -1, 1}, "rad", 4, {{"s22", 1}}, [](Signals& at, double u) { at.q.col(5).setConstant(u); });
       }},
      {"external_contact", Range(-0.5, 1.5)},
      {"flange_contact", Over(Quantity::kTime, 0, -0.5, 1.5, OnJoints({0, 1, 2}, {{"Fz", 1}, {"Fy", 1}}))},
      {"flange_hose", Over(Quantity::kPosition, 0, -kPi, kPi,
                           OnJoints({0, 1, 2}, {{"k", 100}, {"ax", 1}, {"az", 2.5}}))},
      {"friction_sech_tanh", Range(-1, 1)},
      {"friction_table",
       [](Sheet& s) {
         s.low = 1e-3, s.logarithmic = true;
         s.lines.pop_back();  // the viscous one
       }},
      {"gravity_spring", Range(-kPi, kPi)},
      {"hysteresis", Cells},
      {"hysteresis_loops", Cells},
      {"joint_compliance", Over(Quantity::kPosition, kJoint, -1.5, 1.2, OnJoints({1, 2}, {{"C", 1e-5}}))},
      {"load_linear", [](Sheet& s) { s.over = Quantity::kPosition, s.low = -1.5, s.high = 1.2; }},
      {"meshing_friction", Range(-0.5, 0.5)},
      {"payload_step", InTime(Swing, OnJoints({1, 2}, {{"pm", 5}, {"t_on", 1}, {"t_off", 3}}))},
      {"presliding_dahl", Looped(Loops(5e-3), {{"", {{"Fc", 1}}}})},
      {"presliding_lugre", Looped({}, {{"slow, 0.03 rad/s at most", {{"Fc", 1}}, kJoint, Loops(5e-3, 1)},
                                       {"fast, 0.3 rad/s at most", {{"Fc", 1}}, kJoint, Loops(5e-3, 10)}})},
      {"stribeck", Range(-0.5, 0.5)},
      {"stribeck_basis", Range(-0.6, 0.6)},
      {"time_delay", InTime(Swing, {Reference("read in time"), {"read 0.1 s late", {{"e", 1}, {"d", 0.1}}}}, true)},
      {"torque_gain_error", Over(Quantity::kModelTorque, kJoint, -2200, 2200,
                                 {Reference("true"), {"read with g = 0.1", {{"g", 0.1}}}}, true)},
      {"torque_offset", OnFriction("To", 30)},
      {"torque_ripple", Range(-0.5, 0.5)},
      {"torque_saturation", Over(Quantity::kModelTorque, kJoint, -3000, 3000,
                                 {Reference("true"), {"read with s = 1", {{"s", 1}}}}, true)},
      {"velocity_product",
       [](Sheet& s) {
         s.lines = At({-1, 1, 2}, "rad/s", 4, {{"c", 1}}, [](Signals& at, double u) { at.qd.col(5).setConstant(u); });
       }},
      {"wrist_coupling", [](Sheet& s) {
         s.lines.clear();
         for (const char* key : {"Fc", "Fv"})
           for (const int row : {4, 5})
             s.lines.push_back({fmt::format("{}, joint {}", key, row + 1), {{key, 1}}, row, [](Signals& at) {
                                  at.qd.col(5).setOnes();
                                }});
       }},
  };
  return changes;
}

std::string Bench::Draw(const codegen::EffectRecord& record) const {
  std::vector<int> joints;
  if (record.scope == codegen::EffectScope::kJoint) joints = {kJoint};
  if (record.scope == codegen::EffectScope::kPair) joints = {4, 5};
  const Candidate candidate(record, robot(), joints);
  Sheet sheet = Default(candidate);
  if (const auto it = Changes().find(record.name); it != Changes().end()) it->second(sheet);
  report::Plot plot;
  bool one_joint = true;
  for (const Line& line : sheet.lines) {
    Signals s = Move(sheet);
    if (line.besides) line.besides(s);
    plot.series.push_back(
        Curve(line.name, Read(sheet, s), Torque(candidate, line, s, sheet.with_model), sheet.logarithmic));
    if (line.dashed) plot.series.back().style = report::Style::kDashes;
    plot.series.back().colour = line.colour;
    one_joint = one_joint && line.row == sheet.lines[0].row;
  }
  plot.text.title = record.title.substr(0, record.title.find(':'));
  plot.text.x_label = Axis(sheet.over, sheet.joint);
  plot.text.y_label = one_joint ? fmt::format("torque of joint {} / (N m)", sheet.lines[0].row + 1) : "torque / (N m)";
  plot.logarithmic_x = sheet.logarithmic;
  return File(plot);
}

}  // namespace

Pictures EffectPictures() {
  const Bench bench;
  Pictures out;
  for (const auto& [name, record] : bench.records()) out["effects/" + name + ".svg"] = bench.Draw(record);
  return out;
}

}  // namespace armcal::tests
