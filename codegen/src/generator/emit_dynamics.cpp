// generator - the text of dynamics.hpp (M, V and G of (1)) and registers.hpp.
#include <sstream>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/generator/emit_text.hpp"

namespace armcal::codegen {
namespace {

using Rows = std::vector<std::vector<Expr>>;

// Torque of joint i: base parameters times their columns.
Expr Torque(Graph& g, const Model& m, const Rows& rows, int i) {
  Expr sum = g.Constant(0);
  for (int d = 0; d < m.rigid(); ++d) sum = sum + rows[i][m.base_columns()[d]] * g.Input("base" + std::to_string(d));
  return sum;
}

// The rows with one quantity of every joint at given values.
Rows At(Graph& g, Rows rows, int joints, const char* quantity, const std::function<double(int)>& value) {
  std::unordered_map<int, Expr> at;
  for (int j = 0; j < joints; ++j) at.emplace(g.Input(InputName(quantity, j)).id(), g.Constant(value(j)));
  for (auto& row : rows)
    for (Expr& e : row) e = Substitute(e, at);
  return rows;
}

std::string Function(const Model& m, Graph& g, const char* comment, const char* head,
                     const std::vector<Assignment>& assignments) {
  Passport count;
  const std::string statements = EmitStatements(
      g, assignments,
      [&](const std::string& name) {
        return name.rfind("base", 0) == 0 ? "base[" + name.substr(4) + "]" : InputText(m, name);
      },
      count);
  return std::string("  // ") + comment + "; " + CountText(count) + ".\n  template <class T>\n  static void " + head +
         " {\n" + statements + "  }\n";
}

}  // namespace

std::string DynamicsHeader(const Model& m) {
  const int n = m.joints();
  Robot weightless = m.robot();
  weightless.gravity_mps2 = {};
  Graph g;
  const auto zero = [](int) { return 0.0; };
  const Rows moving = BodyRegressor(g, weightless), resting = BodyRegressor(g, m.robot(), false);
  const Rows steady = At(g, moving, n, "qdd", zero), still = At(g, moving, n, "qd", zero);
  std::vector<Assignment> mass, velocity, gravity;
  for (int j = 0; j < n; ++j) {
    const Rows column = At(g, still, n, "qdd", [j](int k) { return k == j ? 1.0 : 0.0; });
    for (int i = 0; i <= j; ++i) {
      const Expr entry = Torque(g, m, column, i);
      mass.push_back({"M[" + std::to_string(i * n + j) + "]", entry, ""});
      if (i != j) mass.push_back({"M[" + std::to_string(j * n + i) + "]", entry, ""});
    }
    velocity.push_back({"V[" + std::to_string(j) + "]", Torque(g, m, steady, j), ""});
    gravity.push_back({"G[" + std::to_string(j) + "]", Torque(g, m, resting, j), ""});
  }
  const std::string type = TypeName(m.robot().name);
  const std::string x = "([[maybe_unused]] const model::ModelInput<T, kJoints>& x, [[maybe_unused]] const T* base, T* ";
  std::ostringstream o;
  o << Heading(m, "mass matrix, velocity torque and gravity torque of " + m.robot().title + ", from base parameters.")
    << "#pragma once\n\n#include \"armcal/math/elementary.hpp\"\n#include \"armcal/math/mul_add.hpp\"\n#include "
       "\"armcal/model/contract.hpp\"\n\n"
    << "namespace armcal::generated {\n\n// M(q) qdd + V(q, qd) + G(q) = torque without friction and effects. base: "
    << m.rigid() << " base parameters, as in\n// filter coordinates [kFront, kFront + kRigid). Rotor inertias are part "
    << "of M. Context: any; straight-line.\nstruct " << type << "Dynamics {\n  static constexpr int kJoints = " << n
    << ";\n\n"
    << Function(m, g, "M[kJoints * kJoints], row-major, symmetric; reads q", ("MassMatrix" + x + "M)").c_str(), mass)
    << "\n"
    << Function(m, g, "V[kJoints]: centrifugal and Coriolis torque; reads q and qd",
                ("VelocityTorque" + x + "V)").c_str(), velocity)
    << "\n"
    << Function(m, g, "G[kJoints]; reads q", ("GravityTorque" + x + "G)").c_str(), gravity)
    << "};\n\n}  // namespace armcal::generated\n";
  return o.str();
}

std::string RegistersHeader(const Model& m) {
  const std::string type = TypeName(m.robot().name);
  std::ostringstream o;
  o << Heading(m, "where each filter coordinate's estimate stands on the wire (input registers); knows no regressor.")
    << "#pragma once\n\n#include \"armcal/link/registers.hpp\"\n\nnamespace armcal::generated {\n\n"
    << "// Filter A and B: each two registers, float, high word first.\nstruct " << type
    << "Register {\n  const char* name;\n  const char* unit;\n"
    << "  std::uint16_t estimate_a, deviation_a, estimate_b, deviation_b;\n};\n\n"
    << "inline constexpr " << type << "Register k" << type << "Registers[] = {\n";
  for (int c = 0; c < m.columns(); ++c) {
    o << "    {\"" << m.column_name(c) << "\", \"" << m.column_unit(c) << "\"";
    for (const char* block : {"kEstimateA", "kDeviationA", "kEstimateB", "kDeviationB"})
      o << ", link::reg::" << block << " + " << 2 * c;
    o << "},\n";
  }
  o << "};\n\n}  // namespace armcal::generated\n";
  return o.str();
}

}  // namespace armcal::codegen
