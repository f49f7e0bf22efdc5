#include "frontend/readers/camera_csv.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>
#include <utility>

#include "frontend/readers/csv_reader.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr double kLongestExposureS = 10.0;

CsvReader OpenTracks(const std::string& file) {
  return CsvReader(file, {"timestamp [ns]", "track_id", "u [px]", "v [px]"}, {4});
}

CsvReader OpenMatches(const std::string& file) {
  return CsvReader(
      file,
      {"timestamp_a [ns]", "timestamp_b [ns]", "u_a [px]", "v_a [px]", "u_b [px]", "v_b [px]"},
      {6});
}

CsvReader OpenAttitudes(const std::string& file) {
  return CsvReader(
      file, {"timestamp [ns]", "q_cam_world_w", "q_cam_world_x", "q_cam_world_y", "q_cam_world_z"},
      {5});
}

Result<std::vector<int64_t>> CollectStamps(CsvReader csv, size_t stamp_columns) {
  std::vector<int64_t> stamps, last(stamp_columns);
  while (csv.NextRow()) {
    for (size_t i = 0; i < stamp_columns; ++i) {
      const int64_t stamp = csv.Stamp(i);
      // Tables repeat stamps row by row, and may have millions of rows.
      if (!stamps.empty() && stamp == last[i]) continue;
      stamps.push_back(stamp);
      last[i] = stamp;
    }
  }
  if (!csv.status()) return tl::unexpected(csv.status().error());
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  return stamps;
}

// Index of a frame by its stamp; remembers the last one, as tables repeat stamps row by row.
class FrameIndex {
 public:
  explicit FrameIndex(const std::vector<Frame>& frames) {
    for (size_t i = 0; i < frames.size(); ++i) index_[frames[i].stamp_ns] = static_cast<int>(i);
  }

  // The frame of a stamp; fails in `csv` and returns 0 if there is none.
  int Find(int64_t stamp_ns, CsvReader* csv) const {
    const auto found = index_.find(stamp_ns);
    if (found != index_.end()) return found->second;
    csv->Fail(Concat("timestamp ", stamp_ns,
                     " is not the stamp of a frame, expected one of "
                     "cam0/data.csv"));
    return 0;
  }

 private:
  std::unordered_map<int64_t, int> index_;
};

// Reads a pixel; fails if it lies off the picture by more than a twentieth of its size, which a
// tracker does not do, but a wrong resolution or swapped columns do.
Eigen::Vector2d ReadPixel(size_t column, const CameraGuess& camera, CsvReader* csv) {
  const Eigen::Vector2d px(csv->Number(column), csv->Number(column + 1));
  const Eigen::Vector2d size(camera.width_px, camera.height_px);
  if (camera.width_px > 0 &&
      ((px.array() < -0.05 * size.array()).any() || (px.array() > 1.05 * size.array()).any())) {
    csv->Fail(Concat("pixel (", px.x(), ", ", px.y(),
                     ") is outside of the picture, expected it "
                     "within ",
                     camera.width_px, " x ", camera.height_px));
  }
  return px;
}

}  // namespace

Result<FrameTable> ReadFrameTable(const std::string& file) {
  FrameTable table;
  CsvReader csv(file, {"timestamp [ns]", "filename", "exposure [s]"}, {1, 2, 3});
  while (csv.NextRow()) {
    Frame frame;
    frame.stamp_ns = csv.Stamp(0);
    if (csv.width() > 1) frame.image_file = csv.Cell(1);
    if (csv.width() > 2 && !csv.Cell(2).empty()) {
      frame.exposure_s = csv.Number(2);
      if (frame.exposure_s < 0.0 || frame.exposure_s > kLongestExposureS) {
        csv.Fail(Concat("column 3, exposure [s]: ", frame.exposure_s,
                        " s was found, expected seconds, 0 to ", kLongestExposureS));
      }
    }
    if (!table.frames.empty() &&
        frame.image_file.empty() != table.frames.back().image_file.empty()) {
      csv.Fail("column 2, filename: expected a name in every row, or in none");
    }
    if (!csv.status()) break;
    table.order.Add(
        std::move(frame), [&csv] { return csv.Place(); }, &table.frames);
    table.lines.push_back(csv.line());
  }
  if (!csv.status()) return tl::unexpected(csv.status().error());
  return table;
}

Result<std::vector<int64_t>> ReadTrackStamps(const std::string& file) {
  return CollectStamps(OpenTracks(file), 1);
}

Result<std::vector<int64_t>> ReadMatchStamps(const std::string& file) {
  return CollectStamps(OpenMatches(file), 2);
}

Result<std::vector<int64_t>> ReadAttitudeStamps(const std::string& file) {
  return CollectStamps(OpenAttitudes(file), 1);
}

Status ReadTracks(const std::string& file, Recording* recording) {
  CsvReader csv = OpenTracks(file);
  const FrameIndex index(recording->frames);
  std::vector<std::vector<TrackedPoint>> tracks(recording->frames.size());
  int last_frame = 0;
  while (csv.NextRow()) {
    const int frame = index.Find(csv.Stamp(0), &csv);
    const TrackedPoint point(csv.Integer(1), ReadPixel(2, recording->camera, &csv));
    std::vector<TrackedPoint>& points = tracks[frame];
    auto after = points.end();  // of those with a smaller id; most tables have them in order
    if (!points.empty() && points.back().track_id >= point.track_id) {
      after = std::lower_bound(points.begin(), points.end(), point.track_id,
                               [](const TrackedPoint& p, int64_t id) { return p.track_id < id; });
    }
    if (after != points.end() && after->track_id == point.track_id) {
      csv.Fail(Concat("track_id ", point.track_id, " repeats within the frame of timestamp ",
                      csv.Cell(0), ", expected it once"));
    }
    if (!csv.status()) return csv.status();
    // Where frames come one after the other, one that is complete gives back what it took ahead.
    if (points.empty()) tracks[last_frame].shrink_to_fit();
    points.insert(after, point);
    last_frame = frame;
  }
  if (!csv.status()) return csv.status();
  for (std::vector<TrackedPoint>& points : tracks) points.shrink_to_fit();
  recording->tracks = std::move(tracks);
  return {};
}

Status ReadMatches(const std::string& file, Recording* recording) {
  CsvReader csv = OpenMatches(file);
  const FrameIndex index(recording->frames);
  std::map<std::pair<int, int>, std::vector<Match>> by_pair;
  while (csv.NextRow()) {
    const int64_t stamp_a = csv.Stamp(0), stamp_b = csv.Stamp(1);
    if (stamp_a >= stamp_b) {
      csv.Fail(Concat("timestamp_a ", stamp_a, " is not before timestamp_b ", stamp_b,
                      ", expected a < b"));
    }
    const int frame_a = index.Find(stamp_a, &csv), frame_b = index.Find(stamp_b, &csv);
    Match match;
    match.px_a = ReadPixel(2, recording->camera, &csv);
    match.px_b = ReadPixel(4, recording->camera, &csv);
    if (!csv.status()) return csv.status();
    by_pair[{frame_a, frame_b}].push_back(match);
  }
  if (!csv.status()) return csv.status();
  for (auto& [frames, matches] : by_pair) {
    recording->matches.push_back({frames.first, frames.second, std::move(matches)});
  }
  return {};
}

Status ReadAttitudes(const std::string& file, Recording* recording) {
  CsvReader csv = OpenAttitudes(file);
  const FrameIndex index(recording->frames);
  const std::vector<Frame>& frames = recording->frames;
  std::vector<bool> seen(frames.size(), false);
  std::vector<Eigen::Quaterniond> q_cam_world(frames.size(), Eigen::Quaterniond::Identity());
  int repeated = 0;
  while (csv.NextRow()) {
    const int frame = index.Find(csv.Stamp(0), &csv);
    const Eigen::Quaterniond q(csv.Number(1), csv.Number(2), csv.Number(3), csv.Number(4));
    if (!csv.status()) return csv.status();
    if (seen[frame] && q.normalized().coeffs() == q_cam_world[frame].coeffs()) {
      ++repeated;
      continue;
    }
    if (seen[frame]) {
      csv.Fail(Concat("timestamp ", frames[frame].stamp_ns,
                      " repeats with another attitude, expected it once"));
    }
    if (std::abs(q.norm() - 1.0) > 1e-3) {
      csv.Fail(Concat("the quaternion's norm is ", q.norm(), ", expected 1 within 0.001"));
    }
    seen[frame] = true;
    q_cam_world[frame] = q.normalized();
  }
  if (!csv.status()) return csv.status();
  const auto missing = std::find(seen.begin(), seen.end(), false);
  if (missing != seen.end()) {
    return BadInput(Concat(file, ": the frame of timestamp ",
                           frames[missing - seen.begin()].stamp_ns,
                           " has no attitude, expected one row for every frame"));
  }
  if (repeated > 0) {
    AddFault("attitudes_repeat", repeated,
             Concat(file, ": ", repeated, " rows that repeat an attitude were dropped"), recording);
  }
  recording->q_cam_world = std::move(q_cam_world);
  return {};
}

}  // namespace camgyro
