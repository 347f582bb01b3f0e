// generator - the text of dynamics.hpp (M, V and G of (1)) and registers.hpp.
#include <sstream>

#include "codegen/src/generator/dynamics.hpp"
#include "codegen/src/generator/emit_text.hpp"

namespace armcal::codegen {
namespace {

std::string Function(const Model& m, Graph& g, const char* comment, const char* head,
                     const std::vector<Assignment>& assignments) {
  Passport count;
  const std::string statements = EmitStatements(
      g, assignments,
      [&](const InputId& id) {
        return id.quantity == Quantity::kBaseParameter ? "base[" + std::to_string(id.parameter) + "]"
                                                       : InputText(m, id);
      },
      count);
  return std::string("  // ") + comment + "; " + CountText(count) + ".\n  template <class T>\n  static void " + head +
         " {\n" + statements + "  }\n";
}

}  // namespace

std::string DynamicsHeader(const Model& m) {
  const int n = m.joints();
  Graph g;
  const Dynamics dynamics = MakeDynamics(g, m.robot(), m.base_columns());
  const auto entry = [](const char* array, int index) {
    return std::string(array) + "[" + std::to_string(index) + "]";
  };
  std::vector<Assignment> mass, velocity, gravity;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) {
      mass.push_back({entry("M", i * n + j), dynamics.mass[j][i], ""});
      if (i != j) mass.push_back({entry("M", j * n + i), dynamics.mass[j][i], ""});
    }
    velocity.push_back({entry("V", j), dynamics.velocity[j], ""});
    gravity.push_back({entry("G", j), dynamics.gravity[j], ""});
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
