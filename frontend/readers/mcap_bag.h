// MCAP (mcap.dev/spec, version 0) with messages of ROS 2 inside.
#ifndef CAMGYRO_FRONTEND_READERS_MCAP_BAG_H_
#define CAMGYRO_FRONTEND_READERS_MCAP_BAG_H_

#include <memory>
#include <string>

#include "core/result.h"
#include "frontend/readers/bag.h"

namespace camgyro {

// Chunks may be plain, LZ4 or Zstandard. Of a file that ends within a record, as a crash leaves it,
// what is before that record is taken, and noted. Errors: no MCAP, damaged records, records larger
// than kLargestRecord.
Result<std::unique_ptr<Bag>> OpenMcap(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_MCAP_BAG_H_
