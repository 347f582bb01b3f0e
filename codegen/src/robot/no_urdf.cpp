// robot - replaces the URDF reader where the program is built without urdfdom.
#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/urdf.hpp"

namespace armcal::codegen {

namespace {

[[noreturn]] void Refuse(const std::filesystem::path& path) {
  throw io::InputError(path.string() +
                       ": this program was built without a URDF reader; install liburdfdom-dev, then build it again");
}

}  // namespace

std::string UrdfText(const std::filesystem::path& path) { Refuse(path); }

UrdfChain ReadUrdf(const UrdfChoice& choice) { Refuse(choice.path); }

UrdfChoice ChooseChain(const UrdfChoice& asked, std::vector<std::string>&) { Refuse(asked.path); }

}  // namespace armcal::codegen
