// generator - the text of model.json and COLUMNS.md.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "codegen/src/generator/emit_text.hpp"

namespace armcal::codegen {

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

}  // namespace armcal::codegen
