// consumer RECORDING: reads a recording with pictures, decodes its first frame and hands its gyro
// samples to a sliding window. Exits with 0 if all of that worked.
#include <iostream>
#include <opencv2/core/mat.hpp>

#include "core/calibration.h"
#include "core/lens.h"
#include "estimator/window/sliding_window.h"
#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: consumer RECORDING\n";
    return 2;
  }
  const auto recording = camgyro::ReadRecording(argv[1]);
  if (!recording) {
    std::cerr << recording.error().message << "\n";
    return 3;
  }
  const auto frames = camgyro::OpenFrames(*recording);
  cv::Mat gray;
  if (!frames || !(*frames)->Next(&gray).value_or(false)) {
    std::cerr << "no frame\n";
    return 3;
  }

  camgyro::Prior prior;
  camgyro::Calibration& start = prior.mean;
  start.width_px = gray.cols;
  start.height_px = gray.rows;
  start.lens = camgyro::MakePinhole(0.8 * gray.cols, {0.5 * gray.cols, 0.5 * gray.rows});
  prior.sigma.setConstant(0.1);
  camgyro::SlidingWindow window(start, prior, recording->gyro.front().stamp_ns, {});
  for (const camgyro::GyroSample& sample : recording->gyro) {
    if (window.AddGyroSample(sample) != camgyro::AddResult::kAccepted) return 1;
  }
  std::cout << recording->frames.size() << " frames of " << gray.cols << " x " << gray.rows << ", "
            << recording->gyro.size() << " gyro samples\n";
}
