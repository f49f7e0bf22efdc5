// Charts of the report: lines that the reader can zoom (dygraphs draws them), and maps (SVG).
#ifndef CAMGYRO_TOOLS_REPORT_CHARTS_H_
#define CAMGYRO_TOOLS_REPORT_CHARTS_H_

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace camgyro {

struct ChartSeries {
  std::string name;
  std::vector<double> y;     // one per x; NaN: no point there
  std::vector<double> band;  // half height of a band around y; empty: none
  bool points = false;       // dots instead of a line
  bool dashed = false;
};

struct LineChart {
  std::string id;  // unique on a page
  std::string title, x_label, y_label;
  std::vector<double> x;  // ascending
  std::vector<ChartSeries> series;
  std::vector<std::pair<double, std::string>> marks;  // vertical lines: x, what is there
  std::optional<std::pair<double, double>> y_range;   // shown at first
  bool log_y = false;
  std::string group;  // charts of one group zoom together along x
};
std::string LineChartHtml(const LineChart& chart);

// Charts beside each other, as many as the page is wide.
std::string ChartGrid(const std::vector<std::string>& charts);

// A value per cell of the picture, and optionally an arrow.
struct ImageMap {
  std::string title;
  Eigen::MatrixXd value;             // rows x columns of cells, top left first; NaN: no data
  Eigen::MatrixXd arrow_x, arrow_y;  // empty, or as value: right, down
};

// Maps side by side on one scale of colours (logarithmic, over the values of all maps) and of
// arrows, with their legend. `unit`: of values and arrows.
std::string ImageMapsHtml(const std::string& id, const std::string& caption,
                          const std::vector<ImageMap>& maps, double width_px, double height_px,
                          const std::string& unit);

// Matched features of a pair of frames: where each was, and where it is now.
struct DrawnMatch {
  Eigen::Vector2d px_a, px_b;
  bool inlier = true;
};
// `jpeg`: the second picture, scaled to any size; empty: an empty frame.
std::string MatchesHtml(const std::string& id, const std::string& caption, double width_px,
                        double height_px, const std::vector<unsigned char>& jpeg,
                        const std::vector<DrawnMatch>& matches);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_CHARTS_H_
