// calibration - reads, writes and encodes parameter tables by name.
#include "host_sim/identify/calibration/table_file.hpp"

#include <fmt/core.h>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "armcal/model/parameters.hpp"
#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/faults.hpp"
#include "codegen/src/io/file_kind.hpp"
#include "codegen/src/io/toml_reader.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::calibration {
namespace {

const char* const kStates[] = {"estimated", "considered", "fixed", "standby"};

int StateNumber(const std::string& s) {
  for (int k = 0; k < 4; ++k)
    if (s == kStates[k]) return k;
  throw io::InputError("state " + s + ": expected estimated, considered, fixed or standby");
}

std::size_t WordsOfLayout(const TableFile& t, int version) {
  using namespace model;
  const std::size_t first = kHeaderWords + t.joint.size() * kJointWords + t.row.size() * kParameterWords;
  return version == kFirstLayout ? first : first + t.joint.size() * kGateWords + kSealWords;
}

}  // namespace

TableFile DefaultTable(const codegen::Model& model) {
  TableFile t;
  const auto& robot = model.robot();
  t.robot = robot.name;
  t.schema = codegen::Schema(model);
  std::copy(std::begin(codegen::kForgetting), std::end(codegen::kForgetting), t.forgetting);
  for (const auto& j : robot.joint)
    t.joint.push_back({j.torque_noise_Nm / std::sqrt(robot.sample_ticks), j.v_min_radps, j.torque_limit_Nm, 1});
  for (const auto& p : model.table()) {
    TableRow row{p.name, p.unit, p.state, p.mean, p.sd, p.process_noise, p.group};
    row.free_mean = row.mean;
    t.row.push_back(row);
  }
  return t;
}

std::vector<int> HardlyDetermined(const codegen::Model& model, const Fit& fit) {
  std::vector<int> out;
  for (const int c : fit.active)
    if (c < model.columns() && !model.is_rigid(c) && fit.ratio(c) > kFromPrior) out.push_back(c);
  return out;
}

TableFile IdentifiedTable(const codegen::Model& model, const Fit& all, const PhysicalReadOut& bodies,
                          const Eigen::VectorXd& noise_density) {
  TableFile t = DefaultTable(model);
  t.note = "identified";
  const auto& robot = model.robot();
  const double sample_s = robot.sample_ticks / robot.tick_rate_Hz;
  for (int j = 0; j < model.joints(); ++j) {
    // white noise, averaged over a sample time of the drive
    t.joint[j].sigma_Nm = noise_density[j] / std::sqrt(sample_s);
    t.joint[j].torque_scale = 1 / (1 + bodies.x[model.columns() + j]);
  }
  for (int k = 0; k < model.body_parameters(); ++k) {
    TableRow& row = t.row[k];
    row.mean = row.free_mean = bodies.bodies[k];
    row.posterior_sd = bodies.bodies_sd[k];
    row.from_prior = row.sd > 0 && row.posterior_sd > kFromPrior * row.sd;
  }
  for (int c = 0; c < model.columns(); ++c) {
    if (model.is_rigid(c)) continue;
    TableRow& row = t.row[model.table_index(c)];
    if (row.state != "estimated") continue;
    row.mean = bodies.x[c];
    row.free_mean = all.x[c];
    row.posterior_sd = all.sd[c];
    row.from_prior = all.ratio(c) > kFromPrior;
  }
  return t;
}

std::vector<std::uint16_t> EncodeTable(const TableFile& t) {
  using namespace model;
  const bool gated = std::any_of(t.joint.begin(), t.joint.end(), [](const TableJoint& j) { return j.gate_sigma != 0; });
  std::vector<std::uint16_t> out(WordsOfLayout(t, gated ? kLayoutVersion : kFirstLayout), 0);
  std::uint16_t* w = out.data();
  core::PutU32(w, t.schema);
  w[2] = gated ? kLayoutVersion : kFirstLayout;
  w[3] = static_cast<std::uint16_t>(t.joint.size());
  w[4] = static_cast<std::uint16_t>(t.row.size());
  w[5] = t.bumpless ? kFlagBumpless : 0;
  core::PutU32(w + 6, t.blend_ms);
  for (int g = 0; g < 4; ++g) core::PutF32(w + 8 + 2 * g, static_cast<float>(t.forgetting[g]));
  w += kHeaderWords;
  for (const TableJoint& j : t.joint) {
    const double values[] = {j.sigma_Nm, j.v_min_radps, j.torque_limit_Nm, j.torque_scale};
    for (int k = 0; k < 4; ++k) core::PutF32(w + 2 * k, static_cast<float>(values[k]));
    w += kJointWords;
  }
  for (const TableRow& r : t.row) {
    core::PutF32(w, static_cast<float>(r.mean));
    core::PutF32(w + 2, static_cast<float>(r.sd));
    core::PutF32(w + 4, static_cast<float>(r.process_noise));
    w[6] = static_cast<std::uint16_t>(StateNumber(r.state) << 8 | r.group);
    w += kParameterWords;
  }
  for (std::size_t j = 0; gated && j < t.joint.size(); ++j, w += kGateWords)
    core::PutF32(w, static_cast<float>(t.joint[j].gate_sigma));
  return out;
}

TableFile DecodeTable(const std::vector<std::uint16_t>& words, const TableFile& like) {
  using namespace model;
  TableFile t = like;
  const int version = words.size() < kHeaderWords ? 0 : words[2];
  if (version < kFirstLayout || version > kLayoutVersion || words.size() != WordsOfLayout(like, version) ||
      core::GetU32(words.data()) != like.schema)
    throw io::InputError(
        fmt::format("table: {} words of layout version {}, expected {} of version {} or {} of version "
                    "{}, and schema {:08X}",
                    words.size(), version, WordsOfLayout(like, kFirstLayout), kFirstLayout,
                    WordsOfLayout(like, kLayoutVersion), kLayoutVersion, like.schema));
  const std::uint16_t* w = words.data();
  t.bumpless = w[5] & kFlagBumpless;
  t.blend_ms = core::GetU32(w + 6);
  for (int g = 0; g < 4; ++g) t.forgetting[g] = core::GetF32(w + 8 + 2 * g);
  w += kHeaderWords;
  for (TableJoint& j : t.joint) {
    j = {core::GetF32(w), core::GetF32(w + 2), core::GetF32(w + 4), core::GetF32(w + 6)};
    w += kJointWords;
  }
  for (TableRow& r : t.row) {
    r.mean = r.free_mean = core::GetF32(w);
    r.sd = core::GetF32(w + 2);
    r.process_noise = core::GetF32(w + 4);
    r.state = kStates[std::min(3, w[6] >> 8)];
    r.group = w[6] & 0xFF;
    w += kParameterWords;
  }
  for (std::size_t j = 0; j < t.joint.size(); ++j)
    t.joint[j].gate_sigma = version == kFirstLayout ? 0.0 : double{core::GetF32(w + j * kGateWords)};
  return t;
}

CarriedOver CarryOver(const TableFile& from, TableFile& to, const std::string& source) {
  if (from.robot != to.robot)
    throw io::InputError(
        fmt::format("{}: is a table of robot {}, expected one of robot {}; give --robot {}, or a table "
                    "that armcal identify made with --robot {}",
                    source, from.robot, to.robot, from.robot, to.robot));
  if (from.joint.size() != to.joint.size())
    throw io::InputError(
        fmt::format("{}: {} joints, expected {} (robot {})", source, from.joint.size(), to.joint.size(), to.robot));
  std::map<std::string, const TableRow*> left;
  for (const TableRow& r : from.row) left[r.name] = &r;
  CarriedOver out;
  std::vector<std::string_view> absent;
  for (TableRow& r : to.row) {
    const auto it = left.find(r.name);
    if (it == left.end()) {
      out.missing.push_back(r.name), absent.push_back(r.name);
      continue;
    }
    const TableRow& given = *it->second;
    if (!given.unit.empty() && given.unit != r.unit)
      throw io::InputError(
          fmt::format("{}: {}: unit is {}, expected {} (robot {})", source, r.name, given.unit, r.unit, to.robot));
    const std::string unit = r.unit;
    r = given, r.unit = unit;
    left.erase(it);
  }
  for (const auto& [name, row] : left) out.unknown.push_back(name);
  if (from.schema == to.schema && !out.unknown.empty()) {
    const std::string& name = out.unknown.front();
    const std::string nearest = io::Nearest(name, absent);
    throw io::InputError(fmt::format("{}: {}: robot {} has no such parameter{}", source, name, to.robot,
                                     nearest.empty() ? "" : "; the nearest is " + nearest));
  }
  to.joint = from.joint;
  return out;
}

void WriteTable(const std::filesystem::path& path, const TableFile& t) {
  const auto number = [](double v) {
    std::string s = fmt::format("{:.9g}", v);
    if (s.find_first_of(".eni") == std::string::npos) s += ".0";
    return s;
  };
  std::string o = fmt::format(
      "# Parameter table of {}; armcal flash sends it to a drive of the same schema, or carries it over by name.\n",
      t.robot);
  o += fmt::format(
      "robot = \"{}\"\nnote = \"{}\"\nschema = {}\nbumpless = {}\nblend_ms = {}\nforgetting = [{}, {}, {}, {}]\n",
      t.robot, t.note, t.schema, t.bumpless, t.blend_ms, number(t.forgetting[0]), number(t.forgetting[1]),
      number(t.forgetting[2]), number(t.forgetting[3]));
  for (const TableJoint& j : t.joint) {
    o += fmt::format("\n[[joint]]\nsigma_Nm = {}\nv_min_radps = {}\ntorque_limit_Nm = {}\ntorque_scale = {}\n",
                     number(j.sigma_Nm), number(j.v_min_radps), number(j.torque_limit_Nm), number(j.torque_scale));
    if (j.gate_sigma != 0) o += fmt::format("gate_sigma = {}\n", number(j.gate_sigma));
  }
  for (const TableRow& r : t.row) {
    o += fmt::format(
        "\n[[parameter]]\nname = \"{}\"\nunit = \"{}\"\nmean = {}\nsd = {}\nprocess_noise = {}\nstate = \"{}\"\ngroup "
        "= {}\n",
        r.name, r.unit, number(r.mean), number(r.sd), number(r.process_noise), r.state, r.group);
    if (r.posterior_sd > 0)
      o += fmt::format("posterior_sd = {}\nfrom_prior = {}\nfree_mean = {}\n", number(r.posterior_sd), r.from_prior,
                       number(r.free_mean));
  }
  files::WriteWholeFile(path, o);
}

bool IsJson(const std::filesystem::path& path) {
  std::ifstream in(path);
  char first = 0;
  in >> first;
  return first == '{';
}

TableFile ReadTable(const std::filesystem::path& path) {
  if (IsJson(path))
    throw io::InputError(
        path.string() +
        ": is JSON, expected a parameter table (armcal identify --table-out writes it); armcal restore "
        "takes a backup");
  const toml::table toml = io::ParseToml(path);
  io::RequireKind(toml, path, io::FileKind::kTable);
  const io::TomlReader in(toml, path.string());
  in.AllowOnly({"robot", "note", "schema", "bumpless", "blend_ms", "forgetting", "joint", "parameter"});
  TableFile t;
  t.robot = in.Text("robot");
  t.note = in.Text("note", "");
  t.schema = static_cast<std::uint32_t>(in.Integer("schema", 0, 4294967295));
  t.blend_ms = static_cast<std::uint32_t>(in.Integer("blend_ms", 0, 1000000, 0));
  t.bumpless = in.Flag("bumpless", false);
  const auto forgetting = in.Numbers("forgetting", 4);
  std::copy(forgetting.begin(), forgetting.end(), t.forgetting);
  for (const auto& j : in.Tables("joint")) {
    j.AllowOnly({"sigma_Nm", "v_min_radps", "torque_limit_Nm", "torque_scale", "gate_sigma"});
    t.joint.push_back({j.Positive("sigma_Nm"), j.Positive("v_min_radps"), j.Positive("torque_limit_Nm"),
                       j.Positive("torque_scale"), j.Has("gate_sigma") ? j.Positive("gate_sigma") : 0.0});
  }
  std::set<std::string> names;
  for (const auto& p : in.Tables("parameter")) {
    p.AllowOnly(
        {"name", "unit", "mean", "sd", "process_noise", "state", "group", "posterior_sd", "from_prior", "free_mean"});
    TableRow r;
    r.name = p.Text("name");
    if (!names.insert(r.name).second) p.Fail("name", "each name once, and " + r.name + " is there twice");
    r.unit = p.Text("unit", "");
    r.mean = p.Number("mean");
    r.sd = p.NotNegative("sd");
    r.process_noise = p.Number("process_noise", 0);
    r.state = p.Text("state");
    if (std::find(std::begin(kStates), std::end(kStates), r.state) == std::end(kStates))
      p.Fail("state", "estimated, considered, fixed or standby");
    r.group = static_cast<int>(p.Integer("group", 0, 3, 0));
    r.posterior_sd = p.Number("posterior_sd", 0);
    r.from_prior = p.Flag("from_prior", false);
    r.free_mean = p.Number("free_mean", r.mean);
    t.row.push_back(r);
  }
  if (t.joint.empty() || t.row.empty()) in.Fail("parameter", "[[joint]] and [[parameter]] tables");
  return t;
}

}  // namespace armcal::calibration
