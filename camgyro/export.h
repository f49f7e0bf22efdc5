// What libcamgyro.so shows of itself; everything else is hidden.
#ifndef CAMGYRO_EXPORT_H_
#define CAMGYRO_EXPORT_H_

#if defined(CAMGYRO_BUILDING_LIBRARY)
#define CAMGYRO_API __attribute__((visibility("default")))
#else
#define CAMGYRO_API
#endif

#endif  // CAMGYRO_EXPORT_H_
