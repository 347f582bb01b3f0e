// bags - decompresses zstd frames.
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/bags/unpack.hpp"

namespace armcal::bags {

namespace {

constexpr const char* kZstdDamaged = "its zstd data are damaged or cut short";

struct FreeZstd {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

}  // namespace

void UnpackZstd(Bytes packed, std::size_t size, std::string& out) {
  out.resize(size);
  if (ZSTD_decompress(out.data(), size, packed.data(), packed.size()) != size) throw io::InputError(kZstdDamaged);
}

std::string UnpackZstd(Bytes packed) {
  const std::unique_ptr<ZSTD_DCtx, FreeZstd> context(ZSTD_createDCtx());
  if (!context) throw std::bad_alloc();
  const std::size_t most = MostBytes(packed.size());
  std::string out;
  std::size_t done = 0, hint = 1;
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  while (in.pos < in.size || hint != 0) {
    if (done == out.size()) out.resize(std::min(most, std::max<std::size_t>(std::size_t{1} << 16, 2 * done)));
    if (done == out.size())
      throw io::InputError("it grows to more than 64 MB and 256 times its size, which no log does");
    ZSTD_outBuffer room{out.data(), out.size(), done};
    const std::size_t before = in.pos;
    hint = ZSTD_decompressStream(context.get(), &room, &in);
    if (ZSTD_isError(hint)) throw io::InputError(kZstdDamaged);
    if (in.pos == before && room.pos == done) throw io::InputError(kZstdDamaged);
    done = room.pos;
  }
  out.resize(done);
  return out;
}

}  // namespace armcal::bags
