// generator - the text of each generated file: model.hpp, dynamics.hpp, registers.hpp, model.json, COLUMNS.md.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <sstream>

#include "codegen/src/generator/ceilings.hpp"
#include "codegen/src/generator/dynamics.hpp"
#include "codegen/src/generator/emit_text.hpp"
#include "codegen/src/io/json.hpp"

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

namespace {

std::string FloatList(std::initializer_list<double> values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "" : ", ") + Float(v);
  return "{" + out + "}";
}

// kCeilings, kFriction and kFrictionReads.
std::string CeilingText(const Model& m) {
  const Ceilings c = MakeCeilings(m);
  std::ostringstream o;
  o << "  // The hardest values that a table may hold: model/ceilings.hpp. They are no part of the schema.\n"
    << "  static constexpr model::Ceilings<kJoints, kParameters> kCeilings = {\n      {"
    << static_cast<std::uint32_t>(c.least_fade_ms) << "u, " << static_cast<std::uint32_t>(c.longest_fade_ms) << "u, "
    << Float(c.least_forgetting) << ", " << Float(c.coldest_degC) << ", " << Float(c.warmest_degC) << "},\n      {";
  for (const Ceilings::OfJoint& j : c.joint)
    o << (&j == c.joint.data() ? "" : ",\n       ")
      << FloatList({j.torque_Nm, j.friction_Nm, j.feed_Nm, j.scale_low, j.scale_high, j.sigma_low_Nm, j.sigma_high_Nm,
                    j.v_min_low_radps, j.v_min_high_radps, j.speed_radps, j.position_low_rad, j.position_high_rad});
  o << "},\n      {";
  for (const Ceilings::OfParameter& p : c.parameter)
    o << (&p == c.parameter.data() ? "" : ",\n       ") << FloatList({p.low, p.high, p.sd, p.process_noise});
  o << "}};\n  static constexpr bool kFriction[kFront > 0 ? kFront : 1] = "
    << Indexed(std::max(m.front(), 1), [&](int k) { return k < m.front() && c.friction[k] ? "true" : "false"; })
    << ";\n  static constexpr unsigned kFrictionReads = " << c.friction_reads << "u;\n";
  return o.str();
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
       "\"armcal/math/mul_add.hpp\"\n#include \"armcal/model/ceilings.hpp\"\n#include "
       "\"armcal/model/contract.hpp\"\n\nnamespace armcal::generated {\n\n"
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
  o << "  };\n"
    << CeilingText(m)
    << "\n  // What each function needs and gives: armcal/model/contract.hpp. Context: any; straight-line.\n"
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

std::string Json(const Model& m, std::uint32_t schema, const Functions& f) {
  const Passport& count = f.count;
  nlohmann::ordered_json j;
  j["robot"] = m.robot().name;
  j["generator"] = kGeneratorVersion;
  j["schema"] = schema;
  j["joints"] = m.joints();
  j["front"] = m.front();
  j["rigid"] = m.rigid();
  j["dense"] = m.dense();
  j["forgetting"] = kForgetting;
  j["operations"] = {{"multiplications", count.multiplications},
                     {"additions", count.additions},
                     {"divisions", count.divisions},
                     {"sincos", count.sincos},
                     {"functions", count.functions}};
  j["states"] = nlohmann::ordered_json::array();
  for (int k = 0; k < m.states(); ++k) j["states"].push_back(m.graph().states()[k].name);
  for (int c = 0; c < m.columns(); ++c)
    j["columns"].push_back({{"name", m.column_name(c)}, {"unit", m.column_unit(c)}});
  for (const TableParameter& p : m.table())
    j["table"].push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"mean", p.mean},
                          {"sd", p.sd},
                          {"process_noise", p.process_noise},
                          {"state", p.state},
                          {"group", p.group}});
  return io::JsonText(j, 1) + "\n";
}

std::string ColumnsPage(const Model& m) {
  std::ostringstream o;
  o << "# What is column k? " << m.robot().title
    << "\n\nFilter coordinates in order. Front columns touch one joint's torque only; a name "
       "with R is a base parameter into which others have merged.\n\n| column | name | unit | made of |\n| --- | --- | "
       "--- | --- |\n";
  for (int c = 0; c < m.columns(); ++c) {
    o << "| " << c << " | " << m.column_name(c) << " | " << m.column_unit(c) << " | ";
    if (m.is_rigid(c)) {
      const auto& map = m.base_map().row(c - m.front());
      std::string sum;
      for (int k = 0; k < map.size(); ++k) {
        if (map[k] == 0) continue;
        char factor[32];
        std::snprintf(factor, sizeof factor, "%.6g", std::abs(map[k]));
        const std::string f = std::string(factor) == "1" ? "" : std::string(factor) + " ";
        sum += (map[k] < 0 ? (sum.empty() ? "-" : " - ") : (sum.empty() ? "" : " + ")) + f + m.table()[k].name;
      }
      o << sum;
    } else {
      o << m.table()[m.table_index(c)].effect << ", joint "
        << (m.column_joint(c) < 0 ? "several" : std::to_string(m.column_joint(c) + 1));
    }
    o << " |\n";
  }
  return o.str();
}

}  // namespace armcal::codegen
