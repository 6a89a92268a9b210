#include "runtime/gl/light_batches.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "runtime/base/orthonormal.h"
#include "runtime/object/bounds.h"
#include "scene/core/parallel.h"
#include "scene/room/glass.h"

namespace daylit {

namespace {

constexpr int kLightsPerBatch = 8;
constexpr int kBlockVectors = 4096; // in a uniform block of 64 KiB, which OpenGL 4.5 drivers offer
constexpr int kPerLight = 4;        // vectors besides those per window
constexpr int kPerQuad = 5, kOtherFlat = 2;
constexpr float kNeverOut = -1e30f; // slope of windows that a light does not lead through

} // namespace

Result<LightBatches> LightBatches::make(const Gl& gl, std::span<const Aperture> apertures, const glm::dvec3& origin) {
  LightBatches b;
  b.gl_ = gl;
  std::size_t edges = 0;
  for (const Aperture& a : apertures) {
    edges += a.corners.size();
    b.append_quads(a, origin);
  }
  if (apertures.size() > kMaxApertures || edges > kMaxApertureEdges)
    return Error{ErrorCode::limit_exceeded,
                 std::to_string(apertures.size()) + " windows and holes are too many to draw", "room",
                 "at most " + std::to_string(kMaxApertures) + ": merge neighbouring panes"};
  if (b.quads_.empty()) { // its plane is nowhere in front: no light passes
    b.quads_.emplace_back();
    b.window_edges_.emplace_back();
  }
  b.choose_batch_size();
  GLint alignment = 1;
  gl->GetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
  const GLsizeiptr bytes = static_cast<GLsizeiptr>(sizeof(glm::vec4)) * b.lights_per_batch_ *
                           (kPerLight + 2 * static_cast<GLsizeiptr>(b.quads_.size()));
  const GLsizeiptr step = std::max<GLsizeiptr>(alignment, sizeof(glm::vec4));
  b.batch_bytes_ = (bytes + step - 1) / step * step;
  b.batches_ = make_buffer(gl, {});
  b.upload_windows();
  return b;
}

/// Flat values are cheapest, but few; a block takes up to the windows of any room.
void LightBatches::choose_batch_size() {
  GLint components = 60; // what OpenGL 4.5 promises
  gl_->GetIntegerv(GL_MAX_VARYING_COMPONENTS, &components);
  const int quads = static_cast<int>(quads_.size()), per_light = kPerLight + 2 * quads;
  const int room_for = components / 4 - kOtherFlat - kPerQuad * quads;
  flat_ = room_for >= per_light;
  lights_per_batch_ = kLightsPerBatch;
  while (lights_per_batch_ > 1 && lights_per_batch_ * per_light > (flat_ ? room_for : kBlockVectors))
    lights_per_batch_ /= 2;
}

void LightBatches::append_quads(const Aperture& a, const glm::dvec3& origin) {
  const auto plane_through = [&](const glm::dvec3& n, const glm::dvec3& p) {
    return glm::vec4(glm::vec3(n), static_cast<float>(-glm::dot(n, p - origin)));
  };
  glm::dvec3 middle(0.0);
  for (const glm::dvec3& c : a.corners)
    middle += c / static_cast<double>(a.corners.size());
  std::vector<glm::vec4> edges;
  for (std::size_t k = 0; k < a.corners.size(); ++k) {
    const glm::dvec3 corner = a.corners[k], span = a.corners[(k + 1) % a.corners.size()] - corner;
    const glm::dvec3 n = glm::cross(a.inward, span);
    if (glm::length(n) <= 0.0)
      continue;
    const glm::dvec3 unit = glm::normalize(n);
    edges.push_back(plane_through(glm::dot(unit, middle - corner) < 0.0 ? -unit : unit, corner));
  }
  edges.resize((std::max<std::size_t>(edges.size(), 1) + 3) / 4 * 4,
               glm::vec4(0.0f, 0.0f, 0.0f, 1.0f)); // always inside
  for (std::size_t k = 0; k < edges.size(); k += 4) {
    quads_.push_back({a.inward, k + 4 == edges.size(), a.transmittance, a.refractive_index});
    window_edges_.push_back(
        {plane_through(a.inward, a.corners[0]), {edges[k], edges[k + 1], edges[k + 2], edges[k + 3]}});
  }
}

void LightBatches::upload_windows() {
  std::vector<glm::vec4> block;
  for (const WindowEdges& q : window_edges_)
    block.push_back(q.plane);
  for (const WindowEdges& q : window_edges_)
    block.insert(block.end(), q.edges.begin(), q.edges.end());
  windows_ = make_buffer(gl_, std::as_bytes(std::span<const glm::vec4>(block)), GL_STATIC_DRAW);
}

std::string LightBatches::definitions() const {
  std::string each = "#define EACH_LIGHT(STEP)";
  for (int k = 0; k < lights_per_batch_; ++k)
    each += " STEP(" + std::to_string(k) + ")";
  return "#define LIGHTS " + std::to_string(lights_per_batch_) + "\n#define QUADS " + std::to_string(quads_.size()) +
         "\n#define FLAT " + (flat_ ? "1\n" : "0\n") + each + "\n";
}

void LightBatches::write_light(const DirectionalLight& light, int layer, int room_layer, int slot,
                               std::span<glm::vec4> batch) const {
  const auto at = [&, n = static_cast<std::size_t>(lights_per_batch_)](int field) -> glm::vec4& {
    return batch[static_cast<std::size_t>(field) * n + static_cast<std::size_t>(slot)];
  };
  const OrthonormalBasis basis(light.direction);
  at(0) = glm::vec4(glm::vec3(basis.u), static_cast<float>(room_layer));
  at(1) = glm::vec4(glm::vec3(basis.v), 0.0f);
  at(2) = glm::vec4(glm::vec3(light.direction), static_cast<float>(layer));
  at(3) = glm::vec4(light.irradiance, 0.0f);
  const std::size_t count = quads_.size(), first = kPerLight * static_cast<std::size_t>(lights_per_batch_);
  glm::vec4* pane = &batch[first + static_cast<std::size_t>(slot) * count];
  glm::vec4* slope = pane + static_cast<std::size_t>(lights_per_batch_) * count;
  for (std::size_t k = 0; k < count; ++k) {
    const Quad& q = quads_[k];
    const double approach = -glm::dot(q.inward, light.direction);
    *pane++ = glm::vec4(pane_transmittance(q.transmittance, q.refractive_index, std::max(approach, 0.0)),
                        q.ends ? 1.0f : 0.0f);
    for (int e = 0; e < 4; ++e)
      (*slope)[e] = approach > 0.0
                        ? static_cast<float>(glm::dot(glm::dvec3(window_edges_[k].edges[static_cast<std::size_t>(e)]),
                                                      light.direction) /
                                             approach)
                        : kNeverOut;
    ++slope;
  }
}

void LightBatches::write_group(std::span<const DirectionalLight> lights, const DepthRaster& room, LightGroup& group,
                               std::vector<glm::vec4>& data) const {
  const std::size_t vectors = static_cast<std::size_t>(batch_bytes_) / sizeof(glm::vec4);
  std::vector<std::uint8_t> by_room(lights.size());
  parallel_for(std::size_t{0}, lights.size(), [&](std::size_t j) { by_room[j] = room.meets(group.maps[j]); });
  group.first_batch = static_cast<int>(data.size() / vectors);
  group.batches = 0;
  group.room_maps.clear();
  for (const bool with_room : {true, false}) {
    int slot = 0;
    for (std::size_t j = 0; j < lights.size(); ++j) {
      if ((by_room[j] != 0) != with_room)
        continue;
      if (slot == 0) {
        data.resize(data.size() + vectors, glm::vec4(0.0f)); // unused: no light
        ++group.batches;
      }
      write_light(lights[j], static_cast<int>(j), static_cast<int>(group.room_maps.size()), slot,
                  {&data[data.size() - vectors], vectors});
      if (with_room)
        group.room_maps.push_back(group.maps[j]);
      slot = (slot + 1) % lights_per_batch_;
    }
    if (with_room)
      group.room_batches = group.batches;
  }
}

Result<void> LightBatches::set_lights(const LightSet& lights) {
  if (lights.size() > kMaxLights)
    return Error{ErrorCode::limit_exceeded, std::to_string(lights.size()) + " light samples", "renderer",
                 "at most " + std::to_string(kMaxLights)};
  lights_ = lights;
  for (auto [group, list] : {std::pair{&sky_, &lights_.sky}, {&sun_, &lights_.sun}}) {
    group->maps.clear();
    for (const DirectionalLight& l : *list) {
      const OrthonormalBasis basis(l.direction);
      group->maps.push_back({glm::vec3(basis.u), glm::vec3(basis.v), glm::vec3(l.direction)});
    }
    group->cone = bounding_cone(*list);
  }
  sun_normal_irradiance_ = Rgb(0.0f);
  for (const DirectionalLight& l : lights_.sun)
    sun_normal_irradiance_ += l.irradiance;
  return {};
}

Result<void> LightBatches::upload(const DepthRaster& room) {
  std::vector<glm::vec4> data;
  write_group(lights_.sky, room, sky_, data);
  write_group(lights_.sun, room, sun_, data);
  refill_buffer(gl_, batches_, std::as_bytes(std::span<const glm::vec4>(data)));
  return check_gl(*gl_, "uploading lights");
}

void LightBatches::bind_windows() const { gl_->BindBufferBase(GL_UNIFORM_BUFFER, 1, windows_.name()); }

void LightBatches::bind(int batch) const {
  gl_->BindBufferRange(GL_UNIFORM_BUFFER, 0, batches_.name(), batch * batch_bytes_, batch_bytes_);
}

} // namespace daylit
