// tool - armcal learning: puts the estimators of a drive on hold, lets them go on, or makes them forget a joint.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <optional>

#include "armcal/link/registers.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/client/writer_seat.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

namespace reg = link::reg;

struct LearningOptions {
  std::string connect, reset, json;
  bool hold = false, resume = false;
};

// The register's value for a joint from 1, or "bodies"; 0: nothing to reset.
std::uint16_t BlockOf(const std::string& what, int axes) {
  if (what.empty()) return 0;
  if (what == "bodies") return static_cast<std::uint16_t>(axes + 1);
  for (int joint = 1; joint <= axes; ++joint)
    if (what == std::to_string(joint)) return static_cast<std::uint16_t>(joint);
  throw io::InputError(fmt::format("--reset {}: expected a joint from 1 to {}, or bodies", what, axes));
}

// Says what the drive says of itself, in words and as JSON.
void Report(client::DriveClient& drive, const client::Identity& id, const LearningOptions& o) {
  const bool held = drive.ReadValue<reg::kLearningHold>() != 0;
  const client::DriveStatus status = drive.ReadStatus();
  nlohmann::ordered_json json{{"held", held}, {"reset", o.reset}, {"filters", nlohmann::ordered_json::array()}};
  fmt::print("{}: {}\n", drive.name(), held ? "on hold" : "learning");
  for (int filter = 0; filter < 2; ++filter) {
    if ((id.capabilities & (filter == 0 ? reg::kHasFilterA : reg::kHasFilterB)) == 0) continue;
    const std::uint32_t used = status.rows_used[filter], gated = status.rows_gated[filter];
    const bool consistent = (status.health >> filter & 1) == 0;
    json["filters"].push_back({{"rows_used", used}, {"rows_gated", gated}, {"consistent", consistent}});
    fmt::print("filter {}: {} rows used since the adoption, {} not; {}\n", "AB"[filter], used, gated,
               used == 0    ? "too early to judge"
               : consistent ? "innovations as large as expected"
                            : "innovations larger than expected: the arm has changed, or does what the model lacks");
  }
  const std::vector<float> squared = drive.ReadFloats(reg::kConsistency, id.axes);
  json["consistency"] = squared;
  fmt::print("normalised innovation squared by joint, 1 expected: {:.2f}\n", fmt::join(squared, "  "));
  WriteJson(o.json, json);
}

int RunLearning(const LearningOptions& o) {
  client::DriveClient drive = ConnectTo(o.connect);
  const client::Identity id = drive.ReadIdentity();
  const std::uint16_t block = BlockOf(o.reset, id.axes);
  std::optional<client::WriterSeat> seat;
  if (block != 0 || o.hold || o.resume) seat.emplace(drive);
  if (o.hold || o.resume) drive.WriteValue<reg::kLearningHold>(o.hold ? 1 : 0);
  if (block != 0) drive.WriteValue<reg::kLearningReset>(block);
  Report(drive, id, o);
  return kOk;
}

}  // namespace

void AddLearning(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "learning",
      "what the drive's estimators do; hold them, let them go on, or drop what they knew of a joint or of the bodies\n"
      "reset the bodies after a change of the tool\nexample: armcal learning --connect 192.168.0.10:502 --reset "
      "bodies");
  auto o = std::make_shared<LearningOptions>();
  verb->add_option("--connect", o->connect, kConnectHelp)->required();
  auto* hold = verb->add_flag("--hold", o->hold, "samples no longer change the estimates");
  verb->add_flag("--resume", o->resume, "samples change the estimates again")->excludes(hold);
  verb->add_option("--reset", o->reset, "a joint from 1, or bodies: what was known of it no longer counts");
  verb->add_option("--json", o->json, "write the drive's answer here");
  verb->callback([o, &action] { action = [o] { return Reported(o->json, [&] { return RunLearning(*o); }); }; });
}

}  // namespace armcal::tool
