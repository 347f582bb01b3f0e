// tool - armcal report: makes the page of a result again, from its JSON.
#include <fmt/core.h>

#include "host_sim/diagnose/verdict/diagnosis_page.hpp"
#include "host_sim/diagnose/verdict/identification_page.hpp"
#include "host_sim/diagnose/verdict/summary.hpp"
#include "host_sim/tool/demo_result.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

namespace {

using nlohmann::ordered_json;
using WritePage = void (*)(const std::filesystem::path&, const ordered_json&);

// By a key that only the JSON of one verb has; null: no verb's that has a page.
WritePage PageOf(const ordered_json& json) {
  if (!json.is_object()) return nullptr;
  if (json.contains("closed")) return &WriteDemoPage;
  if (json.contains("findings") && json.contains("verdicts"))
    return [](const std::filesystem::path& path, const ordered_json& summary) {
      verdict::WriteSummaryPage(path, summary);
    };
  if (json.contains("terms")) return &verdict::WriteDiagnosisPage;
  if (json.contains("columns") && json.contains("exogeneity")) return &verdict::WriteIdentificationPage;
  return nullptr;
}

int RunReport(const std::string& path, const std::string& out, const std::string& json_out) {
  const ordered_json json = files::ReadJsonFile(path);
  const WritePage write = PageOf(json);
  if (write == nullptr)
    throw io::InputError(path + ": expected the JSON of armcal diagnose, identify or demo, or of a batch's summary");
  try {
    write(out, json);
  } catch (const ordered_json::exception& error) {
    const std::string what = error.what();  // "[json.exception.out_of_range.403] key 'curves' not found"
    throw io::InputError(fmt::format("{}: this file lacks what the page shows ({}): run the verb that wrote it again",
                                     path, what.substr(what.find("] ") + 2)));
  }
  fmt::print("report: {}\n", out);
  WriteJson(json_out, {{"result", path}, {"page", out}});
  return kOk;
}

}  // namespace

void AddReport(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "report", "make the page of a result again, from its JSON\nexample: armcal report verdict.json");
  struct Options {
    std::string result, out, json;
  };
  auto o = std::make_shared<Options>();
  verb->add_option("result", o->result,
                   "what --json of diagnose or identify (without --method) wrote, or a demo's result.json")
      ->required();
  auto* out =
      verb->add_option("--out", o->out, "the page to write (default: beside the result, with the ending .html)");
  verb->add_option("--json", o->json, "write the names of the result and of the page here");
  verb->callback([o, out, &action] {
    if (o->out.empty()) {
      o->out = std::filesystem::path(o->result).replace_extension(".html").string();
      out->add_result(o->out);  // so that CheckOutputs sees it
    }
    action = [o] { return RunReport(o->result, o->out, o->json); };
  });
}

}  // namespace armcal::tool
