// bags - replaces the reader of rosbag2's database where the program is built without SQLite.
#include "host_sim/data/bags/container.hpp"

namespace armcal::bags {

bool IsDatabase(Bytes file) { return file.starts_with(Bytes("SQLite format 3\0", 16)); }

void ReadDatabase(const std::string&, Bytes, const Taker&) {
  throw io::InputError("this program was built without SQLite; install libsqlite3-dev, then build it again");
}

}  // namespace armcal::bags
