#pragma once

// The passes that make a picture from visibility buffers, shadow maps and lights.

#include <string>

#include "runtime/base/pixel_box.h"
#include "runtime/base/render_camera.h"
#include "runtime/gl/light_batches.h"
#include "runtime/gl/light_points.h"
#include "runtime/gl/render_targets.h"
#include "runtime/gl/scene_buffers.h"
#include "runtime/gl/triangle_raster.h"

namespace daylit {

/// Shadow maps of a group of lights, of the objects and of the room.
struct MapTextures {
  GLuint objects = 0, room = 0;
  int texels = 0; ///< on a side
};

/// Of the objects' radius: parts of a pixel that lie further apart in depth are lit separately.
constexpr float kApartShare = 0.04f;

class PicturePasses {
public:
  /// `light_definitions`: LightBatches::definitions().
  static Result<PicturePasses> make(const Gl& gl, const std::string& light_definitions, int samples, bool room_blocks,
                                    bool ids_by_processor);

  /// For all that follow. `room_extent`: half the depth range of the room's maps, metres.
  void set_frame(const RenderCamera& camera, const glm::dvec3& origin, const BoundingSphere& sphere, double room_extent,
                 const LightBatches& lights);
  void show_room(const RoomBuffers& room, const RenderTargets& targets) const;
  /// Within `box`, which holds all pixels that may show objects and two more on each side.
  void show_objects(const RoomBuffers& room, const ObjectBuffers& objects, const PixelBox& box,
                    const RenderTargets& targets) const;
  /// The same, known already.
  void set_shown_objects(const TriangleRaster& raster, const RenderTargets& targets) const;
  /// Where the objects are asked for light, one point per pixel.
  void find_object_points(const ObjectBuffers& objects, const PixelBox& box, const RenderTargets& targets) const;
  /// Every point of the objects asks a group of the lights.
  void ask_objects(const LightBatches& lights, const LightGroup& group, const MapTextures& maps, const PixelBox& box,
                   const RenderTargets& targets, const LightSums& sums) const;
  /// What ask_objects() would leave of the sky, known already.
  void set_objects_sky(const LightAnswers& shares, const PixelBox& box, const RenderTargets& targets) const;
  /// Leaves what the objects show in the box of targets.object_picture.
  void draw_objects(const ObjectBuffers& objects, const PixelBox& box, const RenderTargets& targets) const;
  /// What points of the objects or of the room receive and lose of a group of the lights; as many points as the picture
  /// has pixels at most.
  enum class On { objects, room };
  Result<void> ask(On on, const LightPoints& points, const LightBatches& lights, const LightGroup& group,
                   const MapTextures& maps, const RenderTargets& targets, LightAnswers& answers) const;
  GLuint shadow_program() const { return shadow_.name(); }

private:
  struct LightPrograms {
    GlProgram past_room; ///< looks into the room's maps, for lights that need it
    GlProgram plain;
  };
  Gl gl_;
  GlProgram shadow_, ids_, object_points_, object_picture_, object_edges_;
  LightPrograms object_light_, room_light_;
  GlVertexArray nothing_; ///< for passes over the whole picture
  GlBuffer frame_;
  float room_extent_ = 1.0f;

  Result<void> build(const std::string& definitions);
  void draw_whole(const GlProgram& program) const;
  /// Adds up the lights of a group where pixels are marked; everywhere in a target without marks.
  void add_lights(const LightPrograms& programs, const LightBatches& lights, const LightGroup& group,
                  const LightSums& sums, int texels, std::initializer_list<GLuint> points_and_maps) const;
  void add_batches(const GlProgram& program, const LightBatches& lights, int first, int last, int texels) const;
  void bind(GLuint first_unit, std::initializer_list<GLuint> textures) const;
  void scissor(const PixelBox& box) const;
};

} // namespace daylit
