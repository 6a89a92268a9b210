#pragma once

// A session on files in a folder of its own: the box room with a synthetic light field, one camera, one sky.

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>

#include "runtime/session/session.h"
#include "scene/config/config.h"
#include "scene/lens/lens.h"
#include "scene/volume/volume_file.h"
#include "test_scene.h"

namespace daylit::test {

/// Probes every half metre; all regions light the room alike, more from above and from the window.
inline BasisVolume box_volume(const std::vector<Aperture>& apertures) {
  BasisVolume volume;
  volume.partition = *SkyPartition::uniform(64);
  volume.room = box_room();
  volume.apertures = apertures;
  ProbeSet& p = volume.probes;
  p.is_grid = true;
  p.count = {8, 10, 5};
  p.spacing = glm::dvec3(0.5);
  for (int k = 0; k < p.count.z; ++k)
    for (int j = 0; j < p.count.y; ++j)
      for (int i = 0; i < p.count.x; ++i) {
        p.positions.emplace_back(0.25 + 0.5 * i, 0.25 + 0.5 * j, 0.25 + 0.5 * k);
        p.valid.push_back(1);
      }
  for (int r = 0; r < 64; ++r)
    volume.stored_region.push_back(r);
  for (std::size_t k = 0; k < 64 * p.size(); ++k)
    for (int c = 0; c < 27; ++c)
      volume.basis.push_back(c < 3 ? 0.02f : c < 6 ? 0.003f : c < 9 ? 0.004f : 0.0f); // L00; y; z
  return volume;
}

inline Result<SkyImage> sky_image(const SkyMap& map) {
  RgbImage image(map.width, map.height);
  image.texels = map.radiance;
  return SkyImage::make(std::move(image), EquirectProjection{});
}

inline void write_ply(const std::filesystem::path& path, const ObjectMesh& mesh) {
  std::ofstream out(path, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.positions.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float "
         "nz\nelement face "
      << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    out.write(reinterpret_cast<const char*>(&mesh.positions[i]), sizeof(glm::vec3));
    out.write(reinterpret_cast<const char*>(&mesh.normals[i]), sizeof(glm::vec3));
  }
  for (const auto& t : mesh.triangles) {
    out.put(3);
    out.write(reinterpret_cast<const char*>(t.data()), sizeof(t));
  }
}

/// A folder with volume, lens and object, and the configuration that reads them. Removed at the end.
struct Studio {
  static constexpr int kWidth = 72, kHeight = 69;
  std::filesystem::path folder;
  RunConfig config;
  RgbImage photo{kWidth, kHeight};
  SkyMap sky = overcast_sky(64);

  explicit Studio(const std::vector<Aperture>& apertures = box_window()) {
    std::string pattern = (std::filesystem::temp_directory_path() / "daylit-studio-XXXXXX").string();
    folder = mkdtemp(pattern.data());
    config.light_samples = 12; // shadow maps on the processor are slow
    config.volume = folder / "room.volume";
    (void)write_volume(config.volume, box_volume(apertures));
    config.interior.lens = folder / "lens.yaml";
    (void)write_lens(config.interior.lens, ideal_pinhole(kWidth, kHeight, 0.6));
    config.world_from_camera = daylit::look_at({3.0, 4.6, 1.1}, {2.0, 3.4, 0.2});
    ObjectConfig object;
    object.model = folder / "ring.ply";
    object.position = {2.0, 3.4, 0.23};
    object.rotation_deg = {70.0, 0.0, 0.0};
    write_ply(object.model, torus(0.15f, 0.07f, 64, 32));
    config.objects.push_back(object);
    for (int i = 0; i < kWidth * kHeight; ++i) // no two neighbours alike: a pixel that was touched shows
      photo.texels[static_cast<std::size_t>(i)] = Rgb(0.2f + 0.001f * static_cast<float>(i % 97));
  }
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;
  ~Studio() {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }

  Result<Session> open(Backend backend) const {
    return Session::open(
        config, kWidth, kHeight, [](const std::string&, double) { return true; }, backend);
  }
  /// One frame, copied.
  Result<Frame> render(Session& session) const {
    const auto image = sky_image(sky);
    if (!image)
      return image.error();
    const auto frame = session.render({*image, photo});
    if (!frame)
      return frame.error();
    return **frame;
  }
  Result<Frame> render(Backend backend) const {
    auto session = open(backend);
    return session ? render(*session) : session.error();
  }
};

/// Every pixel is finite; what was not touched has the photograph's bits.
inline bool is_sound(const Composite& c, const RgbImage& photo) {
  for (std::size_t i = 0; i < photo.texels.size(); ++i) {
    const Rgb& p = c.picture.texels[i];
    if (!std::isfinite(p.r) || !std::isfinite(p.g) || !std::isfinite(p.b) || !std::isfinite(c.coverage[i]))
      return false;
    if (c.touched[i] == 0 && std::memcmp(&p, &photo.texels[i], sizeof(Rgb)) != 0)
      return false;
  }
  return true;
}

inline bool warns(const Frame& frame, const std::string& part) {
  for (const std::string& w : frame.report.warnings)
    if (w.find(part) != std::string::npos)
      return true;
  return false;
}

} // namespace daylit::test
