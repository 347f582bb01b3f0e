// generator - temporaries just before their first use, sines and cosines in one branch-free block before the rest.
#include "codegen/src/generator/emit_body.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <sstream>

namespace armcal::codegen {
namespace {

bool IsLeaf(const Node& n) { return n.op == Op::kConstant || n.op == Op::kInput; }
bool IsSine(const Node& n) { return n.op == Op::kSin || n.op == Op::kCos; }

class Printer {
 public:
  Printer(const Graph& graph, const InputWriter& input, Passport& passport)
      : nodes_(graph.nodes()), graph_(graph), input_(input), passport_(passport) {}

  std::string Run(const std::vector<Assignment>& assignments) {
    Prepare(assignments);
    for (int l = 1; l <= levels_; ++l) SineBlock(l);
    std::string heading;
    for (const Assignment& a : assignments) {
      if (a.heading != heading && !a.heading.empty()) out_ << "    // " << a.heading << "\n";
      heading = a.heading;
      const std::string value = Output(a.value.id());
      out_ << "    " << a.target << " = " << value << ";\n";
    }
    return out_.str();
  }

 private:
  // What is needed, how often it is read, how many registers it takes (Sethi and Ullman), and how many sine blocks must
  // come before it.
  void Prepare(const std::vector<Assignment>& assignments) {
    const std::size_t count = nodes_.size();
    uses_.assign(count, 0);
    registers_.assign(count, 0);
    level_.assign(count, 0);
    for (const Assignment& a : assignments) ++uses_[a.value.id()];
    for (int i = static_cast<int>(count) - 1; i >= 0; --i) {
      if (!uses_[i] || IsLeaf(nodes_[i])) continue;
      ++uses_[nodes_[i].a];
      if (nodes_[i].b >= 0) ++uses_[nodes_[i].b];
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Node& n = nodes_[i];
      if (!uses_[i] || IsLeaf(n)) continue;
      const int b = n.b < 0 ? n.a : n.b;
      registers_[i] = std::max({1, registers_[n.a], registers_[b]}) + (n.b >= 0 && registers_[n.a] == registers_[b]);
      level_[i] = std::max(level_[n.a], level_[b]) + IsSine(n);
      levels_ = std::max(levels_, level_[i]);
    }
  }

  void SineBlock(int l) {
    std::map<int, int> slot;  // angle node -> place in the block
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (uses_[i] && level_[i] == l && IsSine(nodes_[i])) slot.try_emplace(nodes_[i].a, 0);
    int count = 0;
    std::string angles;
    for (auto& [angle, place] : slot) {
      Ensure(angle);
      place = count++;
      angles += (angles.empty() ? "" : ", ") + Operand(angle);
    }
    const std::string suffix = l > 1 ? std::to_string(l) : "";
    out_ << "    const T angle" << suffix << "[" << count << "] = {" << angles << "};\n    T sine" << suffix << "["
         << count << "], cosine" << suffix << "[" << count << "];\n    math::SinCosBlock<" << count << ">(angle"
         << suffix << ", sine" << suffix << ", cosine" << suffix << ");\n";
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (!uses_[i] || level_[i] != l || !IsSine(nodes_[i])) continue;
      const bool sine = nodes_[i].op == Op::kSin;
      name_[static_cast<int>(i)] = (sine ? "sine" : "cosine") + suffix + "[" + std::to_string(slot[nodes_[i].a]) + "]";
      ++passport_.sincos;
    }
  }

  // A product that only this sum reads becomes part of it: one multiply-add.
  bool Fuses(int product) const { return nodes_[product].op == Op::kMultiply && uses_[product] == 1; }

  // Text of a node's operation, its sign turned where `negative`; operands must have names.
  std::string Formula(int i, bool negative) {
    const Node& n = nodes_[i];
    const auto term = [&](int operand, bool minus) { return minus ? Minus(Operand(operand)) : Operand(operand); };
    if (n.op == Op::kMultiply) {
      ++passport_.multiplications;
      return term(n.a, negative) + " * " + Operand(n.b);
    }
    if (n.op == Op::kAdd || n.op == Op::kSubtract) {
      ++passport_.additions;
      const bool minus_b = (n.op == Op::kSubtract) != negative;
      const int product = Fuses(n.b) ? n.b : (Fuses(n.a) ? n.a : -1);
      if (product >= 0) {
        ++passport_.multiplications;
        const bool second = product == n.b;
        return "math::MulAdd(" + term(nodes_[product].a, second ? minus_b : negative) + ", " +
               Operand(nodes_[product].b) + ", " + (second ? term(n.a, negative) : term(n.b, minus_b)) + ")";
      }
      if (negative && n.op == Op::kSubtract) return Operand(n.b) + " - " + Operand(n.a);
      return Operand(n.a) + (n.op == Op::kAdd ? " + " : " - ") + Operand(n.b);
    }
    static const std::map<Op, const char*> functions = {
        {Op::kDivide, "Divide"}, {Op::kExp, "Exp"},   {Op::kLog, "Log"}, {Op::kTanh, "Tanh"},
        {Op::kCbrt, "Cbrt"},     {Op::kSqrt, "Sqrt"}, {Op::kPow, "Pow"}, {Op::kAbs, "Abs"},
        {Op::kSign, "Sign"},     {Op::kMin, "Min"},   {Op::kMax, "Max"}};
    if (n.op == Op::kDivide) ++passport_.divisions;
    else if (n.op != Op::kAbs && n.op != Op::kSign && n.op != Op::kMin && n.op != Op::kMax) ++passport_.functions;
    return std::string("math::") + functions.at(n.op) + "(" + Operand(n.a) + (n.b >= 0 ? ", " + Operand(n.b) : "") +
           ")";
  }

  // Makes a name for the node and, before it, for all it reads; the operand that takes more registers goes first.
  void Ensure(int i, bool negative = false) {
    const Node& n = nodes_[i];
    if (IsLeaf(n) || name_.contains(i)) return;
    if (n.op == Op::kNegate) return Ensure(n.a);
    std::vector<int> reads;
    for (const int operand : {n.a, n.b}) {
      if (operand < 0) continue;
      const bool inside =
          (n.op == Op::kAdd || n.op == Op::kSubtract) && operand == (Fuses(n.b) ? n.b : n.a) && Fuses(operand);
      if (inside) reads.insert(reads.end(), {nodes_[operand].a, nodes_[operand].b});
      else reads.push_back(operand);
    }
    std::stable_sort(reads.begin(), reads.end(), [&](int a, int b) { return registers_[a] > registers_[b]; });
    for (const int operand : reads) Ensure(operand);
    const std::string text = Formula(i, negative);
    std::string name;
    if (const auto it = graph_.names().find(i);
        !negative && it != graph_.names().end() && used_.insert(it->second).second)
      name = it->second;
    else name = "t" + std::to_string(++temporaries_);
    name_[i] = name;
    out_ << "    const T " << name << " = " << text << ";\n";
  }

  // What an assignment's right-hand side says. A sign that only the assignment reads costs nothing: the operation is
  // written with it.
  std::string Output(int i) {
    const Node& n = nodes_[i];
    const bool turns = n.op == Op::kNegate && uses_[i] == 1 && uses_[n.a] == 1 && !name_.contains(n.a) && Turns(n.a);
    if (turns) {
      Ensure(n.a, true);
      return name_.at(n.a);
    }
    Ensure(i);
    return Operand(i);
  }
  bool Turns(int i) const {
    const Node& n = nodes_[i];
    return n.op == Op::kMultiply || n.op == Op::kSubtract || (n.op == Op::kAdd && (Fuses(n.a) || Fuses(n.b)));
  }

  static std::string Minus(const std::string& text) { return text[0] == '-' ? text.substr(1) : "-" + text; }
  std::string Operand(int i) {
    const Node& n = nodes_[i];
    if (n.op == Op::kConstant) return "T(" + NumberText(n.value) + ")";
    if (n.op == Op::kInput) return input_(graph_.inputs()[n.a]);
    if (n.op == Op::kNegate) return Minus(Operand(n.a));
    return name_.at(i);
  }

  const std::vector<Node>& nodes_;
  const Graph& graph_;
  const InputWriter& input_;
  Passport& passport_;
  std::vector<int> uses_, registers_, level_;
  std::ostringstream out_;
  std::map<int, std::string> name_;
  std::set<std::string> used_;
  int temporaries_ = 0, levels_ = 0;
};

}  // namespace

std::string NumberText(double value) {
  char text[40];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  std::string s(text, end);
  if (s.find_first_of(".en") == std::string::npos) s += ".0";
  return s;
}

std::string EmitStatements(const Graph& graph, const std::vector<Assignment>& assignments, const InputWriter& input,
                           Passport& passport) {
  return Printer(graph, input, passport).Run(assignments);
}

}  // namespace armcal::codegen
