// bags - replaces zstd where the program is built without it.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

namespace {

[[noreturn]] void RefuseZstd() {
  throw io::InputError("this program was built without zstd; install libzstd-dev, then build it again");
}

}  // namespace

void UnpackZstd(Bytes, std::size_t, std::string&) { RefuseZstd(); }

std::string UnpackZstd(Bytes) { RefuseZstd(); }

}  // namespace armcal::bags
