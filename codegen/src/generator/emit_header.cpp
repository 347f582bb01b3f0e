// generator - the text of model.hpp.
#include <sstream>

#include "codegen/src/generator/emit_text.hpp"

namespace armcal::codegen {
namespace {

std::string Hex(std::uint32_t v) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08Xu", v);
  return text;
}

std::string State(const std::string& s) {
  return "ParameterState::k" + std::string(1, static_cast<char>(std::toupper(s[0]))) + s.substr(1);
}

}  // namespace

std::string ModelHeader(const Model& m, const Functions& f, std::uint32_t schema) {
  const Robot& r = m.robot();
  const std::string type = TypeName(r.name), n = std::to_string(m.joints());
  std::vector<int> map_begin{0}, map_column;
  std::vector<double> map_value;
  for (int i = 0; i < m.rigid(); ++i) {
    for (int c = 0; c < m.body_parameters(); ++c)
      if (m.base_map()(i, c) != 0) map_column.push_back(c), map_value.push_back(m.base_map()(i, c));
    map_begin.push_back(static_cast<int>(map_column.size()));
  }
  const AxisText axes = Axes(m);
  std::ostringstream o;
  o << Heading(m, "the regressor and the parameter names of " + r.title + "; knows no filter and no register.")
    << "// Joints " << n << ", filter coordinates " << m.columns() << " (" << m.front() << " front, " << m.rigid()
    << " rigid base, " << m.dense() - m.rigid() << " shared effects), table parameters " << m.parameters()
    << ", states " << m.states() << ", their sensitivities " << m.sensitivities() << ".\n"
    << "// Operations of Regressor: " << CountText(f.count) << ".\n"
    << "// Operations of Jacobian: " << CountText(f.jacobian_count) << ".\n"
    << "#pragma once\n\n#include <cstdint>\n#include <limits>\n\n#include \"armcal/math/elementary.hpp\"\n#include "
       "\"armcal/math/mul_add.hpp\"\n#include \"armcal/model/contract.hpp\"\n\nnamespace armcal::generated {\n\n"
    << "struct " << type << " {\n"
    << "  static constexpr const char* kName = \"" << r.name << "\";\n"
    << "  static constexpr int kJoints = " << n << ";\n  static constexpr int kFront = " << m.front()
    << ";\n  static constexpr int kRigid = " << m.rigid() << ";\n  static constexpr int kDense = " << m.dense()
    << ";\n  static constexpr int kColumns = kFront + kDense;\n"
    << "  static constexpr int kNonlinear = " << m.nonlinear() << ";\n  static constexpr int kStates = " << m.states()
    << ";\n  static constexpr int kSensitivities = " << m.sensitivities()
    << ";\n  static constexpr int kBodyParameters = " << m.body_parameters()
    << ";\n  static constexpr int kParameters = " << m.parameters()
    << ";\n  static constexpr std::uint32_t kSchema = " << Hex(schema) << ";\n"
    << "  static constexpr int kSampleTicks = " << r.sample_ticks
    << ";\n  static constexpr float kTickRate_Hz = " << Float(r.tick_rate_Hz)
    << ";\n  static constexpr float kForgetting[4] = {" << Float(kForgetting[0]) << ", " << Float(kForgetting[1])
    << ", " << Float(kForgetting[2]) << ", " << Float(kForgetting[3]) << "};\n"
    << "  static constexpr int kFrontBegin[kJoints + 1] = "
    << Indexed(m.joints() + 1, [&](int j) { return std::to_string(m.front_begin(j)); })
    << ";\n  static constexpr int kRowBegin[kJoints] = "
    << Indexed(m.joints(), [&](int j) { return std::to_string(m.row_begin(j)); })
    << ";\n  static constexpr int kReadyState[kJoints] = "
    << Indexed(m.joints(), [&](int j) { return std::to_string(m.ready_state(j)); }) << ";\n"
    << "  static constexpr model::AxisInfo kAxes[kJoints] = " << axes.axes
    << ";\n  static constexpr float kMotorToJoint[kJoints * kJoints] = " << axes.motor_to_joint
    << ";\n  static constexpr float kMotorTorqueToJoint[kJoints * kJoints] = " << axes.torque_to_joint << ";\n\n"
    << "  // base parameters = map x body parameters, compressed rows\n"
    << "  static constexpr int kMapBegin[kRigid + 1] = "
    << Indexed(m.rigid() + 1, [&](int i) { return std::to_string(map_begin[i]); })
    << ";\n  static constexpr int kMapColumn[] = "
    << Indexed(static_cast<int>(map_column.size()), [&](int i) { return std::to_string(map_column[i]); })
    << ";\n  static constexpr float kMapValue[] = "
    << Indexed(static_cast<int>(map_value.size()), [&](int i) { return Float(map_value[i]); })
    << ";\n\n  static constexpr float kInfinity = std::numeric_limits<float>::infinity();\n"
    << "  using ParameterState = model::ParameterState;\n"
    << "  // name, unit, mean, prior standard deviation (bodies: of m, centre, I about the centre), bounds, process "
       "noise, state, group\n"
    << "  static constexpr model::ParameterInfo kInfo[kParameters] = {\n";
  for (const TableParameter& p : m.table())
    o << "      {\"" << p.name << "\", \"" << p.unit << "\", " << Float(p.mean) << ", " << Float(p.sd) << ", "
      << Float(p.lower) << ", " << Float(p.upper) << ", " << Float(p.process_noise) << ", " << State(p.state) << ", "
      << p.group << "},\n";
  const std::string arguments =
      "const model::ModelInput<T, kJoints>& x,\n      [[maybe_unused]] const T* committed, [[maybe_unused]] const T* "
      "eta";
  o << "  };\n\n  // What each function needs and gives: armcal/model/contract.hpp. Context: any; straight-line.\n"
    << "  template <class T>\n  static void InitialState([[maybe_unused]] " << arguments
    << ", [[maybe_unused]] T* state) {\n"
    << f.initial_state << "  }\n\n"
    << "  template <class T>\n  static void Jacobian([[maybe_unused]] " << arguments
    << ", [[maybe_unused]] const T* p,\n      [[maybe_unused]] const T* state, [[maybe_unused]] T* next, "
       "[[maybe_unused]] T* jacobian) {\n"
    << f.jacobian << "  }\n\n"
    << "  template <class T>\n  static void Regressor(" << arguments
    << ", [[maybe_unused]] const T* state,\n      [[maybe_unused]] T* next, T* __restrict front, T* __restrict dense) "
       "{\n"
    << f.regressor << "  }\n};\n\n}  // namespace armcal::generated\n";
  return o.str();
}

}  // namespace armcal::codegen
