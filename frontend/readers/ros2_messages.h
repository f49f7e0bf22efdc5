// Messages of ROS 2 as bags store them: CDR, the serialisation of DDS (OMG DDSI-RTPS 2.2, 10.2; the
// fields of sensor_msgs: github.com/ros2/common_interfaces).
#ifndef CAMGYRO_FRONTEND_READERS_ROS2_MESSAGES_H_
#define CAMGYRO_FRONTEND_READERS_ROS2_MESSAGES_H_

#include "core/result.h"
#include "frontend/readers/bag.h"
#include "frontend/readers/bytes.h"

namespace camgyro {

// Decodes a message of a known type: stamp_ns and content. Views point into `cdr`. Error: data that
// are cut short, or that are no plain CDR.
Status DecodeRos2Message(BagType type, ByteView cdr, BagMessage* message);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_ROS2_MESSAGES_H_
