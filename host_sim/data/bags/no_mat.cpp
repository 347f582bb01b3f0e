// bags - replaces the reader of MATLAB files where the program is built without libmatio.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/mat.hpp"

namespace armcal::bags {

files::NumericTable ReadMat(const std::filesystem::path& path, const std::vector<std::string>&) {
  throw io::InputError(
      path.string() +
      ": this program was built without a reader of .mat files; install libmatio-dev, then build it again");
}

}  // namespace armcal::bags
