// calibration - reads parameters by name and puts them in the model's order.
#include "host_sim/identify/calibration/given.hpp"

#include <fmt/core.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/require_file.hpp"
#include "codegen/src/robot/body.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::calibration {

namespace {

using Json = nlohmann::ordered_json;
using Values = std::map<std::string, double>;

// Takes values out of the map, so that what is left is what the model does not know.
class ByName {
 public:
  ByName(const codegen::Model& model, Values values, std::string source)
      : model_(model), values_(std::move(values)), source_(std::move(source)) {}

  bool Take(const std::string& name, double& value) {
    const auto it = values_.find(name);
    if (it == values_.end()) return false;
    value = it->second;
    values_.erase(it);
    return true;
  }
  double Body(const std::string& name) {
    double value = 0;
    if (!Take(name, value))
      throw io::InputError(fmt::format("{}: parameter {} of robot {} is missing: was it made for another robot file?",
                                       source_, name, model_.robot().name));
    return value;
  }
  // Friction, effects and nonlinear parameters: the robot file's value where the file has none.
  void Others(Given& given) {
    const int unknowns = model_.nonlinear();
    for (int c = 0; c < model_.columns(); ++c) {
      if (model_.is_rigid(c)) continue;
      const codegen::TableParameter& p = model_.table()[model_.table_index(c)];
      given.x[c] = p.mean;
      if (!Take(p.name, given.x[c])) given.missing.push_back(p.name);
    }
    for (int k = 0; k < unknowns; ++k) {
      const codegen::TableParameter& p = model_.table()[model_.parameters() - unknowns + k];
      given.eta.push_back(p.mean);
      if (!Take(p.name, given.eta.back())) given.missing.push_back(p.name);
    }
    for (const auto& [name, value] : values_)
      if (value != 0)
        throw io::InputError(
            fmt::format("{}: robot {} has no parameter {}, which is {:g} here; expected the robot file that the table "
                        "was made for (--robot or --model)",
                        source_, model_.robot().name, name, value));
  }

 private:
  const codegen::Model& model_;
  Values values_;
  std::string source_;
};

Given Empty(const codegen::Model& model) {
  Given given;
  given.x = Eigen::VectorXd::Zero(model.columns() + model.joints());
  return given;
}

void SetBodies(const codegen::Model& model, const Eigen::VectorXd& bodies, Given& given) {
  given.bodies = bodies;
  given.x.segment(model.front(), model.rigid()) = model.base_map() * bodies;
}

void TakeBodies(const codegen::Model& model, ByName& values, Given& given) {
  Eigen::VectorXd bodies(model.body_parameters());
  for (int k = 0; k < bodies.size(); ++k) bodies[k] = values.Body(model.table()[k].name);
  SetBodies(model, bodies, given);
}

Values NamesOf(const Json& list, const char* value) {
  Values out;
  for (const Json& row : list) out[row.at("name").get<std::string>()] = row.at(value).get<double>();
  return out;
}

Given FromJson(const codegen::Model& model, const Json& json, const std::string& source) {
  Given given = Empty(model);
  const bool bodies = json.contains("table");
  Values named = bodies                        ? NamesOf(json.at("table"), "mean")
                 : json.contains("parameters") ? NamesOf(json.at("parameters"), "value")
                                               : NamesOf(json.at("columns"), "value");
  if (bodies)
    for (const Json& row : json.at("table"))
      if (row.value("from_prior", false)) given.from_prior.push_back(row.at("name").get<std::string>());
  if (json.contains("nonlinear"))
    for (const auto& [name, value] : NamesOf(json.at("nonlinear"), "value")) named[name] = value;
  ByName values(model, std::move(named), source);
  if (bodies) TakeBodies(model, values, given);
  else
    for (int d = 0; d < model.rigid(); ++d)
      given.x[model.front() + d] = values.Body(model.column_name(model.front() + d));
  values.Others(given);
  // A table was read out of a fit of its own: its gains are not those of the columns.
  for (const char* key : {"table_gain", "torque_gain"}) {
    if (!json.contains(key) || (!bodies && std::string(key) == "table_gain")) continue;
    const auto gain = json.at(key).get<std::vector<double>>();
    if (static_cast<int>(gain.size()) != model.joints())
      throw io::InputError(fmt::format("{}: {} has {} values, expected {} (robot {})", source, key, gain.size(),
                                       model.joints(), model.robot().name));
    for (int j = 0; j < model.joints(); ++j) given.x[model.columns() + j] = gain[static_cast<std::size_t>(j)] - 1;
    break;
  }
  return given;
}

}  // namespace

Given GivenByRobot(const codegen::Model& model) {
  if (!model.robot().has_prior)
    throw io::InputError(model.robot().path +
                         ": prior = \"none\": the file has no bodies to evaluate; expected --table FILE, which armcal "
                         "identify --json writes");
  Given given = Empty(model);
  given.x.head(model.columns()) = MakePrior(model).mean.head(model.columns());
  given.bodies = BodyMean(model);
  given.eta = MeanUnknowns(model);
  return given;
}

Given GivenByTable(const codegen::Model& model, const TableFile& table, const std::string& source) {
  if (static_cast<int>(table.joint.size()) != model.joints())
    throw io::InputError(fmt::format("{}: {} joints, expected {} (robot {})", source, table.joint.size(),
                                     model.joints(), model.robot().name));
  Values all;
  Given given = Empty(model);
  for (const TableRow& r : table.row) {
    all[r.name] = r.state == "standby" ? 0 : r.mean;  // the drive takes it as zero
    if (r.from_prior) given.from_prior.push_back(r.name);
  }
  ByName values(model, all, source);
  TakeBodies(model, values, given);
  values.Others(given);
  for (int j = 0; j < model.joints(); ++j)
    given.x[model.columns() + j] = 1 / table.joint[static_cast<std::size_t>(j)].torque_scale - 1;
  return given;
}

Given GivenByJson(const codegen::Model& model, const std::filesystem::path& path) {
  const Json json = files::ReadJsonFile(path);
  const bool known = json.is_object() && (json.contains("columns") || json.contains("parameters"));
  if (!known)
    throw io::InputError(path.string() + ": expected the JSON that armcal identify --json writes, or a table");
  try {
    return FromJson(model, json, path.string());
  } catch (const Json::exception&) {
    throw io::InputError(path.string() +
                         ": a parameter has no name or no number; expected what armcal identify --json "
                         "writes");
  }
}

Given GivenByFile(const codegen::Model& model, const std::filesystem::path& path) {
  io::RequireFile(path);
  return IsJson(path) ? GivenByJson(model, path) : GivenByTable(model, ReadTable(path), path.string());
}

void AddPayload(const codegen::Model& model, const codegen::Payload& payload, const std::string& source, Given& given) {
  if (!payload.center_m || !payload.inertia_kgm2)
    throw io::InputError(source + ": expected center_m and inertia_kgm2 beside mass_kg");
  Eigen::Isometry3d flange = Eigen::Isometry3d::Identity();
  flange.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(model.robot().tool_rotation.data());
  flange.translation() = Eigen::Map<const Eigen::Vector3d>(model.robot().tool_xyz_m.data());
  const codegen::Link body = codegen::Carrying({}, flange, payload);
  Eigen::VectorXd centre(10), bodies = Eigen::VectorXd::Zero(model.body_parameters());
  centre << body.mass_kg, Eigen::Map<const Eigen::Vector3d>(body.center_m.data()),
      Eigen::Map<const Eigen::Matrix<double, 6, 1>>(body.inertia_kgm2.data());
  bodies.segment(11 * (model.joints() - 1), 10) = ToOrigin(centre);
  given.x.segment(model.front(), model.rigid()) += model.base_map() * bodies;
  if (given.bodies.size() > 0) given.bodies += bodies;
}

}  // namespace armcal::calibration
