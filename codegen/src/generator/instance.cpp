// generator - binds a record's names to a robot's joints and parses its expressions.
#include "codegen/src/generator/instance.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/generator/expression.hpp"
#include "codegen/src/generator/rigid_body.hpp"
#include "codegen/src/io/input_error.hpp"

namespace armcal::codegen {
namespace {

// How far from its base the arm gets at most, m.
double ReachOf(const Robot& robot) {
  double sum = 0;
  for (const Joint& j : robot.joint) {
    sum += std::abs(j.kinematics.a_m) + std::abs(j.kinematics.d_m);
    if (j.kinematics.type == JointType::kPrismatic)
      sum += std::max(std::abs(j.position_limit_rad[0]), std::abs(j.position_limit_rad[1]));
  }
  return sum;
}

// Constants of the arm or of one joint that records may use.
bool RobotConstant(const Robot& robot, int joint, const std::string& name, double& value) {
  const Joint& j = robot.joint[static_cast<std::size_t>(joint)];
  const double range[] = {j.position_limit_rad[0], j.position_limit_rad[1]};
  if (name == "torque_limit") value = j.torque_limit_Nm;
  else if (name == "torque_noise") value = j.torque_noise_Nm;
  else if (name == "speed_limit") value = j.speed_limit_radps;
  else if (name == "acceleration_limit") value = j.acceleration_limit_radps2;
  else if (name == "position_lower") value = range[0];
  else if (name == "position_upper") value = range[1];
  else if (name == "v_min") value = j.v_min_radps;
  else if (name == "reach") value = ReachOf(robot);
  else if (name == "pi") value = 3.14159265358979323846;
  else return false;
  return true;
}

// Everything a record's expressions may name, for one row and one array index.
class Names {
 public:
  Names(Graph& g, const EffectRecord& record, const Robot& robot, const std::vector<int>& joints,
        const QuantitySource& quantities)
      : g_(g), record_(record), robot_(robot), joints_(joints), quantities_(quantities) {}

  int row = 0;        // the joint whose row is being written
  std::string index;  // text of the array index i
  std::map<std::string, Expr> unknowns;
  std::map<std::string, Expr> states;       // name -> new value; in its own step the old one
  std::map<std::string, double> constants;  // of the robot file, which were read

  Scope scope() {
    const auto sgn = [this](Expr x) {
      return robot_.sign_law == "tanh" ? g_.Unary(Op::kTanh, (1 / robot_.sign_width_radps) * x)
                                       : g_.Unary(Op::kSign, x);
    };
    return {[this](const std::string& name, const std::vector<std::string>& indices, Expr& value) {
              return Find(name, indices, value);
            },
            sgn};
  }

 private:
  bool JointOf(const std::vector<std::string>& indices, int& joint) const {
    if (indices.empty()) return joint = joints_.empty() ? row : joints_[0], true;
    const std::string& text = indices[0];
    if (text == "r") return joint = row, true;
    if (text == "j" && !joints_.empty()) return joint = joints_[0], true;
    if (text == "k" && joints_.size() > 1) return joint = joints_[1], true;
    int number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size() || number < 1 || number > robot_.joints())
      return false;
    return joint = number - 1, true;
  }
  bool Find(const std::string& name, const std::vector<std::string>& indices, Expr& value) {
    if (const auto it = unknowns.find(name); it != unknowns.end() && indices.empty()) return value = it->second, true;
    if (const auto it = states.find(name); it != states.end() && indices.empty()) return value = it->second, true;
    if (name == "i" && indices.empty() && !index.empty()) {
      double number = 0;
      const auto [end, error] = std::from_chars(index.data(), index.data() + index.size(), number);
      if (error != std::errc() || end != index.data() + index.size()) return false;
      return value = g_.Constant(number), true;
    }
    for (const std::string& line : record_.let) {
      const auto equals = line.find('=');
      std::string defined = line.substr(0, equals);
      while (!defined.empty() && defined.back() == ' ') defined.pop_back();
      if (equals == std::string::npos || defined != name || !indices.empty()) continue;
      if (!open_.insert(name).second) throw io::InputError(record_.path + ": let " + name + ": it reads itself");
      value = ParseExpression(g_, line.substr(equals + 1), scope(), record_.path + ": let " + name);
      open_.erase(name);
      return true;
    }
    if (const QuantityInfo* info = FindWord(name)) return ReadQuantity(*info, indices, value);
    int joint = 0;
    if (!JointOf(indices, joint)) return false;
    double constant = 0;
    if (!RobotConstant(robot_, joint, name, constant)) return false;
    if (name != "pi") constants[name + std::to_string(joint + 1)] = constant;
    return value = g_.Constant(constant), true;
  }
  // Text of an index: "i" is that of an array parameter.
  const std::string& OrIndex(const std::string& text) const { return text == "i" ? index : text; }
  static bool AxisOf(const std::string& text, int& axis) {
    const auto at = std::string("xyz").find(text);
    if (text.size() != 1 || at == std::string::npos) return false;
    return axis = static_cast<int>(at), true;
  }
  bool ReadQuantity(const QuantityInfo& info, const std::vector<std::string>& indices, Expr& value) {
    if (info.sensor_only && record_.effect_class != EffectClass::kSensor) return false;
    InputId id{info.quantity};
    switch (info.indexing) {
      case Indexing::kNone:
        if (!indices.empty()) return false;
        break;
      case Indexing::kJoint:
        if (indices.size() > 1 || !JointOf(indices, id.row)) return false;
        break;
      case Indexing::kBody: {  // Y[flange, mx], Y[3, m], or Y[flange, i] with a parameter's name as the array index
        if (indices.size() != 2) return false;
        const std::string& name = OrIndex(indices[1]);
        const auto at = std::find(std::begin(kBodyParameterName), std::end(kBodyParameterName), name);
        id.row = row;
        id.body = indices[0] == "flange" ? robot_.joints() - 1 : std::atoi(indices[0].c_str()) - 1;
        id.parameter = static_cast<int>(at - std::begin(kBodyParameterName));
        if (id.body < 0 || id.body >= robot_.joints() || id.parameter >= 10) return false;
        break;
      }
      case Indexing::kRowJoint:
        if (indices.size() != 2 || !JointOf({indices[0]}, id.row) || !JointOf({indices[1]}, id.body)) return false;
        break;
      case Indexing::kRowAxis:
        if (indices.size() != 2 || !JointOf({indices[0]}, id.row) || !AxisOf(OrIndex(indices[1]), id.parameter))
          return false;
        break;
      case Indexing::kAxis:
        if (indices.size() != 1 || !AxisOf(OrIndex(indices[0]), id.parameter)) return false;
        break;
    }
    if (info.quantity == Quantity::kFlangePosition)
      constants[std::string("base_") + "xyz"[id.parameter]] = robot_.base_xyz_m[static_cast<std::size_t>(id.parameter)];
    value = quantities_(id);
    return true;
  }

  Graph& g_;
  const EffectRecord& record_;
  const Robot& robot_;
  const std::vector<int>& joints_;
  const QuantitySource& quantities_;
  std::set<std::string> open_;  // lets that are being read
};

double ConstantValue(Graph& g, const std::string& text, const Robot& robot, const std::vector<int>& joints,
                     const std::string& where) {
  const int joint = joints.empty() ? robot.joints() - 1 : joints[0];
  const Scope scope{[&](const std::string& name, const std::vector<std::string>& indices, Expr& value) {
                      double constant = 0;
                      if (!indices.empty() || !RobotConstant(robot, joint, name, constant)) return false;
                      return value = g.Constant(constant), true;
                    },
                    [&](Expr x) { return g.Unary(Op::kSign, x); }};
  const Expr e = ParseExpression(g, text, scope, where);
  const Node& n = g.nodes()[e.id()];
  if (n.op == Op::kConstant) return n.value;
  return -g.nodes()[n.a].value;  // constants fold, so this is a negated one
}

std::string Suffix(const std::vector<int>& joints) {
  std::string s;
  for (const int j : joints) s += (s.empty() ? "" : "_") + std::to_string(j + 1);
  return s;
}

// The record's own states, in the order written: a step sees those above it as new values, itself as the old one.
void MakeStates(Graph& g, const EffectRecord& record, const std::string& prefix, const std::string& suffix,
                Names& names, EffectInstance& out) {
  for (const RecordState& s : record.state) {
    const std::string where = record.path + ": state " + s.name;
    const Expr initial = ParseExpression(g, s.initial, names.scope(), where + ", initial");
    for (const auto& [name, input] : names.unknowns)
      if (Reads(initial, input))
        throw io::InputError(where + ", initial: expected no nonlinear parameter, not " + name);
    const std::string full = prefix + s.name + suffix;
    const auto step = [&](Expr value) {
      names.states[s.name] = value;
      return ParseExpression(g, s.step, names.scope(), where + ", step");
    };
    names.states[s.name] = step(g.State(full, initial, step));
    if (s.settled.empty()) continue;
    const Expr now = ParseExpression(g, s.settled, names.scope(), where + ", settled");
    const auto latch = [&](Expr value) { return g.Binary(Op::kMax, value, 0.5 * (g.Unary(Op::kSign, now) + 1.0)); };
    out.settled.push_back(latch(g.State(full + " settled", g.Constant(0), latch)));
  }
}

}  // namespace

QuantitySource QuantitiesAsInputs(Graph& graph) {
  return [&graph](const InputId& id) { return graph.Input(id); };
}

std::vector<std::vector<int>> JointSets(const EffectRecord& record, int n) {
  std::vector<std::vector<int>> sets;
  switch (record.scope) {
    case EffectScope::kJoint:
      for (int j = 0; j < n; ++j) sets.push_back({j});
      break;
    case EffectScope::kPair:
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k)
          if (j != k) sets.push_back({j, k});
      break;
    case EffectScope::kArm:
    case EffectScope::kBody:
      sets.push_back({});
      break;
  }
  return sets;
}

EffectInstance Instantiate(Graph& g, const EffectRecord& record, const Robot& robot, const std::vector<int>& joints,
                           const QuantitySource& quantities, int ordinal) {
  const std::size_t expected = record.scope == EffectScope::kJoint ? 1 : (record.scope == EffectScope::kPair ? 2 : 0);
  if (joints.size() != expected)
    throw io::InputError(record.path + ": scope: \"" + Word(record.scope) + "\" takes " + std::to_string(expected) +
                         " joint(s), not " + std::to_string(joints.size()));
  EffectInstance out;
  out.record = &record;
  out.joints = joints;
  const std::string number = ordinal > 1 ? "_" + std::to_string(ordinal) : "";
  const std::string prefix = record.friction_law ? "" : record.name + number + ".", suffix = Suffix(joints);
  Names names(g, record, robot, joints, quantities);
  names.row = joints.empty() ? 0 : joints[0];
  const std::size_t states_before = g.states().size();
  for (const NonlinearParameter& p : record.nonlinear) {
    const std::string where = record.path + ": nonlinear " + p.name;
    EffectUnknown u{prefix + p.name + suffix,
                    p.unit,
                    p.name,
                    ConstantValue(g, p.lower, robot, joints, where),
                    ConstantValue(g, p.upper, robot, joints, where),
                    ConstantValue(g, p.initial, robot, joints, where),
                    p.logarithmic};
    if (!(u.lower <= u.initial && u.initial <= u.upper))
      throw io::InputError(where + ": expected lower <= initial <= upper");
    names.unknowns[p.name] = g.Symbol(u.name);
    out.unknowns.push_back(u);
  }
  MakeStates(g, record, prefix, suffix, names, out);
  for (const LinearParameter& p : record.linear) {
    const std::vector<std::string> one{""};
    for (const std::string& index : p.index.empty() ? one : p.index) {
      EffectColumn c;
      c.name = prefix + p.name + (index.empty() ? "" : index) + (index.empty() || suffix.empty() ? "" : "_") + suffix;
      c.key = p.name + index;
      c.unit = p.unit;
      c.sd = ConstantValue(g, p.sd, robot, joints, record.path + ": sd of " + p.name);
      c.lower = p.lower;
      c.upper = p.upper;
      c.process_noise = p.process_noise;
      c.fixed_amplitude = p.fixed_amplitude;
      c.amplitude = p.amplitude;
      names.index = index;
      for (const auto& [row, text] : p.rows) {
        const std::string where = record.path + ": rows." + row + " of " + p.name;
        std::vector<int> targets;
        if (row == "j" && !joints.empty()) targets = {joints[0]};
        else if (row == "k" && joints.size() > 1) targets = {joints[1]};
        else if (row == "all")
          for (int i = 0; i < robot.joints(); ++i) targets.push_back(i);
        else if (const int at = std::atoi(row.c_str()); joints.empty() && at >= 1 && at <= robot.joints())
          targets = {at - 1};
        else
          throw io::InputError(where + ": expected a row of scope \"" + Word(record.scope) +
                               "\": j, k, all or, without joints of its own, a joint's number");
        for (const int i : targets) {
          names.row = i;
          const Expr e = ParseExpression(g, text, names.scope(), where);
          if (!e.IsZero()) c.rows[i] = e;
        }
      }
      out.columns.push_back(std::move(c));
    }
  }
  if (record.effect_class == EffectClass::kStatic && g.states().size() > states_before)
    throw io::InputError(record.path + ": class: expected \"stateful\", since an expression has memory");
  out.constants = std::move(names.constants);
  return out;
}

}  // namespace armcal::codegen
