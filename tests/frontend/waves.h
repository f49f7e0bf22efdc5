#ifndef CAMGYRO_TESTS_FRONTEND_WAVES_H_
#define CAMGYRO_TESTS_FRONTEND_WAVES_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>

namespace camgyro {

// A scene without pixels, so that a moved picture of it is exact: a sum of plane waves, their
// amplitude proportional to a power of their length; 1 is that of natural pictures (1/f).
class Waves {
 public:
  explicit Waves(unsigned seed, double power = 1.0) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> angle(0.0, 2.0 * M_PI);
    std::uniform_real_distribution<double> log_length(std::log(8.0), std::log(400.0));
    double variance = 0.0;
    for (Wave& wave : waves_) {
      const double direction = angle(generator), length_px = std::exp(log_length(generator));
      const double k = 2.0 * M_PI / length_px;
      const double amplitude = std::pow(length_px, power);
      wave = {amplitude, k * std::cos(direction), k * std::sin(direction), angle(generator)};
      variance += 0.5 * amplitude * amplitude;
    }
    for (Wave& wave : waves_) wave.amplitude *= 50.0 / std::sqrt(variance);
  }

  // Picture of w x h px that shows at pixel p the scene point R(turn) p - shift.
  cv::Mat Render(int w, int h, const Eigen::Vector2d& shift, double turn_rad = 0.0) const {
    return Render(w, h, shift, Eigen::Rotation2Dd(turn_rad).toRotationMatrix());
  }

  // And the scene point warp p - shift.
  cv::Mat Render(int w, int h, const Eigen::Vector2d& shift, const Eigen::Matrix2d& warp) const {
    cv::Mat image(h, w, CV_8U);
    for (int v = 0; v < h; ++v) {
      for (int u = 0; u < w; ++u) {
        const Eigen::Vector2d point = warp * Eigen::Vector2d(u, v) - shift;
        const double x = point.x(), y = point.y();
        double sum = 128.0;
        for (const Wave& wave : waves_) {
          sum += wave.amplitude * std::cos(wave.kx * x + wave.ky * y + wave.phase);
        }
        image.at<uchar>(v, u) = cv::saturate_cast<uchar>(sum);
      }
    }
    return image;
  }

 private:
  struct Wave {
    double amplitude, kx, ky, phase;
  };
  std::array<Wave, 60> waves_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_WAVES_H_
