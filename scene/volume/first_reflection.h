#pragma once

// What the surfaces near a point send it of the light that they receive straight from the sky. Beside a sun patch, a
// sill or a table by the window this changes within centimetres: more than probes, sky nodes and the mean light of an
// element can tell. A compact basis names its elements, so that their light can be taken out between the probes around
// a point, and put in again as it is at the point (final gathering of the first bounce near by: Cohen & Wallace 1993,
// ch. 10.3; Ward et al. 1988 keep near and distant light apart for the same reason).

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/room/ray_scene.h"
#include "scene/volume/volume.h"

namespace daylit {

/// Rays on the surfaces between which the light of a volume was exchanged: its elements lie on these, which may be a
/// finger's breadth off those of its room. Errors of RayScene::build().
Result<RayScene> rays_of_light(const BasisVolume& volume);

class FirstReflection {
public:
  using Triangle = std::array<glm::dvec3, 3>;
  /// Mean radiance (unit of the sky) that a piece of an element sends back, world metres.
  using RadianceOf = std::function<Rgb(std::size_t element, const Triangle& piece)>;

  struct Element {
    Triangle corner; ///< world metres
    glm::dvec3 middle{0.0}, normal{0.0};
    double radius_m = 0; ///< of the sphere about the middle that holds the corners; 0: no probe sees it
    Rgb reflectance{0.0f};
  };

  /// Empty: the volume does not name its elements. Copies what it needs, but for `scene`: rays_of_light() of the
  /// volume.
  static std::optional<FirstReflection> make(const BasisVolume& volume, const RayScene& scene);

  const std::vector<Element>& elements() const { return element_; }
  /// Of each element as the volume has it, under a sky of this radiance at its nodes.
  std::vector<Rgb> radiance(std::span<const Rgb> node_radiance) const;
  /// `actual` at the point less `stored` interpolated from the probes, over the elements near the point on which
  /// `stored` is not 0. `weight`: of probes of the volume. Thread-safe.
  ShRadiance correction(const glm::dvec3& world_point, std::span<const std::uint32_t> probe,
                        std::span<const float> weight, std::span<const Rgb> stored, const RadianceOf& actual) const;
  /// An element, and how far its light counts.
  struct Near {
    std::uint32_t element;
    float weight;
  };
  /// Those on which `stored` is not 0, with weight 1 up to half of the reach, and of six of their radii, from the
  /// point, falling smoothly to 0 at its end.
  std::vector<Near> near(const glm::dvec3& point, double reach_m, std::span<const Rgb> stored) const;
  /// What these send to a probe of the volume, of light `stored`, times their weights.
  ShRadiance at_probe(std::uint32_t probe, std::span<const Near> list, std::span<const Rgb> stored) const;
  /// The field at the point, as `sampler` of the same volume gives it, with the correction; none where it gives none.
  std::optional<ShRadiance> corrected(const LightFieldSampler& sampler, const LightField& field,
                                      const glm::dvec3& world_point, std::span<const Rgb> stored,
                                      const RadianceOf& actual) const;

  /// What the elements near a point send, of radiance 1: for the light of many skies there.
  struct Exchange {
    struct ToPoint {
      std::uint32_t element;
      std::array<float, 9> nine, band4;
    };
    std::vector<ToPoint> here, probes; ///< to the point; to the probes around it, interpolated there
  };
  /// Of the elements on which `lit` is not 0. `weight`: of probes of the volume. Thread-safe.
  Exchange exchange(const glm::dvec3& world_point, std::span<const std::uint32_t> probe, std::span<const float> weight,
                    std::span<const Rgb> lit) const;
  /// As above, of elements that are lit evenly.
  static ShRadiance correction(const Exchange& exchange, std::span<const Rgb> stored, std::span<const Rgb> actual);

private:
  explicit FirstReflection(const RayScene& scene) : scene_(&scene) {}
  double reach(const glm::dvec3& point, std::span<const std::uint32_t> probe) const;
  ShRadiance gather(const glm::dvec3& point, std::span<const Near> list, const RadianceOf& radiance) const;
  void add_probe(std::uint32_t probe, float weight, std::span<const Near> list, const RadianceOf& radiance,
                 ShRadiance& sum) const;

  const RayScene* scene_;
  std::shared_ptr<const CompactBasis> basis_;
  std::vector<Element> element_;
  std::vector<glm::dvec3> probe_;                ///< world metres
  std::vector<std::array<std::uint32_t, 2>> of_; ///< of an interpolated probe; else twice the probe itself
  std::vector<float> weight_b_;
};

} // namespace daylit
