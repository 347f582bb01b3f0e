// generator - an effect record on given joints of a robot: its columns as expressions.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "codegen/src/generator/effect.hpp"
#include "codegen/src/generator/graph.hpp"
#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

struct EffectColumn {
  std::string name, unit;    // "torque_offset.To3"
  std::string key;           // "To": what a robot file calls it inside [[effect]]
  std::map<int, Expr> rows;  // joint (0-based) -> column value in that joint's row
  double sd = 0, lower = 0, upper = 0, process_noise = 0;
  bool fixed_amplitude = false;
  double amplitude = 0;
};

struct EffectUnknown {     // a nonlinear parameter
  std::string name, unit;  // "stribeck.vs3"; also the name of its graph input
  std::string key;         // "vs"
  double lower = 0, upper = 0, initial = 0;
  bool logarithmic = false;
};

struct EffectInstance {
  const EffectRecord* record = nullptr;
  std::vector<int> joints;
  std::vector<EffectColumn> columns;
  std::vector<EffectUnknown> unknowns;
  std::vector<Expr> settled;  // each 1 once its state no longer remembers how it started, 0 before; empty: always
  std::map<std::string, double> constants;  // of the robot file, which rows and states read: "speed_limit3"
};

// The value of a quantity of QuantityTable, wherever an effect reads one: a graph input (host, whole logs) or an
// expression.
using QuantitySource = std::function<Expr(const InputId& id)>;

// Every quantity as an input of the graph.
QuantitySource QuantitiesAsInputs(Graph& graph);

// Throws io::InputError naming the record where an expression does not parse or does not fit the scope. ordinal: 1 for
// the first use of the record on these joints; a second harmonic of the same ripple is 2 and gets names of its own.
EffectInstance Instantiate(Graph& graph, const EffectRecord& record, const Robot& robot, const std::vector<int>& joints,
                           const QuantitySource& quantities, int ordinal = 1);

// The joint sets on which a record may be tried: each joint, each ordered pair, or the whole arm once.
std::vector<std::vector<int>> JointSets(const EffectRecord& record, int joints);

}  // namespace armcal::codegen
