// tool - names and compares the values of a table.
#include "host_sim/tool/table_values.hpp"

#include <fmt/core.h>

#include <utility>

#include "codegen/src/io/json.hpp"

namespace armcal::tool {

using nlohmann::ordered_json;

namespace {

// Each value of a table by its name.
std::vector<std::pair<std::string, ordered_json>> ValuesOf(const calibration::TableFile& t) {
  std::vector<std::pair<std::string, ordered_json>> out;
  out.emplace_back("bumpless", t.bumpless), out.emplace_back("blend_ms", t.blend_ms);
  for (int g = 0; g < 4; ++g) out.emplace_back(fmt::format("forgetting[{}]", g), t.forgetting[g]);
  for (std::size_t j = 0; j < t.joint.size(); ++j) {
    const calibration::TableJoint& joint = t.joint[j];
    for (const auto& [name, value] : {std::pair{"sigma_Nm", joint.sigma_Nm},
                                      {"v_min_radps", joint.v_min_radps},
                                      {"torque_limit_Nm", joint.torque_limit_Nm},
                                      {"torque_scale", joint.torque_scale},
                                      {"gate_sigma", joint.gate_sigma}})
      out.emplace_back(fmt::format("joint {} {}", j + 1, name), value);
  }
  for (const calibration::TableRow& r : t.row) {
    out.emplace_back(r.name, r.mean), out.emplace_back(r.name + " sd", r.sd);
    out.emplace_back(r.name + " process_noise", r.process_noise), out.emplace_back(r.name + " state", r.state);
    out.emplace_back(r.name + " group", r.group);
  }
  return out;
}

}  // namespace

std::vector<ValueChange> ChangesOf(const calibration::TableFile& from, const calibration::TableFile& to) {
  const auto is = ValuesOf(from), next = ValuesOf(to);
  std::vector<ValueChange> out;
  for (std::size_t k = 0; k < is.size(); ++k)
    if (is[k].second != next[k].second) out.push_back({is[k].first, is[k].second, next[k].second});
  return out;
}

std::string ValueText(const ordered_json& value) {
  return value.is_number_float() ? fmt::format("{:.9g}", value.get<double>())
         : value.is_string()     ? value.get<std::string>()
                                 : io::JsonText(value);
}

}  // namespace armcal::tool
