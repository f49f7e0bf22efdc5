#include "simulation/texture.h"

#include <algorithm>
#include <cmath>

namespace camgyro::simulation {
namespace {

struct Leaf {
  double u, v, half_long, half_short, cosine, sine;
  bool round;
  float brightness;
};

// Without SSE 4.1, std::floor is a call, and this is the innermost loop.
template <typename T>
int Floor(T value) {
  const int truncated = static_cast<int>(value);
  return truncated - (value < static_cast<T>(truncated) ? 1 : 0);
}

// Distance from the edge, negative inside [texels].
double SignedDistance(const Leaf& leaf, double du, double dv) {
  const double x = leaf.cosine * du + leaf.sine * dv, y = leaf.cosine * dv - leaf.sine * du;
  if (leaf.round) return std::hypot(x, y) - leaf.half_short;
  return std::max(std::abs(x) - leaf.half_long, std::abs(y) - leaf.half_short);
}

}  // namespace

Texture::Texture(std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<float> canvas(static_cast<size_t>(kSize) * kSize, 0.5f);
  for (double radius = 160.0; radius > 4.0; radius /= 1.6) {
    // Part of the tile under the shapes of one size; more would hide the large below the small.
    const double cover = radius > 40.0 ? 0.35 : 0.12;
    const int count = static_cast<int>(cover * kSize * kSize / (3.0 * radius * radius));
    for (int i = 0; i < count; ++i) {
      Leaf leaf;
      leaf.u = unit(*random) * kSize;
      leaf.v = unit(*random) * kSize;
      leaf.half_short = radius * (0.7 + 0.4 * unit(*random));
      leaf.half_long = leaf.half_short * (1.0 + unit(*random));
      const double angle = M_PI * unit(*random);
      leaf.cosine = std::cos(angle);
      leaf.sine = std::sin(angle);
      leaf.round = unit(*random) < 0.3;
      leaf.brightness = static_cast<float>(unit(*random));
      const int reach = static_cast<int>(leaf.half_long + leaf.half_short) + 2;
      const int u0 = static_cast<int>(leaf.u), v0 = static_cast<int>(leaf.v);
      for (int v = v0 - reach; v <= v0 + reach; ++v) {
        for (int u = u0 - reach; u <= u0 + reach; ++u) {
          const double inside = 0.5 - SignedDistance(leaf, u - leaf.u, v - leaf.v);
          if (inside <= 0.0) continue;
          const auto alpha = static_cast<float>(std::min(1.0, inside));
          float& texel = canvas[static_cast<size_t>(v & (kSize - 1)) * kSize +
                                static_cast<size_t>(u & (kSize - 1))];
          texel += alpha * (leaf.brightness - texel);
        }
      }
    }
  }
  for (int level = 0, size = kSize; level < kLevels; ++level, size /= 2) {
    for (const float texel : canvas) {
      levels_[level].push_back(static_cast<uint8_t>(std::lround(255.0f * texel)));
    }
    std::vector<float> half;
    for (int v = 0; v + 1 < size; v += 2) {
      for (int u = 0; u + 1 < size; u += 2) {
        const float* top =
            &canvas[static_cast<size_t>(v) * static_cast<size_t>(size) + static_cast<size_t>(u)];
        half.push_back(0.25f * (top[0] + top[1] + top[size] + top[size + 1]));
      }
    }
    canvas = std::move(half);
  }
}

float Texture::AtLevel(int level, float u, float v) const {
  const int size = kSize >> level, mask = size - 1;
  // Texel (0, 0) of every level begins at tile coordinate 0: its centre is half a texel further.
  const float x = u * static_cast<float>(size) - 0.5f, y = v * static_cast<float>(size) - 0.5f;
  const int u0 = Floor(x), v0 = Floor(y);
  const float ax = x - static_cast<float>(u0), ay = y - static_cast<float>(v0);
  const int x0 = u0 & mask, x1 = (u0 + 1) & mask;
  const int y0 = (v0 & mask) * size, y1 = ((v0 + 1) & mask) * size;
  const uint8_t* texels = levels_[level].data();
  const float top =
      static_cast<float>(texels[y0 + x0]) * (1.0f - ax) + static_cast<float>(texels[y0 + x1]) * ax;
  const float bottom =
      static_cast<float>(texels[y1 + x0]) * (1.0f - ax) + static_cast<float>(texels[y1 + x1]) * ax;
  return top + (bottom - top) * ay;
}

float Texture::At(double u, double v, double footprint) const {
  const auto fu = static_cast<float>(u - Floor(u)), fv = static_cast<float>(v - Floor(v));
  const float texels = static_cast<float>(footprint) * kSize;
  const float level = std::clamp(std::log2(std::max(texels, 1.0f)), 0.0f, kLevels - 1.001f);
  const int whole = static_cast<int>(level);
  const float fine = AtLevel(whole, fu, fv), coarse = AtLevel(whole + 1, fu, fv);
  return (fine + (coarse - fine) * (level - static_cast<float>(whole))) * (1.0f / 255.0f);
}

}  // namespace camgyro::simulation
