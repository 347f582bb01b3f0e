// generator - the text of model.hpp, model.json and COLUMNS.md.
#include "codegen/src/generator/emit.hpp"

#include <Eigen/LU>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "codegen/src/generator/emit_body.hpp"

namespace armcal::codegen {
namespace {

constexpr int kGeneratorVersion = 1;
std::uint32_t Crc32(const std::string& text) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

std::string Hex(std::uint32_t v) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08Xu", v);
  return text;
}

std::string TypeName(const std::string& robot) {  // er20_like -> Er20Like
  std::string out;
  bool upper = true;
  for (const char c : robot) {
    if (c == '_') {
      upper = true;
      continue;
    }
    out += upper ? static_cast<char>(std::toupper(c)) : c;
    upper = false;
  }
  return out;
}

std::string Float(double value) {
  if (std::isinf(value)) return value > 0 ? "kInfinity" : "-kInfinity";
  return NumberText(static_cast<double>(static_cast<float>(value))) + "f";
}

std::string List(const std::vector<std::string>& items) {
  std::string out, line = "      ";
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string item = items[i] + (i + 1 < items.size() ? ", " : "");
    if (line.size() + item.size() > 118) out += line + "\n", line = "      ";
    line += item;
  }
  return "{\n" + out + line + "}";
}

template <class F>
std::string Indexed(int count, F f) {
  std::vector<std::string> items;
  for (int i = 0; i < count; ++i) items.push_back(f(i));
  return List(items);
}

std::string InputText(const Model& m, const std::string& name) {
  if (name == "t") return "x.t";
  if (name.rfind("base", 0) == 0) return "committed[" + std::to_string(m.front() + std::stoi(name.substr(4))) + "]";
  for (int k = 0; k < m.nonlinear(); ++k)
    if (m.unknowns()[k].name == name) return "eta[" + std::to_string(k) + "]";
  const auto digits = name.find_first_of("0123456789");
  return "x." + name.substr(0, digits) + "[" + std::to_string(std::stoi(name.substr(digits)) - 1) + "]";
}

std::vector<Assignment> Assignments(const Model& m) {
  std::vector<Assignment> out;
  for (int c = 0; c < m.front(); ++c)
    out.push_back({"front[" + std::to_string(c) + "]", m.rows()[m.column_joint(c)][c]});
  for (int i = 0; i < m.joints(); ++i)
    for (int d = 0; d < m.dense(); ++d)
      out.push_back({"dense[" + std::to_string(i * m.dense() + d) + "]", m.rows()[i][m.front() + d]});
  return out;
}

std::string State(const std::string& s) {
  return "ParameterState::k" + std::string(1, static_cast<char>(std::toupper(s[0]))) + s.substr(1);
}

// Motor counts and current -> joint units; the coupling's inverse and transpose, row-major.
struct AxisText {
  std::string axes, motor_to_joint, torque_to_joint;
};

AxisText Axes(const Model& m) {
  const Robot& r = m.robot();
  const int n = m.joints();
  AxisText out;
  std::vector<std::string> rows;
  for (const Joint& j : r.joint) {
    const double counts_to_rad =
        j.has_motor ? 2 * std::numbers::pi / (j.motor.counts_per_turn * j.motor.gear_ratio) : 1;
    const double lsb_to_Nm =
        j.has_motor ? j.motor.current_A_per_lsb * j.motor.torque_constant_NmpA * j.motor.gear_ratio : 1;
    // The noise of one tick is white: averaging the ticks of a sample divides it.
    rows.push_back("{" + Float(counts_to_rad) + ", " + std::to_string(j.motor.zero_counts) + ", " + Float(lsb_to_Nm) +
                   ", " + Float(j.torque_noise_Nm / std::sqrt(r.sample_ticks)) + ", " + Float(j.v_min_radps) + ", " +
                   Float(j.torque_limit_Nm) + "}");
  }
  out.axes = List(rows);
  Eigen::MatrixXd C = Eigen::MatrixXd::Identity(n, n);
  for (std::size_t k = 0; k < r.coupling.size(); ++k)
    C(static_cast<int>(k) / n, static_cast<int>(k) % n) = r.coupling[k];
  const Eigen::MatrixXd A = C.inverse(), B = C.transpose();
  out.motor_to_joint = Indexed(n * n, [&](int k) { return Float(A(k / n, k % n)); });
  out.torque_to_joint = Indexed(n * n, [&](int k) { return Float(B(k / n, k % n)); });
  return out;
}

// Everything that gives the table its meaning; its hash is the schema.
std::string Meaning(const Model& m, const std::string& statements) {
  std::ostringstream s;
  s << m.robot().name << "\n" << statements;
  for (const TableParameter& p : m.table()) s << p.name << " " << p.unit << "\n";
  for (int i = 0; i < m.base_map().rows(); ++i)
    for (int c = 0; c < m.base_map().cols(); ++c)
      if (m.base_map()(i, c) != 0) s << i << " " << c << " " << NumberText(m.base_map()(i, c)) << "\n";
  const AxisText axes = Axes(m);
  s << axes.axes << axes.motor_to_joint << axes.torque_to_joint << m.robot().sample_ticks << " "
    << NumberText(m.robot().tick_rate_Hz);
  return s.str();
}

std::string ModelHeader(const Model& m, const std::string& statements, std::uint32_t schema, const Passport& count) {
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
  o << "// generated/" << r.name << " - the regressor and the parameter names of " << r.title
    << "; knows no filter and no register.\n"
    << "// Generated by armcal generate, version " << kGeneratorVersion << "; do not edit: change codegen/robots/"
    << r.name << ".toml and generate again.\n"
    << "// Joints " << n << ", filter coordinates " << m.columns() << " (" << m.front() << " front, " << m.rigid()
    << " rigid base, " << m.dense() - m.rigid() << " shared effects), table parameters " << m.parameters() << ".\n"
    << "// Operations of Regressor: " << count.multiplications << " multiplications, " << count.additions
    << " additions, " << count.divisions << " divisions, " << count.sincos << " sines and cosines, " << count.functions
    << " other functions.\n"
    << "#pragma once\n\n#include <cstdint>\n#include <limits>\n\n#include \"armcal/math/elementary.hpp\"\n#include "
       "\"armcal/model/contract.hpp\"\n\nnamespace armcal::generated {\n\n"
    << "struct " << type << " {\n"
    << "  static constexpr const char* kName = \"" << r.name << "\";\n"
    << "  static constexpr int kJoints = " << n << ";\n  static constexpr int kFront = " << m.front()
    << ";\n  static constexpr int kRigid = " << m.rigid() << ";\n  static constexpr int kDense = " << m.dense()
    << ";\n  static constexpr int kColumns = kFront + kDense;\n"
    << "  static constexpr int kNonlinear = " << m.nonlinear()
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
    << Indexed(m.joints(), [&](int j) { return std::to_string(m.row_begin(j)); }) << ";\n"
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
  o << "  };\n\n"
    << "  // front[kFront], dense[kJoints * kDense] (row-major); see armcal/model/contract.hpp. Context: any; "
       "straight-line.\n"
    << "  template <class T>\n  static void Regressor(const model::ModelInput<T, kJoints>& x, [[maybe_unused]] const "
       "T* committed,\n"
    << "                        [[maybe_unused]] const T* eta, T* front, T* dense) {\n"
    << statements << "  }\n};\n\n}  // namespace armcal::generated\n";
  return o.str();
}

std::string Json(const Model& m, std::uint32_t schema, const Passport& count) {
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
  return j.dump(1) + "\n";
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

}  // namespace

std::uint32_t Schema(const Model& m) {
  Passport count;
  return Crc32(
      Meaning(m, EmitStatements(
                     m.graph(), Assignments(m), [&](const std::string& s) { return InputText(m, s); }, count)));
}

GeneratedFiles Emit(const Model& m) {
  GeneratedFiles files;
  const std::string statements = EmitStatements(
      m.graph(), Assignments(m), [&](const std::string& s) { return InputText(m, s); }, files.passport);
  files.schema = Crc32(Meaning(m, statements));
  files.text["model.hpp"] = ModelHeader(m, statements, files.schema, files.passport);
  files.text["model.json"] = Json(m, files.schema, files.passport);
  files.text["COLUMNS.md"] = ColumnsPage(m);
  files.text["selected_model.hpp"] =
      "// generated/" + m.robot().name +
      " - names this folder's model for programs that are compiled for one model; knows nothing else.\n"
      "#pragma once\n\n#include \"model.hpp\"\n\nnamespace armcal::generated {\nusing SelectedModel = " +
      TypeName(m.robot().name) + ";\n}  // namespace armcal::generated\n";
  return files;
}

}  // namespace armcal::codegen
