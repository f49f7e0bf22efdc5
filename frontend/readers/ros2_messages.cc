#include "frontend/readers/ros2_messages.h"

#include <string>

namespace camgyro {
namespace {

constexpr size_t kHeaderSize = 4;            // of the encapsulation, before the data
constexpr uint32_t kMostCoefficients = 100;  // of a lens; models have up to 14

// Primitives are aligned to their size, counted from behind the encapsulation header.
class CdrCursor {
 public:
  CdrCursor(ByteView data, bool big_endian) : cursor_(data, big_endian) {}

  bool good() const { return cursor_.good(); }

  uint8_t U8() { return cursor_.U8(); }
  uint32_t U32() {
    Align(4);
    return cursor_.U32();
  }
  double F64() {
    Align(8);
    return cursor_.F64();
  }
  ByteView Octets() {
    const uint32_t size = U32();
    return cursor_.Take(size);
  }
  // Length with the terminating zero, then the characters and that zero.
  std::string Text() {
    const uint32_t size = U32();
    std::string text = cursor_.Text(size);
    if (!text.empty() && text.back() == '\0') text.pop_back();
    return text;
  }
  Eigen::Vector3d Vector() {
    const double x = F64(), y = F64(), z = F64();
    return {x, y, z};
  }
  void SkipF64(int count) {
    for (int i = 0; i < count; ++i) F64();
  }
  // std_msgs/Header: stamp {int32 sec, uint32 nanosec}, string frame_id. Returns the stamp [ns].
  int64_t Header() {
    const auto sec = static_cast<int32_t>(U32());
    const uint32_t nanosec = U32();
    Text();
    return int64_t{1000000000} * sec + int64_t{nanosec};
  }

 private:
  void Align(size_t size) { cursor_.Skip((size - cursor_.position() % size) % size); }

  ByteCursor cursor_;
};

BagImu Imu(CdrCursor* cdr) {
  cdr->SkipF64(4 + 9);  // orientation and its covariance
  BagImu imu;
  imu.rates_rad_s = cdr->Vector();
  cdr->SkipF64(9);
  imu.accel_m_s2 = cdr->Vector();
  return imu;
}

RosImage Image(CdrCursor* cdr) {
  RosImage image;
  image.height = cdr->U32();
  image.width = cdr->U32();
  image.encoding = cdr->Text();
  image.is_bigendian = cdr->U8() != 0;
  image.step = cdr->U32();
  image.data = cdr->Octets();
  return image;
}

BagCameraInfo CameraInfo(CdrCursor* cdr) {
  BagCameraInfo info;
  info.height = cdr->U32();
  info.width = cdr->U32();
  info.distortion_model = cdr->Text();
  const uint32_t coefficients = cdr->U32();
  for (uint32_t i = 0; i < coefficients && i < kMostCoefficients && cdr->good(); ++i) {
    info.distortion.push_back(cdr->F64());
  }
  double k[9], p[12];
  for (double& value : k) value = cdr->F64();
  cdr->SkipF64(9);  // R
  for (double& value : p) value = cdr->F64();
  info.raw = {k[0], k[4], k[2], k[5]};
  info.rectified = {p[0], p[5], p[2], p[6]};
  return info;
}

}  // namespace

Status DecodeRos2Message(BagType type, ByteView cdr, BagMessage* message) {
  // The representation: 0x0000 CDR big-endian, 0x0001 CDR little-endian; then two bytes of options.
  if (cdr.size < kHeaderSize || cdr.data[0] != 0 || cdr.data[1] > 1) {
    return BadInput("is no plain CDR, expected a message of ROS 2");
  }
  CdrCursor cursor({cdr.data + kHeaderSize, cdr.size - kHeaderSize}, cdr.data[1] == 0);
  message->stamp_ns = cursor.Header();
  if (type == BagType::kImu) {
    message->content = Imu(&cursor);
  } else if (type == BagType::kImage) {
    message->content = Image(&cursor);
  } else if (type == BagType::kCompressedImage) {
    cursor.Text();  // format, which the data themselves tell
    message->content = BagCompressedImage{cursor.Octets()};
  } else {
    message->content = CameraInfo(&cursor);
  }
  if (!cursor.good()) return BadInput("the message is cut short");
  return {};
}

}  // namespace camgyro
