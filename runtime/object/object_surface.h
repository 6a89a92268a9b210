#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <glm/vec3.hpp>

#include "runtime/base/bounding_sphere.h"
#include "scene/image/rgb_image.h"
#include "scene/model/object_mesh.h"

namespace daylit {

/// An object with faces of glass: what light loses on its straight way through them is said by the mesh
/// (scene/model/straight_light.h).
struct GlassObject {
  std::shared_ptr<const ObjectMesh> mesh;
  std::uint32_t first_triangle = 0; ///< of all objects; the others of the mesh follow it
  bool operator==(const GlassObject&) const = default;
};

/// All virtual objects together, in the world.
struct ObjectSurface {
  std::vector<glm::dvec3> positions; ///< world metres
  std::vector<glm::vec3> normals;    ///< unit, world frame
  std::vector<Rgb> reflectance;      ///< what they send on
  /// What a renderer draws: 1 where the material is looked up per pixel, 0 where nothing of it is diffuse.
  std::vector<Rgb> drawn_reflectance;
  std::vector<Rgb> emission; ///< radiance that they send by themselves, on both sides; empty: none does
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<GlassObject> glass; ///< ascending triangles
  BoundingSphere bounds() const;  ///< of the vertices that triangles use; radius 0 when there are none
};

/// Of one object vertex, on the side of its normal (front) and on the other (the inside of a thin shell).
struct VertexLight {
  Rgb indirect_front{0.0f}, open_sky_front{0.0f}; ///< reflected indirect radiance; open_sky_irradiance()
  Rgb indirect_back{0.0f}, open_sky_back{0.0f};
};

} // namespace daylit
