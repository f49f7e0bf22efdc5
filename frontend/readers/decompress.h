// Compressed pieces of files.
#ifndef CAMGYRO_FRONTEND_READERS_DECOMPRESS_H_
#define CAMGYRO_FRONTEND_READERS_DECOMPRESS_H_

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "frontend/readers/bytes.h"

namespace camgyro {

// The content of LZ4 frames or Zstandard frames. Memory grows with what comes out, not with what
// the data claim; more than `limit` bytes are an error, as are data that are damaged or cut short.
Result<std::vector<uint8_t>> DecompressLz4(ByteView bytes, uint64_t limit);
Result<std::vector<uint8_t>> DecompressZstd(ByteView bytes, uint64_t limit);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_DECOMPRESS_H_
