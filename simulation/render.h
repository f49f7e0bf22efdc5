// Video level: pictures of a scene through a rolling shutter.
#ifndef CAMGYRO_SIMULATION_RENDER_H_
#define CAMGYRO_SIMULATION_RENDER_H_

#include <opencv2/core/mat.hpp>
#include <random>
#include <vector>

#include "simulation/simulate.h"
#include "simulation/texture.h"

namespace camgyro::simulation {

// Where and when a pixel is sampled.
struct Sample {
  double time = 0.0;          // from the middle of the exposure, as a fraction of it
  Eigen::Vector2d offset_px;  // from the pixel's centre
};

// `least` or up to two more samples. Times and offsets in both directions are permutations of one
// even spacing, and with each sample there is its mirror image about the middle: a picture that
// moves is blurred without a shift. (Skewed blur shifts what a tracker finds by 0.02 px.)
std::vector<Sample> SamplesOfPixel(int least);

// Ray-casts a structured scene. Each line of the readout has poses of its own, several over the
// exposure (motion blur, SamplesOfPixel). Then vignetting, photon and read noise, 8 bits.
class Renderer {
 public:
  // `simulated` must outlive the renderer; its scene must have surfaces.
  Renderer(const Simulated& simulated, const Scenario& scenario);

  // The picture of frame i as the recording delivers it, 8-bit grey. Frames are to be rendered in
  // order: the noise continues from one to the next.
  cv::Mat Render(size_t frame);

 private:
  cv::Mat RenderSensor(const FrameTiming& timing);
  void RenderLine(const FrameTiming& timing, int line, const std::vector<Sample>& samples,
                  std::vector<float>* brightness);
  void FindBoxes(const FrameTiming& timing);
  float Shade(const Hit& hit, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
              double time_s) const;
  void AddNoise(const cv::Mat& brightness, cv::Mat* picture);
  cv::Mat Warp(const FrameTiming& timing, const cv::Mat& sensor) const;

  struct Box {
    int surface;
    double u_min, u_max, v_min, v_max;  // where it may be seen in this frame [px]
  };

  const Scenario& scenario_;
  const SimulatedCamera& camera_;
  const Scene& scene_;
  const std::vector<FrameTruth>& frames_;
  std::mt19937_64 random_;
  std::vector<Texture> textures_;  // by Surface::texture
  std::vector<float> normals_;     // table of standard normal numbers
  std::vector<int> unbounded_;     // surfaces that may be seen anywhere
  std::vector<Box> boxes_;         // the others, for the frame in work
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_RENDER_H_
