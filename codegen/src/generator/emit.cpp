// generator - collects the files of a model, and computes the schema of its table.
#include "codegen/src/generator/emit.hpp"

#include <sstream>

#include "codegen/src/generator/emit_text.hpp"
#include "codegen/src/generator/state_path.hpp"
#include "codegen/src/io/atomic_write.hpp"
#include "codegen/src/io/number_text.hpp"

namespace armcal::codegen {
namespace {

std::uint32_t Crc32(const std::string& text) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

std::string At(const std::string& array, int index) { return array + "[" + std::to_string(index) + "]"; }

// An entry that is always zero is not written. Its place holds zero from the start.
void Assign(std::vector<Assignment>& out, const std::string& array, int index, Expr value,
            const std::string& heading = "") {
  if (!value.IsZero()) out.push_back({At(array, index), value, heading});
}

// The rows are written column by column, and within a column from the joint nearest to the body inward. Values that
// the rows of one column share are then needed for a short time only, and few of them are alive at once. The screw of
// an inner joint is carried outward as late as possible.
std::vector<Assignment> RegressorAssignments(const Model& m) {
  std::vector<Assignment> out;
  for (int d = 0; d < m.dense(); ++d)
    for (int i = m.joints() - 1; i >= 0; --i)
      Assign(out, "dense", i * m.dense() + d, m.rows()[i][m.front() + d], m.column_name(m.front() + d));
  for (int c = 0; c < m.front(); ++c) Assign(out, "front", c, m.rows()[m.column_joint(c)][c], m.column_name(c));
  for (int k = 0; k < m.states(); ++k)
    out.push_back({At("next", k), m.graph().states()[k].next, m.graph().states()[k].name});
  return out;
}

std::vector<Assignment> JacobianAssignments(const Model& m) {
  std::vector<Assignment> out;
  for (int i = 0; i < m.joints(); ++i)
    for (int k = 0; k < m.nonlinear(); ++k) Assign(out, "jacobian", i * m.nonlinear() + k, m.jacobian()[i][k]);
  for (int k = m.states(); k < m.states() + m.sensitivities(); ++k)
    out.push_back({At("next", k), m.graph().states()[k].next, m.graph().states()[k].name});
  return out;
}

Functions Statements(const Model& m) {
  Functions f;
  const auto input = [&](const InputId& id) { return InputText(m, id); };
  f.regressor = EmitStatements(m.graph(), RegressorAssignments(m), input, f.count);
  f.jacobian = EmitStatements(m.graph(), JacobianAssignments(m), input, f.jacobian_count);
  std::vector<Assignment> initial;
  Passport unused;
  for (const Expr e : InitialValues(m.graph(), m.states()))
    initial.push_back({At("state", static_cast<int>(initial.size())), e, ""});
  f.initial_state = EmitStatements(m.graph(), initial, input, unused);
  return f;
}

// What an effect's parameters mean: its expressions on its joints. Titles, search words and the like do not.
void WriteMeaning(const EffectInstance& e, std::ostream& s) {
  s << e.record->name;
  for (const int j : e.joints) s << " " << j + 1;
  for (const std::string& line : e.record->let) s << "\n" << line;
  for (const RecordState& state : e.record->state)
    s << "\n" << state.name << " = " << state.initial << "; " << state.step << "; " << state.settled;
  for (const LinearParameter& p : e.record->linear) {
    s << "\n" << p.name;
    for (const auto& [row, text] : p.rows) s << " " << row << ": " << text;
  }
  for (const auto& [name, value] : e.constants) s << "\n" << name << " = " << io::NumberText(value);
  s << "\n";
}

// Everything that gives the table its meaning; its hash is the schema. The table holds body parameters about the robot
// file's frames, so neither the choice of base parameters nor how a formula is written is part of it: a newer generator
// keeps the tables in the field.
std::string Meaning(const Model& m) {
  const Robot& r = m.robot();
  std::ostringstream s;
  const auto number = [&s](double v) { s << io::NumberText(v) << " "; };
  s << r.name << "\n" << r.sign_law << " ";
  number(r.sign_width_radps);
  for (const double g : r.gravity_mps2) number(g);
  for (const double c : r.base_rotation) number(c);
  for (const Joint& j : r.joint) {
    const JointKinematics& k = j.kinematics;
    s << (k.type == JointType::kRevolute ? "\nrevolute " : "\nprismatic ");
    for (const double v : {k.alpha_rad, k.a_m, k.d_m, k.theta_rad}) number(v);
  }
  s << "\n";
  for (const EffectInstance& e : m.effects()) WriteMeaning(e, s);
  for (const TableParameter& p : m.table()) s << p.name << " " << p.unit << "\n";
  // What stands for a motor that nobody stated is no part of the meaning.
  const AxisText axes = Axes(m, WithoutMotor::kUnit);
  s << axes.axes << axes.motor_to_joint << axes.torque_to_joint << r.sample_ticks << " ";
  number(r.tick_rate_Hz);
  return s.str();
}

}  // namespace

std::uint32_t Schema(const Model& m) { return Crc32(Meaning(m)); }

GeneratedFiles Emit(const Model& m) {
  GeneratedFiles files;
  const Functions f = Statements(m);
  files.passport = f.count;
  files.schema = Schema(m);
  files.text["model.hpp"] = ModelHeader(m, f, files.schema);
  files.text["dynamics.hpp"] = DynamicsHeader(m);
  files.text["registers.hpp"] = RegistersHeader(m);
  files.text["model.json"] = Json(m, files.schema, f);
  files.text["COLUMNS.md"] = ColumnsPage(m);
  files.text["selected_model.hpp"] =
      "// generated/" + m.robot().name +
      " - names this folder's model for programs that are compiled for one model; knows nothing else.\n"
      "#pragma once\n\n#include \"model.hpp\"\n\nnamespace armcal::generated {\nusing SelectedModel = " +
      TypeName(m.robot().name) + ";\n}  // namespace armcal::generated\n";
  return files;
}

void WriteFiles(const GeneratedFiles& files, const std::filesystem::path& folder) {
  io::MakeFolder(folder);
  for (const auto& [name, text] : files.text) io::AtomicWrite(folder / name, text);
}

}  // namespace armcal::codegen
