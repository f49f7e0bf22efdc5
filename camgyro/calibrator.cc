// The boundary of the library: checks of the options, and no exception leaves.
#include "camgyro/calibrator.h"

#include <string>
#include <utility>

#include "camgyro/convert.h"
#include "camgyro/worker.h"

namespace camgyro::api {

Calibrator::Calibrator(std::unique_ptr<Worker> worker) : worker_(std::move(worker)) {}
Calibrator::~Calibrator() = default;

std::unique_ptr<Calibrator> Calibrator::Create(const CalibratorOptions& options,
                                               std::string* error) noexcept {
  try {
    const auto refuse = [&](const std::string& why) {
      if (error != nullptr) *error = why;
      return nullptr;
    };
    const Result<camgyro::CameraGuess> camera = FromApi(options.camera);
    if (!camera) return refuse(camera.error().message);
    for (const double wanted :
         {options.ready_focal, options.ready_principal, options.ready_readout_s,
          options.ready_delay_s, options.ready_bias_rad_s, options.ready_rotation_rad}) {
      if (!(wanted > 0.0)) return refuse("options: expected positive wanted sigmas");
    }
    if (!(options.start_s >= 2.0 && options.start_s <= 10.0)) {
      return refuse("options: expected start_s from 2 to 10");
    }
    if (options.max_frames_waiting < 2 || options.max_frames_waiting > 10'000) {
      return refuse("options: expected max_frames_waiting from 2 to 10000");
    }
    return std::unique_ptr<Calibrator>(new Calibrator(std::make_unique<Worker>(options, *camera)));
  } catch (...) {
    return nullptr;  // no memory or no thread
  }
}

AddResult Calibrator::AddGyro(std::int64_t stamp_ns, double x, double y, double z) noexcept {
  try {
    return worker_->AddGyro({stamp_ns, {x, y, z}});
  } catch (...) {
    return AddResult::kStopped;
  }
}

AddResult Calibrator::AddAccel(std::int64_t stamp_ns, double x, double y, double z) noexcept {
  try {
    return worker_->AddAccel({stamp_ns, {x, y, z}});
  } catch (...) {
    return AddResult::kStopped;
  }
}

AddResult Calibrator::AddImage(std::int64_t stamp_ns, const ImageView& image) noexcept {
  try {
    return worker_->AddImage(stamp_ns, image);
  } catch (...) {
    return AddResult::kStopped;
  }
}

AddResult Calibrator::AddTracks(std::int64_t stamp_ns, const TrackPoint* points,
                                std::size_t count) noexcept {
  try {
    return worker_->AddTracks(stamp_ns, points, count);
  } catch (...) {
    return AddResult::kStopped;
  }
}

std::shared_ptr<const Snapshot> Calibrator::snapshot() const noexcept {
  return worker_->snapshot();
}

VinsStart Calibrator::InitialiseVins(const VinsSettings& settings) const noexcept {
  try {
    return worker_->InitialiseVins(settings);
  } catch (...) {
    VinsStart failed;
    failed.verdict = VinsVerdict::kNotConverged;
    return failed;
  }
}

bool Calibrator::WaitUntilIdle(double timeout_s) const noexcept {
  try {
    return worker_->WaitUntilIdle(timeout_s);
  } catch (...) {
    return false;
  }
}

}  // namespace camgyro::api
