// generator - the pieces of text that the generated files share.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "codegen/src/generator/emit.hpp"

namespace armcal::codegen {

inline constexpr int kGeneratorVersion = 2;

struct Assignment {
  std::string target;  // "front[3]"
  Expr value;
  std::string heading;  // a comment line before it where it differs from the one before; may be empty
};

// The C++ text of a graph input.
using InputWriter = std::function<std::string(const InputId& input)>;

// Statements that compute all assignments, in their order: each value just before its first use, so that few are alive
// at a time. input: C++ text of a graph input by name.
std::string EmitStatements(const Graph& graph, const std::vector<Assignment>& assignments, const InputWriter& input,
                           Passport& passport);

std::string TypeName(const std::string& robot);               // er20_like -> Er20Like
std::string Float(double value);                              // as a float literal
std::string List(const std::vector<std::string>& items);      // { a, b, ... } broken into lines
std::string InputText(const Model& m, const InputId& input);  // C++ text of a graph input

template <class F>
std::string Indexed(int count, F text_of) {
  std::vector<std::string> items;
  for (int i = 0; i < count; ++i) items.push_back(text_of(i));
  return List(items);
}

// The first two lines of every generated C++ file, and #pragma once.
std::string Heading(const Model& m, const std::string& what);
std::string CountText(const Passport& count);  // "384 multiplications, 287 additions, ..."

// Motor counts and current -> joint units; the coupling's inverse and transpose, row-major.
struct AxisText {
  std::string axes, motor_to_joint, torque_to_joint;
};
// kUnit: of a joint without a motor counts and current are rad and N m, as the schema has them.
enum class WithoutMotor { kOnTheJoint, kUnit };
AxisText Axes(const Model& m, WithoutMotor without = WithoutMotor::kOnTheJoint);

// The emitted files and what goes into them.
struct Functions {
  std::string initial_state, regressor, jacobian;  // statements
  Passport count, jacobian_count;                  // of regressor and jacobian
};
std::string ModelHeader(const Model& m, const Functions& f, std::uint32_t schema);
std::string DynamicsHeader(const Model& m);   // M, V and G of (1) from the base parameters
std::string RegistersHeader(const Model& m);  // where each estimate stands on the wire
std::string Json(const Model& m, std::uint32_t schema, const Functions& f);
std::string ColumnsPage(const Model& m);

}  // namespace armcal::codegen
