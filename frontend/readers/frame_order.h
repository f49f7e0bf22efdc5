// Frames in the order of their stamps, as readers come upon them in the order of the pictures.
#ifndef CAMGYRO_FRONTEND_READERS_FRAME_ORDER_H_
#define CAMGYRO_FRONTEND_READERS_FRAME_ORDER_H_

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Remembers where stamps first repeat or go back, so that a complaint can name the line.
class FrameOrder {
 public:
  // Appends a frame. `place` is asked where it is ("file:line") if its stamp does not increase.
  void Add(Frame frame, const std::function<std::string()>& place, std::vector<Frame>* frames);

  // Leaves out frames until stamps increase strictly: of equal ones the first stays, of those that
  // step back the longest sequence in order. Their number is recorded in the faults. Call it when
  // the frames have their pictures, and before tables that name frames by their stamps. `where` is
  // named where Add was not called. Error, at the first place, if more than a twentieth of the
  // frames would be lost.
  Status Mend(const std::string& where, Recording* recording) const;

 private:
  std::optional<std::string> first_;  // where, and what is wrong there
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_FRAME_ORDER_H_
