// Straight lines are imaged bent, alike in all directions from the principal point.
#include <algorithm>
#include <cmath>

#include "core/division_lens.h"
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class RadTan final : public Effect {
 public:
  explicit RadTan(const Eigen::Vector2d& start)
      : Effect({{"k1", "", 0.3, -0.6, 0.4}, {"k2", "", 0.3, -1.0, 1.0}}), start_(start) {}
  void ChangeLens(const Observation&, LensColumns columns) const override {
    columns(kK1, 0) = 1.0;
    columns(kK2, 1) = 1.0;
  }
  bool is_constant_lens() const override { return true; }
  void SetStart(double* values) const override { std::copy_n(start_.data(), 2, values); }

 private:
  const Eigen::Vector2d start_;
};

// Of Kannala & Brandt's series: the difference from the declared lens, so for a pinhole that from
// the series of tan. An equidistant fisheye lens without further distortion has some -1/3, -2/15.
// What is plausible of a term is what it makes of the angle at the edge of the picture: within the
// 40 degrees that a phone sees, theta^7 is small: a kb3 of -3 does there what a kb1 of -0.7 does.
class KannalaBrandt final : public Effect {
 public:
  KannalaBrandt(double edge_rad, const Eigen::Vector4d& start)
      : Effect({Term("kb1", 2, edge_rad, -0.8, 0.5), Term("kb2", 4, edge_rad, -1.5, 1.5),
                Term("kb3", 6, edge_rad, -2.0, 2.0), Term("kb4", 8, edge_rad, -2.0, 2.0)}),
        start_(start) {}
  void ChangeLens(const Observation&, LensColumns columns) const override {
    for (int k = 0; k < 4; ++k) columns(kKb1 + k, k) = 1.0;
  }
  bool is_constant_lens() const override { return true; }
  void SetStart(double* values) const override { std::copy_n(start_.data(), 4, values); }

 private:
  // min, max: of a picture that sees 1 rad off the axis, or more.
  static EffectParameter Term(const char* name, int power, double edge_rad, double min,
                              double max) {
    const double scale = std::pow(std::min(edge_rad, 1.0), -power);
    return {name, "", 0.3, scale * min, scale * max};
  }

  const Eigen::Vector4d start_;
};

constexpr char kRadTanShape[] = "radtan", kKannalaBrandtShape[] = "kannala_brandt";

std::vector<std::string> Shapes(const EffectSetup& setup) {
  if (!setup.has_pixels) return {};
  if (setup.distortion_model == DistortionModel::kKannalaBrandt) return {kKannalaBrandtShape};
  return {kKannalaBrandtShape, kRadTanShape};
}

std::shared_ptr<const Effect> Make(const EffectSetup& setup, const std::string& shape) {
  const std::vector<std::string> shapes = Shapes(setup);
  if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) return nullptr;
  // Where a fit begins: at what the matches show, or at the declared lens.
  const double lambda = setup.division_lambda, edge_tan = std::tan(setup.edge_rad);
  if (shape == kRadTanShape) return std::make_shared<RadTan>(RadTanLike(lambda, edge_tan));
  return std::make_shared<KannalaBrandt>(setup.edge_rad, KannalaBrandtLike(lambda, edge_tan));
}

}  // namespace

EffectEntry RadialDistortionEntry() {
  EffectEntry entry = {
      "radial_distortion", ModelPart::kLens,
      "the lens bends straight lines: the picture is stretched or squeezed towards its edge",
      "declare the fitted distortion (camera: distortion: of calibration.yaml) in sensor.yaml, "
      "and use it wherever the focal length is used"};
  entry.shapes = Shapes;
  entry.make = Make;
  entry.leads_astray = true;
  return entry;
}

}  // namespace camgyro
