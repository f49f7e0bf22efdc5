#include "frontend/readers/decompress.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <string>

#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr size_t kFirstSize = 1u << 16;

// Makes room behind the `used` bytes that `out` holds so far; false if that is the limit.
bool Grow(size_t used, uint64_t limit, std::vector<uint8_t>* out) {
  if (used < out->size()) return true;
  if (out->size() >= limit) return false;
  out->resize(std::min<uint64_t>(limit, std::max(kFirstSize, 2 * out->size())));
  return true;
}

tl::unexpected<Error> TooLarge(uint64_t limit) {
  return BadInput(Concat("unpacks to more than the ", limit, " bytes that were announced"));
}

}  // namespace

Result<std::vector<uint8_t>> DecompressLz4(ByteView bytes, uint64_t limit) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) {
    return BadInput("cannot be unpacked: no memory");
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  std::vector<uint8_t> out;
  size_t used = 0, at = 0, expects = 1;
  while (at < bytes.size || expects != 0) {
    uint8_t spare = 0;  // shows that more comes after the limit
    const bool room = Grow(used, limit, &out);
    size_t in_size = bytes.size - at, out_size = room ? out.size() - used : 1;
    expects = LZ4F_decompress(context.get(), room ? out.data() + used : &spare, &out_size,
                              bytes.data + at, &in_size, nullptr);
    if (LZ4F_isError(expects)) {
      return BadInput(Concat("cannot be unpacked (LZ4: ", LZ4F_getErrorName(expects), ")"));
    }
    if (!room && out_size > 0) return TooLarge(limit);
    if (in_size == 0 && out_size == 0 && expects != 0) return BadInput("is cut short (LZ4)");
    at += in_size;
    used += out_size;
  }
  out.resize(used);
  return out;
}

Result<std::vector<uint8_t>> DecompressZstd(ByteView bytes, uint64_t limit) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                     &ZSTD_freeDCtx);
  if (context == nullptr) return BadInput("cannot be unpacked: no memory");
  std::vector<uint8_t> out;
  size_t used = 0, expects = 1;
  ZSTD_inBuffer in{bytes.data, bytes.size, 0};
  while (in.pos < in.size || expects != 0) {
    uint8_t spare = 0;
    const bool room = Grow(used, limit, &out);
    ZSTD_outBuffer to{room ? out.data() + used : &spare, room ? out.size() - used : 1, 0};
    const size_t before = in.pos;
    expects = ZSTD_decompressStream(context.get(), &to, &in);
    if (ZSTD_isError(expects)) {
      return BadInput(Concat("cannot be unpacked (Zstandard: ", ZSTD_getErrorName(expects), ")"));
    }
    if (!room && to.pos > 0) return TooLarge(limit);
    if (in.pos == before && to.pos == 0 && expects != 0)
      return BadInput("is cut short (Zstandard)");
    used += to.pos;
  }
  out.resize(used);
  return out;
}

}  // namespace camgyro
