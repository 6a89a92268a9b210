#pragma once

// What cameras record: the interior picture with and without the object, and the fish-eye picture of the sky.

#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>

#include "scene/core/program.h"
#include "scene/core/result.h"
#include "scene/image/depth_picture.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/lens.h"
#include "scene/sky/sky_model.h"
#include "simulate/trace_scene.h"

namespace daylit {

struct PictureSettings {
  int samples = 512;     ///< paths per pixel where the object is; a quarter where its effect can be seen
  int base_samples = 32; ///< elsewhere
  std::uint32_t seed = 0;
};

/// All of one size, linear radiance. A pixel is the mean over its area (box filter).
struct InteriorPictures {
  RgbImage room;                    ///< without the object
  RgbImage truth;                   ///< the object really there; equal bit for bit where no path met it
  RgbImage truth_standard_error;    ///< of every pixel of `truth`
  RgbImage coverage;                ///< fraction of the pixel that the object covers
  double influenced_fraction = 0.0; ///< fraction of pixels that show the object or its effect
};

/// Both pictures from the same random numbers: a path is traced twice only when some ray of it met the object.
/// Same settings, same bits for any thread count. Error: interrupted, no object in the scene, samples < 16.
Result<InteriorPictures> render_interior(const TraceScene& scene, const LensModel& lens,
                                         const glm::dmat4& world_from_camera, const PictureSettings& settings,
                                         const Progress& progress = {});

/// What a depth camera at the same place would record of the room without the object: the depth through the middle of
/// each pixel, without noise. A hole where no surface is met.
DepthPicture render_depth(const TraceScene& scene, const LensModel& lens, const glm::dmat4& world_from_camera);

/// One pixel of each of these pictures.
struct PixelEstimate {
  Rgb room{0.0f}, truth{0.0f}, standard_error{0.0f};
  float coverage = 0.0f;
};

/// The same pictures at some pixels only: `samples` where the object or its effect shows, `base_samples` elsewhere.
/// A pixel has the bits of render_interior() where both give it the same number of samples.
Result<std::vector<PixelEstimate>> render_pixels(const TraceScene& scene, const LensModel& lens,
                                                 const glm::dmat4& world_from_camera,
                                                 std::span<const glm::ivec2> pixels, const PictureSettings& settings,
                                                 const Progress& progress = {});

/// The radiance that a fish-eye records: pixel means of the sky over the part of the pixel inside the field. The sun is
/// splatted by equal-area points of its disc, so that the sum of radiance x solid angle holds its energy exactly.
Result<RgbImage> render_sky_frame(const AnalyticSky& sky, const LensModel& lens);
/// The sky as an equirectangular picture, 2 height x height, its sun spread over the texels that it covers.
RgbImage render_sky_panorama(const AnalyticSky& sky, int height);

/// Multiplies every pixel by 1 + relative_deviation x a normal deviate, clipped at zero.
void add_sensor_noise(RgbImage& image, double relative_deviation, std::uint32_t seed);
/// Normal noise of deviation `noise_m` 1 m away, z metres away z^2 times as large; what falls below 0 is a hole.
void add_depth_noise(DepthPicture& depth, double noise_m, std::uint32_t seed);

} // namespace daylit
