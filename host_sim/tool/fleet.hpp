// tool - keeps verdicts, tables and health readings in a database, where a verb was asked to.
#pragma once

#include <map>
#include <string>

#include "host_sim/client/drive_client.hpp"
#include "host_sim/diagnose/verdict/verdict_file.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {

struct FleetOptions {
  std::string database, date, arm;
};

// Adds --db, --date and --arm. The help says what is kept, when, and which name the arm has without --arm; an empty
// `usual`: --db needs --arm.
void AddFleetOptions(CLI::App& verb, FleetOptions& o, const std::string& what, const std::string& when,
                     const std::string& usual = "");
// For the verbs that change or judge a drive.
void AddDriveFleetOptions(CLI::App& verb, FleetOptions& o, const std::string& what);

// Nothing without --db. So a database that cannot be written is named before a long run, and before a drive is changed.
void TryFleet(const FleetOptions& o);

// Nothing without --db. The names of the verdicts are those of the arms. log: held-out logs by arm; for others the
// verdict names its own. Prints how many are safe.
void KeepVerdicts(const FleetOptions& o, const verdict::Verdicts& verdicts,
                  const std::map<std::string, std::string>& log = {});

// Nothing without --db. The table that the drive has in force now, word for word. by: the verb that brought it; told:
// what the verb's JSON says; file: where it was read from, which is kept with its SHA-256.
void KeepTable(const FleetOptions& o, client::DriveClient& drive, const std::string& by,
               const nlohmann::ordered_json& told, const std::string& file = "");
// Nothing without --db. A health reading, as the verb's JSON says it, of the table in force.
void KeepHealth(const FleetOptions& o, client::DriveClient& drive, const nlohmann::ordered_json& told);

}  // namespace armcal::tool
