// tool - armcal channels: shows what a log holds, and writes a channel map of what it recognises.
#include <fmt/core.h>

#include "host_sim/data/logs/look.hpp"
#include "host_sim/data/logs/recognise.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/tool/logs.hpp"

namespace armcal::tool {
namespace {

struct ChannelsOptions {
  std::string log, out, json;
  std::vector<std::string> definitions;
  bool overwrite = false;
};

std::string RateOf(const logs::Sight& sight) {
  const Eigen::VectorXd& t = sight.series.t;
  if (t.size() < 2 || t[t.size() - 1] <= t[0]) return "";
  return fmt::format("{:.4g}", static_cast<double>(t.size() - 1) / (t[t.size() - 1] - t[0]));
}

void PrintSights(const logs::Look& look) {
  report::Table topics{{"topic", "type", "rows", "Hz", "columns"}, {}};
  for (const logs::Sight& sight : look.sights)
    topics.rows.push_back({sight.name.empty() ? look.format : sight.name, sight.type,
                           std::to_string(sight.series.numbers.values.rows()), RateOf(sight),
                           std::to_string(sight.series.numbers.names.size())});
  fmt::print("{}\n", report::Text(topics));
  report::Table columns{{"column", "lowest", "highest"}, {}};
  for (const logs::Sight& sight : look.sights) {
    const auto& table = sight.series.numbers;
    for (std::size_t c = 0; c < table.names.size(); ++c) {
      double low = INFINITY, high = -INFINITY;
      for (const double x : table.values.col(static_cast<Eigen::Index>(c)))
        if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
      columns.rows.push_back({table.names[c], low <= high ? fmt::format("{:.6g}", low) : "",
                              low <= high ? fmt::format("{:.6g}", high) : ""});
    }
  }
  fmt::print("{}\n", report::Text(columns));
}

// The map names the definitions from its own folder; a map that is printed, from the current one.
std::vector<std::string> FromFolderOf(const std::string& map, const std::vector<std::string>& paths) {
  const std::filesystem::path folder =
      map.empty() ? std::filesystem::current_path() : std::filesystem::absolute(map).parent_path();
  std::vector<std::string> out;
  for (const std::string& path : paths)
    out.push_back(std::filesystem::proximate(std::filesystem::absolute(path), folder).string());
  return out;
}

nlohmann::ordered_json Json(const logs::Look& look, const logs::Proposal& proposal) {
  nlohmann::ordered_json json{{"format", look.format}, {"topics", nlohmann::ordered_json::array()}};
  for (const logs::Sight& sight : look.sights)
    json["topics"].push_back({{"topic", sight.name},
                              {"type", sight.type},
                              {"rows", sight.series.numbers.values.rows()},
                              {"columns", sight.series.numbers.names}});
  json["recognised"] = proposal.recognised;
  json["missing"] = proposal.missing;
  json["notes"] = look.notes;
  json["map"] = proposal.map;
  return json;
}

int Run(const ChannelsOptions& o) {
  if (!o.out.empty() && std::filesystem::exists(o.out) && !o.overwrite)
    throw io::InputError(o.out + ": is there already; --overwrite replaces it");
  const logs::Look look = logs::LookAt(o.log, {o.definitions.begin(), o.definitions.end()});
  for (const std::string& note : look.notes) SayAside(o.log + ": " + note);
  PrintSights(look);
  const logs::Proposal proposal =
      logs::Recognise(look, std::filesystem::path(o.log).filename().string(), FromFolderOf(o.out, o.definitions));
  WriteJson(o.json, Json(look, proposal));
  if (o.out.empty()) {
    fmt::print("{}", proposal.map);
    return kOk;
  }
  files::WriteWholeFile(o.out, proposal.map);
  std::string text;
  for (const std::string& quantity : proposal.recognised) text += (text.empty() ? "" : ", ") + quantity;
  fmt::print("{}: recognised: {}\n", o.out, text.empty() ? "nothing" : text);
  for (const std::string& quantity : proposal.missing)
    fmt::print("{}: not recognised: {}; name its columns there\n", o.out, quantity);
  return kOk;
}

}  // namespace

void AddChannels(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("channels",
                                  "show what a log holds, and write a channel map of what is recognised\n"
                                  "example: armcal channels run.mcap -o map.toml");
  auto o = std::make_shared<ChannelsOptions>();
  verb->add_option("log", o->log, "CSV, MCAP, rosbag2 (.db3 or folder) or MATLAB (.mat)")->required();
  verb->add_option("-o,--out", o->out, "channel map to write (default: it is printed)");
  AddMessages(*verb, o->definitions);
  verb->add_option("--json", o->json, "write topics, columns and the map here");
  verb->add_flag("--overwrite", o->overwrite, "write it although it is there");
  verb->callback([o, &action] { action = [o] { return Run(*o); }; });
}

}  // namespace armcal::tool
