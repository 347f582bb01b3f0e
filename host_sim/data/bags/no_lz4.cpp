// bags - replaces LZ4 where the program is built without it.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

void UnpackLz4(Bytes, std::size_t, std::string&) {
  throw io::InputError("this program was built without LZ4; install liblz4-dev, then build it again");
}

}  // namespace armcal::bags
