#include "bench/bench_rooms.h"

#include <array>
#include <filesystem>

#include <unistd.h>

#include "scene/core/atomic_file.h"
#include "simulate/sample_scene.h"

namespace daylit::bench {
namespace {

/// Writes quads as OBJ text: one `v` block and one `f` per quad.
class QuadWriter {
public:
  void material(const std::string& name) { faces_ += "usemtl " + name + "\n"; }
  void quad(const std::array<glm::dvec3, 4>& corner) {
    for (const glm::dvec3& c : corner)
      vertices_ += "v " + std::to_string(c.x) + " " + std::to_string(c.y) + " " + std::to_string(c.z) + "\n";
    faces_ += "f";
    for (int k = 0; k < 4; ++k)
      faces_ += " " + std::to_string(++count_);
    faces_ += "\n";
  }
  void wall(double x0, double y0, double x1, double y1, double z0, double z1) {
    quad({glm::dvec3(x0, y0, z0), {x1, y1, z0}, {x1, y1, z1}, {x0, y0, z1}});
  }
  void flat(double x0, double y0, double x1, double y1, double z) {
    quad({glm::dvec3(x0, y0, z), {x1, y0, z}, {x1, y1, z}, {x0, y1, z}});
  }
  /// A box without bottom.
  void box(double x0, double y0, double x1, double y1, double z0, double z1) {
    wall(x0, y0, x1, y0, z0, z1);
    wall(x1, y0, x1, y1, z0, z1);
    wall(x1, y1, x0, y1, z0, z1);
    wall(x0, y1, x0, y0, z0, z1);
    flat(x0, y0, x1, y1, z1);
  }
  /// Wall along x at y = y0, z0 to z1, with a window pane in it.
  void wall_with_pane(double x0, double x1, double y0, double z0, double z1, double wx0, double wx1, double wz0,
                      double wz1) {
    wall(x0, y0, x1, y0, z0, wz0);
    wall(x0, y0, x1, y0, wz1, z1);
    wall(x0, y0, wx0, y0, wz0, wz1);
    wall(wx1, y0, x1, y0, wz0, wz1);
    material("window");
    wall(wx0, y0, wx1, y0, wz0, wz1);
    material("white");
  }
  std::string text() const { return "mtllib rooms.mtl\n" + vertices_ + faces_; }

private:
  std::string vertices_, faces_;
  int count_ = 0;
};

const char* const kMaterials =
    "newmtl white\nKd 0.8 0.8 0.78\nnewmtl floor\nKd 0.35 0.25 0.18\nnewmtl wood\nKd 0.5 0.35 0.2\n"
    "newmtl window\nKd 0 0 0\nTf 0.8 0.8 0.8\n";

std::string office() {
  QuadWriter w;
  w.material("floor");
  w.flat(0, 0, 6, 4, 0);
  w.material("white");
  w.flat(0, 0, 6, 4, 2.7);
  w.wall_with_pane(0, 3, 0, 0, 2.7, 0.6, 2.4, 0.9, 2.2);
  w.wall_with_pane(3, 6, 0, 0, 2.7, 3.6, 5.4, 0.9, 2.2);
  w.wall(6, 0, 6, 4, 0, 2.7);
  w.wall(6, 4, 0, 4, 0, 2.7);
  w.wall(0, 4, 0, 0, 0, 2.7);
  w.material("wood");
  w.box(4.2, 0.4, 5.6, 1.2, 0.0, 0.72);
  w.box(0.0, 3.4, 1.2, 4.0, 0.0, 1.9);
  return w.text();
}

std::string l_shape() {
  QuadWriter w;
  w.material("floor");
  w.flat(0, 0, 6, 3, 0);
  w.flat(0, 3, 3, 6, 0);
  w.material("white");
  w.flat(0, 0, 6, 3, 2.6);
  w.flat(0, 3, 3, 6, 2.6);
  w.wall_with_pane(0, 6, 0, 0, 2.6, 3.8, 5.6, 0.8, 2.2);
  w.wall(6, 0, 6, 3, 0, 2.6);
  w.wall(6, 3, 3, 3, 0, 2.6);
  w.wall(3, 3, 3, 6, 0, 2.6);
  w.wall(3, 6, 0, 6, 0, 2.6);
  w.wall(0, 6, 0, 0, 0, 2.6);
  return w.text();
}

/// Below two rooms joined by a door, above one; a stairwell leads up. Windows below in the south, above in the north.
std::string storeys() {
  QuadWriter w;
  w.material("floor");
  w.flat(0, 0, 6, 4, 0);
  for (const double z : {2.6, 2.8}) { // the slab, around the stairwell x 4.4..5.6, y 0.6..3.4
    w.material(z > 2.7 ? "floor" : "white");
    w.flat(0, 0, 4.4, 4, z);
    w.flat(5.6, 0, 6, 4, z);
    w.flat(4.4, 0, 5.6, 0.6, z);
    w.flat(4.4, 3.4, 5.6, 4, z);
  }
  w.material("white");
  w.wall(4.4, 0.6, 5.6, 0.6, 2.6, 2.8);
  w.wall(5.6, 0.6, 5.6, 3.4, 2.6, 2.8);
  w.wall(5.6, 3.4, 4.4, 3.4, 2.6, 2.8);
  w.wall(4.4, 3.4, 4.4, 0.6, 2.6, 2.8);
  w.wall_with_pane(0, 6, 0, 0, 2.6, 0.6, 2.4, 0.8, 2.1);
  w.wall(6, 4, 0, 4, 0, 2.6);
  w.wall(3, 0, 3, 1.5, 0, 2.6); // the door y 1.5..2.5
  w.wall(3, 2.5, 3, 4, 0, 2.6);
  w.wall(3, 1.5, 3, 2.5, 2.05, 2.6);
  w.flat(0, 0, 6, 4, 5.2);
  w.wall(0, 0, 6, 0, 2.8, 5.2);
  w.wall_with_pane(0, 6, 4, 2.8, 5.2, 1.5, 4.5, 3.6, 4.9);
  for (const double x : {0.0, 6.0})
    w.wall(x, 0, x, 4, 0, 5.2);
  return w.text();
}

std::vector<glm::dvec3> lattice(const std::vector<double>& x, const std::vector<double>& y,
                                const std::vector<double>& z) {
  std::vector<glm::dvec3> points;
  for (const double px : x)
    for (const double py : y)
      for (const double pz : z)
        points.emplace_back(px, py, pz);
  return points;
}

} // namespace

Result<std::vector<BenchRoom>> bench_rooms() {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("daylit-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::array<std::array<std::string, 2>, 6> files = {{{"cornell.obj", sample_room_obj("cornell.mtl")},
                                                            {"cornell.mtl", sample_room_mtl()},
                                                            {"office.obj", office()},
                                                            {"l_shape.obj", l_shape()},
                                                            {"storeys.obj", storeys()},
                                                            {"rooms.mtl", kMaterials}}};
  for (const auto& [name, text] : files)
    if (const auto written = write_file_atomically(folder / name, text); !written)
      return written.error();
  std::vector<BenchRoom> rooms;
  const std::array<std::pair<const char*, std::vector<glm::dvec3>>, 4> cases = {
      {{"cornell", lattice({0.4, 1.4, 2.4}, {0.4, 2.4}, {0.35, 1.9, 2.4})},
       {"office", lattice({1.6, 3.0, 5.7}, {0.9, 2.0, 2.9}, {0.4, 1.2, 2.2})},
       {"l_shape", lattice({0.5, 1.5, 2.5}, {0.5, 1.8, 3.6, 5.4}, {0.5, 1.6})},
       {"storeys", lattice({0.6, 2.4, 3.6, 5.0}, {0.5, 2.0, 3.5}, {0.5, 1.6, 3.6, 4.6})}}};
  for (const auto& [name, points] : cases) {
    auto file = read_room(folder / (std::string(name) + ".obj"));
    if (!file)
      return file.error();
    rooms.push_back({name, std::move(*file), points});
  }
  std::filesystem::remove_all(folder);
  return rooms;
}

} // namespace daylit::bench
