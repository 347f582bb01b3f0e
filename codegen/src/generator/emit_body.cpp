// generator - temporaries in dependency order, all sines and cosines of one depth in one branch-free block.
#include "codegen/src/generator/emit_body.hpp"

#include <charconv>
#include <map>
#include <set>
#include <sstream>

namespace armcal::codegen {
namespace {

class Printer {
 public:
  Printer(const Graph& graph, const std::function<std::string(const std::string&)>& input, Passport& passport)
      : nodes_(graph.nodes()), graph_(graph), input_(input), passport_(passport) {}

  std::string Run(const std::vector<Assignment>& assignments) {
    std::vector<int> uses(nodes_.size(), 0);
    std::vector<char> needed(nodes_.size(), 0);
    for (const Assignment& a : assignments) needed[a.value.id()] = 1;
    for (int i = static_cast<int>(nodes_.size()) - 1; i >= 0; --i) {
      if (!needed[i] || nodes_[i].op == Op::kInput) continue;
      for (const int operand : {nodes_[i].a, nodes_[i].b})
        if (operand >= 0) needed[operand] = 1;
    }
    // level: how many sine blocks must come before a node
    std::vector<int> level(nodes_.size(), 0);
    int levels = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!needed[i] || nodes_[i].op == Op::kInput || nodes_[i].op == Op::kConstant) continue;
      for (const int operand : {nodes_[i].a, nodes_[i].b})
        if (operand >= 0) level[i] = std::max(level[i], level[operand]);
      if (nodes_[i].op == Op::kSin || nodes_[i].op == Op::kCos) ++level[i];
      levels = std::max(levels, level[i]);
    }
    for (int l = 0; l <= levels; ++l) {
      if (l > 0) SineBlock(needed, level, l);
      for (std::size_t i = 0; i < nodes_.size(); ++i)
        if (needed[i] && level[i] == l) Statement(static_cast<int>(i));
    }
    for (const Assignment& a : assignments) out_ << "    " << a.target << " = " << Operand(a.value.id()) << ";\n";
    return out_.str();
  }

 private:
  void SineBlock(const std::vector<char>& needed, const std::vector<int>& level, int l) {
    std::map<int, int> slot;  // angle node -> place in the block
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (needed[i] && level[i] == l && (nodes_[i].op == Op::kSin || nodes_[i].op == Op::kCos))
        slot.try_emplace(nodes_[i].a, 0);
    int count = 0;
    std::string angles;
    for (auto& [angle, place] : slot) {
      place = count++;
      angles += (angles.empty() ? "" : ", ") + Operand(angle);
    }
    const std::string suffix = l > 1 ? std::to_string(l) : "";
    out_ << "    const T angle" << suffix << "[" << count << "] = {" << angles << "};\n    T sine" << suffix << "["
         << count << "], cosine" << suffix << "[" << count << "];\n    math::SinCosBlock<" << count << ">(angle"
         << suffix << ", sine" << suffix << ", cosine" << suffix << ");\n";
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!needed[i] || level[i] != l) continue;
      if (nodes_[i].op != Op::kSin && nodes_[i].op != Op::kCos) continue;
      const bool sine = nodes_[i].op == Op::kSin;
      name_[static_cast<int>(i)] = (sine ? "sine" : "cosine") + suffix + "[" + std::to_string(slot[nodes_[i].a]) + "]";
      ++passport_.sincos;
    }
  }

  void Statement(int i) {
    const Node& n = nodes_[i];
    std::string text;
    switch (n.op) {
      case Op::kConstant:
      case Op::kInput:
      case Op::kNegate:
      case Op::kSin:
      case Op::kCos:
        return;
      case Op::kAdd:
        text = Operand(n.a) + " + " + Operand(n.b), ++passport_.additions;
        break;
      case Op::kSubtract:
        text = Operand(n.a) + " - " + Operand(n.b), ++passport_.additions;
        break;
      case Op::kMultiply:
        text = Operand(n.a) + " * " + Operand(n.b), ++passport_.multiplications;
        break;
      case Op::kDivide:
        text = Call("Divide", n), ++passport_.divisions;
        break;
      case Op::kExp:
        text = Call("Exp", n), ++passport_.functions;
        break;
      case Op::kLog:
        text = Call("Log", n), ++passport_.functions;
        break;
      case Op::kTanh:
        text = Call("Tanh", n), ++passport_.functions;
        break;
      case Op::kCbrt:
        text = Call("Cbrt", n), ++passport_.functions;
        break;
      case Op::kSqrt:
        text = Call("Sqrt", n), ++passport_.functions;
        break;
      case Op::kPow:
        text = Call("Pow", n), ++passport_.functions;
        break;
      case Op::kAbs:
        text = Call("Abs", n);
        break;
      case Op::kSign:
        text = Call("Sign", n);
        break;
      case Op::kMin:
        text = Call("Min", n);
        break;
      case Op::kMax:
        text = Call("Max", n);
        break;
    }
    std::string name;
    if (const auto it = graph_.names().find(i); it != graph_.names().end() && used_.insert(it->second).second)
      name = it->second;
    else name = "t" + std::to_string(++temporaries_);
    name_[i] = name;
    out_ << "    const T " << name << " = " << text << ";\n";
  }

  std::string Call(const char* function, const Node& n) {
    return std::string("math::") + function + "(" + Operand(n.a) + (n.b >= 0 ? ", " + Operand(n.b) : "") + ")";
  }
  std::string Operand(int i) {
    const Node& n = nodes_[i];
    if (n.op == Op::kConstant) return "T(" + NumberText(n.value) + ")";
    if (n.op == Op::kInput) return input_(graph_.inputs()[n.a]);
    if (n.op == Op::kNegate) return "-" + Operand(n.a);
    return name_.at(i);
  }

  const std::vector<Node>& nodes_;
  const Graph& graph_;
  const std::function<std::string(const std::string&)>& input_;
  Passport& passport_;
  std::ostringstream out_;
  std::map<int, std::string> name_;
  std::set<std::string> used_;
  int temporaries_ = 0;
};

}  // namespace

std::string NumberText(double value) {
  char text[40];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  std::string s(text, end);
  if (s.find_first_of(".en") == std::string::npos) s += ".0";
  return s;
}

std::string EmitStatements(const Graph& graph, const std::vector<Assignment>& assignments,
                           const std::function<std::string(const std::string&)>& input, Passport& passport) {
  return Printer(graph, input, passport).Run(assignments);
}

}  // namespace armcal::codegen
