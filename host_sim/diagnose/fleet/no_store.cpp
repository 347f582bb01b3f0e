// fleet - replaces store.cpp where the program is built without SQLite.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/fleet/store.hpp"

namespace armcal::fleet {
namespace {

[[noreturn]] void Refuse(const std::filesystem::path& database) {
  throw io::InputError(database.string() +
                       ": this program was built without SQLite; install libsqlite3-dev, then build it again");
}

}  // namespace

void Keep(const std::filesystem::path& database, Kind, const std::vector<Entry>&) { Refuse(database); }
std::vector<Entry> EntriesOf(const std::filesystem::path& database, Kind, const std::string&) { Refuse(database); }
std::vector<std::string> ArmsOf(const std::filesystem::path& database) { Refuse(database); }

}  // namespace armcal::fleet
