// Memory that was freed, back to the system.
#ifndef CAMGYRO_CORE_FREE_MEMORY_H_
#define CAMGYRO_CORE_FREE_MEMORY_H_

namespace camgyro {

// Gives the pages that malloc keeps of freed blocks back to the system, those between blocks that
// are in use as well. To be called between two steps that take much memory in blocks of different
// sizes: glibc keeps small ones for small ones, and asks the system for large ones, so that without
// it both stay. Takes some milliseconds for each 100 MB; nothing happens with another C library.
void GiveBackFreeMemory();

}  // namespace camgyro

#endif  // CAMGYRO_CORE_FREE_MEMORY_H_
