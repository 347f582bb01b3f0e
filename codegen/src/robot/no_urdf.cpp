// robot - replaces the URDF reader where the program is built without urdfdom.
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/urdf.hpp"

namespace armcal::codegen {

UrdfChain ReadUrdf(const std::filesystem::path& path) {
  throw io::InputError(path.string() +
                       ": this program was built without a URDF reader; install liburdfdom-dev, then build it again");
}

}  // namespace armcal::codegen
