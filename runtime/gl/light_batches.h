#pragma once

// What the shaders know about the light of a frame, in batches of a few lights whose number is written into the
// program (shaders/light_batch.glsl).

#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "runtime/gl/depth_raster.h"
#include "runtime/gl/gl_objects.h"
#include "runtime/gl/shadow_reach.h"
#include "runtime/sky/direct_light.h"
#include "scene/room/room.h"

namespace daylit {

constexpr int kMaxLights = 1024, kMaxApertures = 256, kMaxApertureEdges = 2048;

struct LightGroup {
  std::vector<MapAxes> maps;      ///< per light
  std::vector<MapAxes> room_maps; ///< of those that the room may keep from points near the objects
  LightCone cone;
  /// The lights of room_maps come first, in batches of their own: the others need not look into those maps.
  int first_batch = 0, room_batches = 0, batches = 0;
};

class LightBatches {
public:
  /// Positions are relative to `origin` (world metres). Error limit_exceeded: too many windows.
  static Result<LightBatches> make(const Gl& gl, std::span<const Aperture> apertures, const glm::dvec3& origin);

  /// Error limit_exceeded: more than kMaxLights. upload() before they are drawn.
  Result<void> set_lights(const LightSet& lights);
  /// `room`: what of the room can stand between the objects and the sky.
  Result<void> upload(const DepthRaster& room);
  std::string definitions() const; ///< for the shaders
  void bind_windows() const;
  void bind(int batch) const;

  const LightGroup& sky() const { return sky_; }
  const LightGroup& sun() const { return sun_; }
  std::span<const WindowEdges> windows() const { return window_edges_; }
  const Rgb& sun_normal_irradiance() const { return sun_normal_irradiance_; }

private:
  /// Up to four edges of a window: the rest of what window_edges_ says.
  struct Quad {
    glm::dvec3 inward{0.0};
    bool ends = true; ///< the last of its window
    Rgb transmittance{0.0f};
    float refractive_index = 0.0f;
  };
  Gl gl_;
  std::vector<Quad> quads_;               ///< at least one
  std::vector<WindowEdges> window_edges_; ///< as many
  int lights_per_batch_ = 8;
  bool flat_ = false;          ///< the shaders hand a batch from vertices to fragments
  GLsizeiptr batch_bytes_ = 0; ///< from one to the next
  GlBuffer batches_, windows_;
  LightSet lights_;
  LightGroup sky_, sun_;
  Rgb sun_normal_irradiance_{0.0f};

  void choose_batch_size();
  void append_quads(const Aperture& aperture, const glm::dvec3& origin);
  void upload_windows();
  void write_group(std::span<const DirectionalLight> lights, const DepthRaster& room, LightGroup& group,
                   std::vector<glm::vec4>& data) const;
  /// Layers of the objects' maps and of the room's.
  void write_light(const DirectionalLight& light, int layer, int room_layer, int slot,
                   std::span<glm::vec4> batch) const;
};

} // namespace daylit
