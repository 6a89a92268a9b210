#pragma once

// The scene of daylit-bench frame: the demo's room and sky, one of three objects, and pictures with fresh sensor noise.

#include <filesystem>
#include <string>
#include <vector>

#include "runtime/session/session.h"
#include "scene/config/config.h"
#include "scene/core/program.h"
#include "scene/image/image_formats.h"
#include "scene/lens/lens.h"
#include "scene/sky/sky_model.h"

namespace daylit::bench {

constexpr int kFrameWidth = 512, kFrameHeight = 496; ///< of both cameras, as in the paper

struct FrameScene {
  RunConfig config; ///< volume and models written to `folder`
  LensModel interior_lens;
  SkyModel sky_model;
  std::vector<SkyImage> skies;        ///< the same sky with fresh noise
  std::vector<RgbImage> photos;       ///< linear, the same view with fresh noise
  std::vector<Rgb8Image> photo_bytes; ///< what the marker is looked for in
};

/// `what`: "teapot" (4 K triangles), "blob" (15 K, closed, bumpy) or "folds" (102 K, 40 folds around), and a colon and
/// a name of scene/material/library.h for another material than a diffuse white. `sky`: "overcast", "sun" or "shade".
Result<FrameScene> make_frame_scene(const std::filesystem::path& folder, const std::string& what,
                                    const std::string& sky, int skies, int photos, const Progress& progress);

} // namespace daylit::bench
