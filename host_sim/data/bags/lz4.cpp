// bags - decompresses LZ4 frames.
#include <lz4frame.h>

#include <memory>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

namespace {

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

}  // namespace

void UnpackLz4(Bytes packed, std::size_t size, std::string& out) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(made);
  out.resize(size);
  std::size_t done = 0, used = 0, hint = 1;
  while (hint != 0 && used < packed.size()) {
    std::size_t written = size - done, taken = packed.size() - used;
    hint = LZ4F_decompress(made, out.data() + done, &written, packed.data() + used, &taken, nullptr);
    if (LZ4F_isError(hint)) throw io::InputError("its LZ4 data are damaged");
    done += written, used += taken;
    if (written == 0 && taken == 0) break;
  }
  if (hint != 0 || done != size) throw io::InputError("its LZ4 data are damaged");
}

}  // namespace armcal::bags
