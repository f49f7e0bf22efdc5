#include "frontend/readers/gopro_reader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/robust_statistics.h"
#include "core/time.h"
#include "frontend/readers/frame_order.h"
#include "frontend/readers/gpmf.h"
#include "frontend/readers/mp4_box.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_clock.h"
#include "frontend/readers/text.h"
#include "frontend/readers/video_container.h"

namespace camgyro {
namespace {

constexpr double kMostSamples = 1e10;        // a month of the fastest gyro
constexpr double kShortestIntervalS = 1e-5;  // of any gyro

struct Payload {
  double start_s = 0.0;
  GpmfPayload gpmf;
};

Result<std::vector<Payload>> ReadPayloads(const std::string& file, const VideoContainer& video) {
  std::vector<Payload> payloads;
  for (const DataPacket& packet : video.gpmf) {
    auto gpmf = ReadGpmfPayload({packet.bytes.data(), packet.bytes.size()});
    if (!gpmf) {
      return BadInput(Concat(file, ": telemetry payload ", payloads.size(),
                             " is malformed: ", gpmf.error().message));
    }
    payloads.push_back({packet.start_s, std::move(*gpmf)});
  }
  return payloads;
}

// What the camera says about its settings: the GPMF box beside the tracks, flattened.
struct Settings {
  std::map<std::string, std::string> texts;
  std::optional<double> readout_ms;  // HERO8 and later; before, SROT stands in the telemetry
};

Settings ReadSettings(const std::string& file) {
  Settings settings;
  if (const auto firmware = ReadMp4Box(file, {"moov", "udta", "FIRM"})) {
    settings.texts["FIRM"] = Trim(std::string(firmware->begin(), firmware->end()).c_str());
  }
  const auto box = ReadMp4Box(file, {"moov", "udta", "GPMF"});
  if (!box) return settings;
  std::vector<ByteView> levels = {{box->data(), box->size()}};
  while (!levels.empty()) {
    const auto items = ParseGpmf(levels.back());
    levels.pop_back();
    if (!items) continue;  // settings are extras: the telemetry itself stands without them
    for (const GpmfItem& item : *items) {
      if (item.type == 0) levels.push_back(item.value);
      if (item.type == 'c') settings.texts.emplace(item.key, item.Text());
      const std::vector<double> numbers =
          item.key == "SROT" ? item.Numbers() : std::vector<double>();
      if (!numbers.empty() && std::isfinite(numbers[0])) settings.readout_ms = numbers[0];
    }
  }
  return settings;
}

std::string ModelName(const std::map<std::string, std::string>& settings,
                      const std::string& device_name) {
  const auto model = settings.find("MINF");
  if (model != settings.end()) return model->second;
  const auto firmware = settings.find("FIRM");  // "HD5.02.02" in a HERO5
  if (firmware != settings.end() && firmware->second.compare(0, 2, "HD") == 0) {
    const std::string& text = firmware->second;
    return "HERO" + text.substr(2, text.find('.') - 2);
  }
  return device_name;
}

// The order that a model stores its axes in without saying so (gpmf-parser's README). The HERO5's
// is what later models refer to.
std::string DefaultOrientation(const std::string& model) {
  if (model.find("HERO6") != std::string::npos || model.find("Hero6") != std::string::npos) {
    return "YxZ";
  }
  return model.find("Fusion") != std::string::npos ? "yXZ" : "ZXY";
}

// The samples of one sensor through all payloads, on their clock.
struct SensorSamples {
  std::vector<int64_t> stamps_ns;
  std::vector<Eigen::Vector3d> values;
  SampleClock clock;
  std::vector<size_t> counts;  // of each payload
  std::string unit, orientation;
  bool orientation_stated = false;
};

Result<SensorSamples> CollectSamples(const std::vector<Payload>& payloads, const std::string& key,
                                     const std::string& default_orientation) {
  SensorSamples sensor;
  std::vector<SampleLump> lumps;
  std::vector<const GpmfStream*> streams;
  std::vector<double> payload_starts_s;
  bool stamped = true;
  for (const Payload& payload : payloads) {
    for (const GpmfStream& stream : payload.gpmf.streams) {
      if (stream.key != key || stream.samples == 0) continue;
      if (stream.elements != 3) {
        return BadInput(Concat(key, " has ", stream.elements, " elements, expected 3"));
      }
      streams.push_back(&stream);
      payload_starts_s.push_back(payload.start_s);
      stamped = stamped && stream.stamp_us.has_value();
    }
  }
  if (streams.empty()) return sensor;

  int64_t seen = 0;
  for (size_t i = 0; i < streams.size(); ++i) {
    // TSMP counts samples of payloads that are missing from the file, too.
    double first = static_cast<double>(seen);
    if (streams[i]->total_samples && streams[0]->total_samples) {
      first = *streams[i]->total_samples - *streams[0]->total_samples +
              static_cast<double>(streams[0]->samples) - static_cast<double>(streams[i]->samples);
    }
    if (!(first >= static_cast<double>(seen) && first < kMostSamples)) {
      return BadInput(Concat(key, ": sample counts (TSMP) go back or are out of range"));
    }
    // The camera's own stamps are better than the payloads' times, but have another origin.
    const double start_s =
        stamped ? payload_starts_s[0] + 1e-6 * (*streams[i]->stamp_us - *streams[0]->stamp_us)
                : payload_starts_s[i];
    lumps.push_back({std::llround(first), start_s});
    sensor.counts.push_back(streams[i]->samples);
    seen = lumps.back().first_sample + static_cast<int64_t>(streams[i]->samples);
  }
  const auto clock = FitSampleClock(lumps);
  if (!clock) return BadInput(Concat(key, ": ", clock.error().message));
  if (clock->interval_s < kShortestIntervalS) {
    return BadInput(Concat(key, ": a rate of ", 1.0 / clock->interval_s, " Hz is not plausible"));
  }
  sensor.clock = *clock;

  sensor.unit = streams[0]->unit;
  sensor.orientation_stated = !streams[0]->orientation.empty();
  sensor.orientation = sensor.orientation_stated ? streams[0]->orientation : default_orientation;
  const auto axes = AxesFromOrientation(sensor.orientation);
  if (!axes) {
    return BadInput(Concat(key, ": ORIN '", sensor.orientation,
                           "' is no right-handed order of axes, expected one like 'ZXY', 'YxZ'"));
  }
  for (size_t i = 0; i < streams.size(); ++i) {
    for (size_t j = 0; j < streams[i]->samples; ++j) {
      const double sample = static_cast<double>(lumps[i].first_sample + static_cast<int64_t>(j));
      sensor.stamps_ns.push_back(StampAt(0, clock->origin_s + clock->interval_s * sample));
      sensor.values.push_back(*axes *
                              Eigen::Map<const Eigen::Vector3d>(&streams[i]->values[3 * j]));
    }
  }
  return sensor;
}

// All values of a stream with one element, through all payloads.
std::vector<double> CollectScalars(const std::vector<Payload>& payloads, const std::string& key) {
  std::vector<double> values;
  for (const Payload& payload : payloads) {
    for (const GpmfStream& stream : payload.gpmf.streams) {
      if (stream.key == key && stream.elements == 1) {
        values.insert(values.end(), stream.values.begin(), stream.values.end());
      }
    }
  }
  return values;
}

void NoteGyroClock(const SensorSamples& gyro, Recording* recording) {
  recording->notes.push_back(
      Concat("gyro clock: ", gyro.stamps_ns.size(), " samples of ", gyro.counts.size(),
             " telemetry payloads laid on one line of ", 1.0 / gyro.clock.interval_s,
             " Hz; payload times deviate from it by up to ", 1e3 * gyro.clock.largest_deviation_s,
             " ms (payload ", gyro.clock.largest_deviation_lump, ")"));

  std::vector<size_t> counts = gyro.counts;
  const auto usual = static_cast<double>(MedianInPlace(&counts));
  // The last payload ends with the recording and may be short.
  for (size_t i = 0; i + 1 < gyro.counts.size(); ++i) {
    if (std::abs(static_cast<double>(gyro.counts[i]) - usual) > 0.05 * usual) {
      recording->notes.push_back(Concat(
          "telemetry payload ", i, " has ", gyro.counts[i], " gyro samples, others ", usual,
          ": when it starts is uncertain by about ",
          1e3 * gyro.clock.interval_s * std::abs(static_cast<double>(gyro.counts[i]) - usual),
          " ms"));
    }
  }
  const double gyro_end_s = SecondsSince(0, gyro.stamps_ns.back());
  const double video_end_s = SecondsSince(0, recording->frames.back().stamp_ns);
  if (gyro_end_s < video_end_s) {
    recording->notes.push_back(Concat("the gyro ends at ", gyro_end_s,
                                      " s, the video's last frame is at ", video_end_s, " s"));
  }
}

void SetExposures(const std::vector<double>& exposures_s, Recording* recording) {
  const size_t frames = recording->frames.size();
  for (size_t i = 0; i < std::min(frames, exposures_s.size()); ++i) {
    recording->frames[i].exposure_s = exposures_s[i];
  }
  if (!exposures_s.empty() && exposures_s.size() != frames) {
    recording->notes.push_back(Concat("exposures (SHUT) of ", exposures_s.size(), " of ", frames,
                                      " frames are recorded, counted from the first frame"));
  }
}

// EISE tells whether the picture was stabilised electronically, EISA how.
void SetStabilisation(const std::map<std::string, std::string>& settings, Recording* recording) {
  const auto enabled = settings.find("EISE");
  const auto kind = settings.find("EISA");
  const std::string kind_name = kind == settings.end() ? "" : kind->second;
  const bool off = kind_name.empty() || kind_name == "N/A" || kind_name == "OFF";
  if (enabled == settings.end() ? off : enabled->second != "Y") return;
  std::string words = enabled == settings.end() ? "" : "EISE=" + enabled->second;
  if (kind != settings.end()) words += (words.empty() ? "EISA=" : ", EISA=") + kind_name;
  recording->declared_stabilisation = words;
}

}  // namespace

Result<Recording> ReadGoPro(const std::string& file) {
  const Result<VideoContainer> video = ReadVideoContainer(file);
  if (!video) return tl::unexpected(video.error());
  if (video->missing_frames > 0) {
    return BadInput(Concat(file, ": the file is cut short: ", video->missing_frames,
                           " frames are missing, and their telemetry"));
  }
  if (video->gpmf.empty()) {
    return BadInput(Concat(file,
                           ": a video without gyro: it has no GoPro telemetry (GPMF) stream; "
                           "expected one, or a folder with the video as cam0/video.mp4 and the "
                           "gyro as imu0/data.csv"));
  }
  if (video->stamps_ns.size() < 2) {
    return BadInput(
        Concat(file, ": has ", video->stamps_ns.size(), " frames, expected at least two"));
  }
  const auto payloads = ReadPayloads(file, *video);
  if (!payloads) return tl::unexpected(payloads.error());
  const Settings settings = ReadSettings(file);
  const std::string model = ModelName(settings.texts, payloads->front().gpmf.device_name);

  const auto gyro = CollectSamples(*payloads, "GYRO", DefaultOrientation(model));
  const auto accel = CollectSamples(*payloads, "ACCL", DefaultOrientation(model));
  for (const auto* sensor : {&gyro, &accel}) {
    if (!*sensor) return BadInput(Concat(file, ": ", sensor->error().message));
  }
  if (gyro->values.empty()) {
    return BadInput(Concat(file,
                           ": its telemetry has no gyro (GYRO); expected a GoPro HERO5 or later, "
                           "or a folder with cam0/video.mp4 and imu0/data.csv"));
  }
  if (!gyro->unit.empty() && gyro->unit != "rad/s") {
    return BadInput(Concat(file, ": GYRO is in '", gyro->unit, "', expected rad/s"));
  }

  Recording recording;
  recording.path = file;
  recording.video_file = file;
  recording.camera.width_px = video->width_px;
  recording.camera.height_px = video->height_px;
  for (const int64_t stamp_ns : video->stamps_ns) {
    recording.frames.emplace_back().stamp_ns = stamp_ns;
  }
  for (size_t i = 0; i < gyro->values.size(); ++i) {
    recording.gyro.push_back({gyro->stamps_ns[i], gyro->values[i]});
  }
  for (size_t i = 0; i < accel->values.size(); ++i) {
    recording.accel.push_back({accel->stamps_ns[i], accel->values[i]});
  }
  if (Status unit = CheckRateUnit(file, recording.gyro); !unit) {
    return tl::unexpected(unit.error());
  }

  const auto view = settings.texts.find("VFOV");
  recording.notes.push_back(Concat(
      "GoPro ", model, view == settings.texts.end() ? "" : ", field of view (VFOV) " + view->second,
      ", gyro axes ", gyro->orientation,
      gyro->orientation_stated ? " (ORIN)" : " (the model's; the file does not say)"));
  NoteGyroClock(*gyro, &recording);
  SetExposures(CollectScalars(*payloads, "SHUT"), &recording);
  if (Status mended = FrameOrder().Mend(file, &recording); !mended) {
    return tl::unexpected(mended.error());
  }
  SetStabilisation(settings.texts, &recording);
  std::vector<double> readouts_ms = CollectScalars(*payloads, "SROT");
  if (settings.readout_ms) readouts_ms = {*settings.readout_ms};
  if (!readouts_ms.empty()) {
    recording.camera.readout_s = 1e-3 * MedianInPlace(&readouts_ms);
  }
  if (video->display_rotation_deg != 0) {
    recording.notes.push_back(Concat("the video is to be shown rotated by ",
                                     video->display_rotation_deg,
                                     " deg clockwise; it is used without that rotation"));
  }
  return recording;
}

}  // namespace camgyro
