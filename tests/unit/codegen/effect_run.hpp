// tests - a record on given joints of er20_like, run sample by sample on the graph. An input that the test does not
// supply reads as NaN, so a column that looks at more than it says fails.
#pragma once

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/generator/instance.hpp"
#include "codegen/src/generator/state_path.hpp"

namespace armcal::tests {

inline double Sign(double x) { return (x > 0) - (x < 0); }

inline const std::map<std::string, codegen::EffectRecord>& Records() {
  static const auto c = codegen::ReadCatalogue("codegen/effects");
  return c;
}

inline const codegen::Robot& Arm() {
  static const codegen::Robot r = codegen::ReadRobot("codegen/robots/er20_like.toml");
  return r;
}

// Where a record of this scope goes in these tests: joint 2, joints 5 and 6, or the whole arm.
inline std::vector<int> JointsFor(const codegen::EffectRecord& record) {
  if (record.scope == codegen::EffectScope::kJoint) return {1};
  return record.scope == codegen::EffectScope::kPair ? std::vector<int>{4, 5} : std::vector<int>{};
}

// This suite's own names of a graph's inputs: "q2", "M3_1", "Y1_5_0", "G0_2", "stribeck.vs2". Rows, columns, bodies and
// parameters count from 0, joints from 1.
inline std::string TestName(const codegen::InputId& i) {
  using codegen::Quantity;
  const auto numbers = [](int a, int b) { return std::to_string(a) + "_" + std::to_string(b); };
  if (i.quantity == Quantity::kBodyColumn) return "Y" + numbers(i.row, i.body) + "_" + std::to_string(i.parameter);
  if (i.quantity == Quantity::kMassMatrix) return "M" + numbers(i.row, i.body);
  if (i.quantity == Quantity::kGravitySlope) return "G" + numbers(i.row, i.parameter);
  if (i.quantity == Quantity::kGravityStiffness) return "K" + numbers(i.row, i.body);
  if (i.quantity == Quantity::kTorqueSlope) return "T" + numbers(i.row, i.body);
  if (i.quantity == Quantity::kTorqueSpeedSlope) return "V" + numbers(i.row, i.body);
  if (i.quantity == Quantity::kFlangePosition) return "F" + std::to_string(i.parameter);
  if (i.quantity == Quantity::kApproach) return "A" + std::to_string(i.parameter);
  if (i.quantity == Quantity::kFlangeJacobian) return "J" + numbers(i.row, i.parameter);
  if (i.quantity == Quantity::kApproachSlope) return "S" + numbers(i.row, i.parameter);
  return codegen::NameOf(i);
}

using Log = std::map<std::string, std::vector<double>>;  // graph input -> one value a sample
using Values = std::map<std::string, double>;            // nonlinear parameter, as the record calls it -> value

class EffectRun {
 public:
  EffectRun(const std::string& record, const std::vector<int>& joints = {1})
      : instance_(
            codegen::Instantiate(graph_, Records().at(record), Arm(), joints, codegen::QuantitiesAsInputs(graph_))) {}

  const codegen::EffectInstance& instance() const { return instance_; }
  codegen::Graph& graph() { return graph_; }
  codegen::Expr column(int c, int row) const { return instance_.columns[c].rows.at(row); }

  // roots over the log: [sample][root]. `wiggled`: this parameter gets an imaginary part (T = Complex).
  template <class T>
  std::vector<std::vector<T>> Run(const std::vector<codegen::Expr>& roots, const Log& log, const Values& eta,
                                  const std::string& wiggled = "") {
    const std::size_t count = graph_.states().size();
    std::vector<codegen::Expr> wanted = roots;
    for (const auto& s : graph_.states()) wanted.push_back(s.next);
    const codegen::Tape start(graph_, codegen::InitialValues(graph_, count)), step(graph_, wanted);
    const int samples = log.empty() ? 1 : static_cast<int>(log.begin()->second.size());
    std::vector<T> state;
    std::vector<std::vector<T>> out;
    for (int k = 0; k < samples; ++k) {
      std::vector<T> inputs;
      for (const codegen::InputId& input : graph_.inputs())
        inputs.push_back(Value<T>(TestName(input), k, log, eta, wiggled));
      if (k == 0) state = start.EvaluateAt<T>(inputs);
      for (std::size_t s = 0; s < count; ++s) inputs[graph_.nodes()[graph_.states()[s].value.id()].a] = state[s];
      std::vector<T> all = step.EvaluateAt<T>(inputs);
      state.assign(all.begin() + static_cast<std::ptrdiff_t>(roots.size()), all.end());
      all.resize(roots.size());
      out.push_back(all);
    }
    return out;
  }

  // One column in one row over the log.
  std::vector<double> Column(int c, int row, const Log& log, const Values& eta = {}) {
    std::vector<double> out;
    for (const auto& values : Run<double>({column(c, row)}, log, eta)) out.push_back(values[0]);
    return out;
  }

 private:
  template <class T>
  T Value(const std::string& name, int sample, const Log& log, const Values& eta, const std::string& wiggled) const {
    if (const auto it = log.find(name); it != log.end()) return T(it->second[sample]);
    for (const auto& u : instance_.unknowns) {
      if (u.name != name) continue;
      const auto it = eta.find(u.key);
      const double value = it != eta.end() ? it->second : u.initial;
      if constexpr (std::is_constructible_v<T, double, double>) return T(value, u.key == wiggled ? kStep : 0.0);
      else return T(value);
    }
    return T(std::numeric_limits<double>::quiet_NaN());
  }
  static constexpr double kStep = 1e-40;  // = kComplexStep

  codegen::Graph graph_;
  codegen::EffectInstance instance_;
};

}  // namespace armcal::tests
