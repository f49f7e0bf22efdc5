// A tileable picture with natural statistics, for every surface of a scene.
#ifndef CAMGYRO_SIMULATION_TEXTURE_H_
#define CAMGYRO_SIMULATION_TEXTURE_H_

#include <cstdint>
#include <random>
#include <vector>

namespace camgyro::simulation {

// "Dead leaves": shapes of all sizes that cover each other, which gives the 1/f spectrum, edges
// and corners of real pictures at every distance (Lee, Mumford & Huang, IJCV 2001). A pyramid of
// means serves any size of a pixel's footprint without aliasing.
class Texture {
 public:
  explicit Texture(std::mt19937_64* random);

  // Brightness 0 to 1. (u, v) in tiles, any value; footprint: edge of the pixel in tiles. Linear
  // between texels and between levels of the pyramid.
  float At(double u, double v, double footprint) const;

 private:
  static constexpr int kLevels = 11;  // 1024 to 1 texels
  static constexpr int kSize = 1 << (kLevels - 1);

  float AtLevel(int level, float u, float v) const;

  std::vector<uint8_t> levels_[kLevels];  // row by row
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_TEXTURE_H_
