#pragma once

// What paths are traced through: the reflecting surfaces of a room (and a printed marker board in it), an object that
// may or may not stand there, the openings, and the light outside. Local coordinates are RayScene's: room.origin().

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/config/config.h"
#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/model/object_mesh.h"
#include "scene/model/surface_look.h"
#include "scene/room/ray_scene.h"
#include "scene/room/room.h"
#include "scene/sky/sky_image.h"
#include "scene/sky/sky_model.h"
#include "simulate/aperture_sampler.h"

namespace daylit {

/// Number 23 of the dictionary DICT_6X6_250 (Garrido-Jurado et al. 2014): six rows of six cells, top row first, most
/// significant bit left, 1 = white. Around them a black border of one cell.
extern const std::array<std::uint8_t, 6> kMarker23;

/// A printed ArUco marker as a surface: a white sheet with one marker in its middle.
struct MarkerBoard {
  glm::dmat4 world_from_board{1.0}; ///< origin in the middle of the marker; x right, y up, z out of the board
  double marker_size_m = 0.1;       ///< outer side of the black border
  double margin_m = 0.025;          ///< white sheet around it
  float white_reflectance = 0.8f, black_reflectance = 0.04f;

  /// At the pose, of the size and with the white of the configuration; a margin of a quarter of the marker.
  static MarkerBoard printed(const MarkerConfig& marker);
  double half_side_m() const { return 0.5 * marker_size_m + margin_m; }
  /// Corners of the sheet, counter-clockwise seen from the front, world metres.
  std::array<glm::dvec3, 4> corners() const;
  /// Printed reflectance at a world point on the sheet.
  Rgb reflectance(const glm::dvec3& world_point) const;
};

struct SpotSample {
  glm::vec3 direction{0.0f};
  float density = 0.0f; ///< per sr
};

/// The distant light that paths end in: an analytic sky with its sun as a light of its own, or a sky image whose small
/// bright spots (a sun, its surroundings) can be sampled. Immutable, shared by threads.
class SkyLight {
public:
  explicit SkyLight(const SkyModel& model);
  explicit SkyLight(std::shared_ptr<const SkyImage> image);

  /// Everything but sun().
  Rgb radiance(const glm::vec3& unit_direction) const;
  /// The sun of an analytic sky. An image keeps its sun in radiance().
  const std::optional<SunDisc>& sun() const { return sun_; }

  /// Texels brighter than kSpotContrast times the mean, chosen by their power. None in an even sky.
  bool has_spots() const { return !spot_texel_.empty(); }
  std::optional<SpotSample> sample_spot(const glm::vec2& u) const;
  float spot_density(const glm::vec3& unit_direction) const;

  static constexpr float kSpotContrast = 8.0f;

private:
  std::variant<AnalyticSky, std::shared_ptr<const SkyImage>> source_;
  std::optional<SunDisc> sun_;
  std::vector<std::uint32_t> spot_texel_;
  std::vector<double> spot_cdf_;     ///< cumulative power, last = 1
  std::vector<float> texel_density_; ///< per texel, per sr; empty when there is no spot
};

struct SurfacePoint {
  glm::vec3 position{0.0f};         ///< local
  glm::vec3 geometric_normal{0.0f}; ///< unit, towards the side the ray came from
  glm::vec3 normal{0.0f};           ///< unit shading normal, same side
  Rgb reflectance{0.0f};            ///< of a plain surface
  float distance = 0.0f;
  bool on_object = false;
  bool plain = true;          ///< diffuse, and sends nothing by itself; else surface_look() says what it is
  bool outside = true;        ///< of the object: the ray came from the side that its triangles are wound for
  std::uint32_t triangle = 0; ///< of the object, or of the room's surfaces
  float u = 0.0f, v = 0.0f;   ///< weights of the corners 1 and 2 of the triangle
};

class TraceScene {
public:
  /// `object` null: there is none. `board` empty: none. Error: geometry_invalid for an object without triangles.
  static Result<TraceScene> make(const Room& room, const std::vector<Aperture>& apertures, const SkyLight& sky,
                                 const ObjectMesh* object = nullptr,
                                 const glm::dmat4& world_from_object = glm::dmat4(1.0),
                                 const std::optional<MarkerBoard>& board = std::nullopt);
  /// The same with the openings that find_apertures() sees in the room; its notes go to `notes`.
  static Result<TraceScene> of_room(const Room& room, const SkyLight& sky, const ObjectMesh* object = nullptr,
                                    const glm::dmat4& world_from_object = glm::dmat4(1.0),
                                    const std::optional<MarkerBoard>& board = std::nullopt,
                                    std::vector<std::string>* notes = nullptr);

  /// Surfaces of the room that mirror: the part of light seen face on, by material, as a smooth dielectric before the
  /// diffuse surface. `room`: what the scene was made of. Errors of declared_gloss().
  Result<void> declare_glossy(const Room& room, const std::map<std::string, double>& glossy);

  const ApertureSampler& apertures() const { return apertures_; }
  const SkyLight& sky() const { return sky_; }
  bool has_object() const { return object_.has_value(); }
  glm::vec3 to_local(const glm::dvec3& world) const { return room_.to_local(world); }
  float surface_offset() const { return room_.surface_offset(); }

  /// First surface along a unit direction. `touched` is set when the answer with and without the object differs.
  /// `room_origin`: where the ray starts for the room, a little before the origin where it has just gone through a face
  /// that may lie on the room. Where both lie at one place the object comes first: there is air between.
  std::optional<SurfacePoint> closest(const glm::vec3& room_origin, const glm::vec3& origin, const glm::vec3& direction,
                                      bool with_object, bool& touched) const;
  std::optional<SurfacePoint> closest(const glm::vec3& origin, const glm::vec3& direction, bool with_object,
                                      bool& touched) const;
  /// Is [0, distance] blocked? `touched` as above.
  bool occluded(const glm::vec3& origin, const glm::vec3& direction, float distance, bool with_object,
                bool& touched) const;

  /// The same for light of diffuse surfaces, which goes straight through transparent objects (docs/materials.md):
  /// first surface that is not transparent, and what is left of the light on the way; `through` is multiplied.
  std::optional<SurfacePoint> closest_opaque(const glm::vec3& origin, const glm::vec3& direction, bool with_object,
                                             bool& touched, Rgb& through) const;
  /// 0 where [0, distance] is blocked.
  Rgb transmittance(const glm::vec3& origin, const glm::vec3& direction, float distance, bool with_object,
                    bool& touched) const;

  /// Material, normal and tangent of a point that is not plain, local axes; the normal on the side that the triangle is
  /// wound for.
  SurfaceLook look(const SurfacePoint& point) const;

private:
  struct RoomSurface {
    glm::vec3 normal{0.0f}; ///< unit
    Rgb reflectance{0.0f};
    bool is_board = false;
    float mirrored = 0.0f; ///< of light face on
  };
  struct ObjectSurface {
    glm::vec3 normal{0.0f}; ///< unit, of the flat triangle
    bool plain = true, transparent = false;
  };
  RayScene room_;
  std::optional<RayScene> object_;
  std::vector<RoomSurface> room_surface_;
  std::vector<ObjectSurface> object_surface_;
  std::shared_ptr<const ObjectMesh> mesh_;
  std::vector<glm::vec3> object_normal_; ///< per vertex, world
  glm::mat3 world_from_mesh_{1.0f}, normal_matrix_{1.0f};
  bool has_transparent_ = false, has_textures_ = false;
  glm::vec3 object_min_{0.0f}, object_max_{0.0f}; ///< local box
  std::optional<MarkerBoard> board_;
  glm::dvec3 origin_{0.0};
  ApertureSampler apertures_;
  SkyLight sky_;

  TraceScene(const std::vector<Aperture>& apertures, const glm::dvec3& origin, const SkyLight& sky)
      : origin_(origin), apertures_(apertures, origin), sky_(sky) {}
  Result<void> place_object(const ObjectMesh& object, const glm::dmat4& world_from_object,
                            const std::vector<glm::dvec3>& vertices, std::uint32_t first_vertex);
  bool may_hit_object(const glm::vec3& origin, const glm::vec3& direction, float distance) const;
  SurfacePoint room_point(const glm::vec3& origin, const glm::vec3& direction, const RayHit& hit) const;
  float room_limit(const RayHit& hit, const glm::vec3& ahead, const glm::vec3& direction) const;
  SurfacePoint object_point(const glm::vec3& origin, const glm::vec3& direction, const RayHit& hit) const;
  SurfaceLook room_look(const SurfacePoint& point) const;
  Rgb straight(const RayHit& hit, const glm::vec3& direction, float from) const;
  bool stopped(const glm::vec3& origin, const glm::vec3& direction, float distance, Rgb& through, RayHit& hit) const;
};

} // namespace daylit
