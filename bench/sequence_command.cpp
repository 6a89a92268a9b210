// daylit-bench sequence: the demo's scenes as sequences, camera and sun moving, drawn by one session and compared with
// the path-traced truth of every frame. The truth is traced at full size but only at some pixels, spread evenly and
// shifted from frame to frame: the RMS over them estimates that over all.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/frame_scene.h"
#include "precompute/bake.h"
#include "runtime/session/session.h"
#include "scene/room/room_formats.h"
#include "scene/volume/volume_file.h"
#include "simulate/build_scene.h"
#include "simulate/picture.h"
#include "simulate/picture_error.h"
#include "simulate/sample_scene.h"

namespace daylit::bench {

namespace {

struct Arguments {
  std::string folder = "out/bench-sequence";
  std::vector<std::string> scenes{"overcast", "sun", "shade"};
  std::vector<int> size{512, 496};
  int frames = 60, stride = 8, samples = 0;
  std::vector<int> only; // of the frames; empty: all
  std::string pixels;    // file
  std::string renderer = "rays", regions = "fine:16384";
  bool indirect_shadow = true;
};

/// Paths per pixel that keep the truth's own error on the object below a quarter of what is allowed there: 1 % under
/// the overcast sky, 2 % with a sun.
int truth_samples(const std::string& scene) { return scene == "overcast" ? 1024 : scene == "sun" ? 128 : 2048; }

/// Sums over pixels and channels.
struct ErrorSum {
  double square = 0, bias = 0, level = 0, unchanged = 0, own = 0;
  std::size_t pixels = 0;

  void add(const Rgb& result, const Rgb& photo, const PixelEstimate& e) {
    for (int c = 0; c < 3; ++c) {
      const double truth = static_cast<double>(e.truth[c]), d = static_cast<double>(result[c]) - truth;
      square += d * d;
      bias += d;
      level += truth;
      unchanged += std::pow(static_cast<double>(photo[c]) - truth, 2.0);
      own += std::pow(static_cast<double>(e.standard_error[c]), 2.0);
    }
    ++pixels;
  }
  void add(const ErrorSum& o) {
    square += o.square, bias += o.bias, level += o.level, unchanged += o.unchanged, own += o.own, pixels += o.pixels;
  }
  double relative(double sum) const {
    const double n = 3.0 * static_cast<double>(std::max<std::size_t>(pixels, 1));
    return level > 0.0 ? std::sqrt(sum / n) / (level / n) : 0.0;
  }
  nlohmann::ordered_json json() const {
    return {{"pixels", pixels},
            {"relative_rms", relative(square)},
            {"bias", level > 0.0 ? bias / level : 0.0},
            {"no_object_rms", relative(unchanged)},
            {"truth_standard_error", relative(own)}};
  }
};

struct FrameError {
  ErrorSum object, shadow;
  std::size_t both = 0, either = 0; ///< pixels of the masks
  double draw_ms = 0;
};

/// Every `stride`-th pixel both ways, another set in each frame.
std::vector<glm::ivec2> sampled_pixels(int width, int height, int stride, int frame) {
  std::vector<glm::ivec2> pixels;
  const int shift = frame * 5 % (stride * stride);
  for (int y = shift / stride; y < height; y += stride)
    for (int x = shift % stride; x < width; x += stride)
      pixels.emplace_back(x, y);
  return pixels;
}

/// 1: all pixels of the square around it are covered, 0: none is, else 0.5.
float covered_around(const Composite& c, int x, int y, int radius) {
  bool all = true, none = true;
  for (int v = std::max(y - radius, 0); v <= std::min(y + radius, c.picture.height - 1); ++v)
    for (int u = std::max(x - radius, 0); u <= std::min(x + radius, c.picture.width - 1); ++u) {
      const bool covered = c.coverage[static_cast<std::size_t>(v) * c.picture.width + u] >= 0.5f;
      all = all && covered;
      none = none && !covered;
    }
  return all ? 1.0f : none ? 0.0f : 0.5f;
}

/// Every pixel that counts, one per line.
class PixelTable {
public:
  explicit PixelTable(const std::string& path) : file_(path.empty() ? nullptr : std::fopen(path.c_str(), "w")) {
    if (file_)
      std::fprintf(file_.get(), "scene frame x y object  truth result photo standard_error (r g b each)\n");
  }
  void start_frame(const std::string& scene, int frame) { scene_ = scene, frame_ = frame; }
  void add(glm::ivec2 pixel, bool object, const Rgb& result, const Rgb& photo, const PixelEstimate& e) const {
    if (!file_)
      return;
    std::fprintf(file_.get(), "%s %d %d %d %d", scene_.c_str(), frame_, pixel.x, pixel.y, object ? 1 : 0);
    for (const Rgb& v : {e.truth, result, photo, e.standard_error})
      std::fprintf(file_.get(), " %.5g %.5g %.5g", static_cast<double>(v.r), static_cast<double>(v.g),
                   static_cast<double>(v.b));
    std::fputc('\n', file_.get());
  }

private:
  std::unique_ptr<std::FILE, decltype([](std::FILE* f) { std::fclose(f); })> file_;
  std::string scene_;
  int frame_ = 0;
};

FrameError measure(const Composite& c, const RgbImage& photo, std::span<const glm::ivec2> pixels,
                   std::span<const PixelEstimate> truth, const PixelTable& table) {
  FrameError error;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto [x, y] = std::pair(pixels[i].x, pixels[i].y);
    const PixelEstimate& e = truth[i];
    const bool there = e.coverage >= 0.5f, here = covered_around(c, x, y, 0) == 1.0f;
    error.both += there && here;
    error.either += there || here;
    const float change = std::abs(luminance(e.truth) - luminance(e.room));
    const bool object = there && covered_around(c, x, y, kMaskErosion) == 1.0f;
    const bool shadow = e.coverage == 0.0f && covered_around(c, x, y, kMaskDilation) == 0.0f &&
                        change > kShadowChange * luminance(e.room);
    if (!object && !shadow)
      continue;
    (object ? error.object : error.shadow).add(c.picture.at(x, y), photo.at(x, y), e);
    table.add(pixels[i], object, c.picture.at(x, y), photo.at(x, y), e);
  }
  return error;
}

struct Sequence {
  SimulateConfig scene;
  RunConfig run;
  LensModel lens, sky_lens;
  std::shared_ptr<const SkyGeometry> sky_geometry;
};

Result<void> bake_room(const std::filesystem::path& room, const std::filesystem::path& volume,
                       const std::string& regions, const Progress& progress) {
  if (std::filesystem::exists(volume))
    return {};
  const auto file = read_room(room);
  if (!file)
    return file.error();
  const auto partition = SkyPartition::parse(regions);
  if (!partition)
    return partition.error();
  precompute::BakeReport report;
  const auto baked = precompute::bake(*file, *partition, {}, progress, report);
  return baked ? write_volume(volume, *baked) : Result<void>(baked.error());
}

Result<Sequence> make_sequence(const Arguments& a, const std::string& name, const Progress& progress) {
  const std::filesystem::path folder = std::filesystem::path(a.folder) / name;
  std::error_code ec;
  std::filesystem::create_directories(folder, ec);
  const auto file = write_sample_scene(name, folder, a.size[0], a.size[1]);
  if (!file)
    return file.error();
  const auto scene = read_simulate_config(*file);
  if (!scene)
    return scene.error();
  Sequence s;
  s.scene = *scene;
  s.lens = ideal_pinhole(a.size[0], a.size[1], scene->interior_fov);
  s.sky_lens = ideal_fisheye(scene->fisheye_width_px, scene->fisheye_height_px, scene->fisheye_fov);
  const auto geometry =
      SkyGeometry::make(s.sky_lens.width_px, s.sky_lens.height_px, FisheyeProjection{s.sky_lens, 0.0});
  if (!geometry)
    return geometry.error();
  s.sky_geometry = *geometry;
  std::string tag = a.regions;
  std::replace(tag.begin(), tag.end(), ':', '-');
  s.run = scene->run;
  s.run.indirect_shadow = a.indirect_shadow;
  s.run.world_from_camera = at_time(*scene, 0.0).run.world_from_camera;
  s.run.volume = std::filesystem::path(a.folder) / ("room-" + tag + ".volume");
  s.run.interior.lens = folder / "interior.yaml";
  if (const auto written = write_lens(s.run.interior.lens, s.lens); !written)
    return written.error();
  if (const auto baked = bake_room(scene->run.room_model, s.run.volume, a.regions, progress); !baked)
    return baked.error();
  return s;
}

Result<FrameError> one_frame(const Arguments& a, const Sequence& s, const std::string& name, int k, Session& session,
                             const PixelTable& table) {
  const SimulateConfig moment = at_time(s.scene, a.frames > 1 ? static_cast<double>(k) / (a.frames - 1) : 0.5);
  const auto scene = build_scene(moment);
  if (!scene)
    return scene.error();
  const std::vector<glm::ivec2> pixels = sampled_pixels(a.size[0], a.size[1], a.stride, k);
  const PictureSettings settings{a.samples > 0 ? a.samples : truth_samples(name), 32, static_cast<std::uint32_t>(k)};
  const auto truth = render_pixels(*scene, s.lens, *moment.run.world_from_camera, pixels, settings);
  if (!truth)
    return truth.error();
  RgbImage photo(a.size[0], a.size[1], Rgb(1.0f)); // no pixel looks at its neighbours
  for (std::size_t i = 0; i < pixels.size(); ++i)
    photo.at(pixels[i].x, pixels[i].y) = (*truth)[i].room;
  auto image = render_sky_frame(AnalyticSky(moment.sky_model), s.sky_lens);
  if (!image)
    return image.error();
  const float albedo = std::max(0.0f, moment.sky_model.ground_albedo);
  const auto sky = SkyImage::make(std::move(*image), s.sky_geometry, {GroundFill::Kind::albedo, albedo});
  if (!sky)
    return sky.error();
  if (const auto moved = session.set_pose(*moment.run.world_from_camera); !moved)
    return moved.error();
  const auto frame = session.render({*sky, photo});
  if (!frame)
    return frame.error();
  FrameError error = measure((*frame)->composite, photo, pixels, *truth, table);
  error.draw_ms = (*frame)->report.total_ms;
  return error;
}

Result<nlohmann::ordered_json> one_scene(const Arguments& a, const std::string& name, const Progress& progress,
                                         PixelTable& table, bool print) {
  const auto s = make_sequence(a, name, progress);
  if (!s)
    return s.error();
  auto session =
      Session::open(s->run, a.size[0], a.size[1], progress, a.renderer == "gl" ? Backend::opengl : Backend::rays);
  if (!session)
    return session.error();
  FrameError all;
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  for (int k = 0; k < a.frames; ++k) {
    if (!a.only.empty() && std::find(a.only.begin(), a.only.end(), k) == a.only.end())
      continue;
    table.start_frame(name, k);
    if (!progress(name, static_cast<double>(k) / a.frames))
      return interrupted_error(name);
    const auto e = one_frame(a, *s, name, k, *session, table);
    if (!e)
      return e.error();
    all.object.add(e->object);
    all.shadow.add(e->shadow);
    all.both += e->both;
    all.either += e->either;
    all.draw_ms += e->draw_ms / a.frames;
    frames.push_back({{"object", e->object.relative(e->object.square)},
                      {"shadow", e->shadow.relative(e->shadow.square)},
                      {"draw_ms", e->draw_ms}});
    if (print)
      std::printf("%-9s frame %3d   object %5.2f %%   shadow %5.2f %%\n", name.c_str(), k,
                  100.0 * e->object.relative(e->object.square), 100.0 * e->shadow.relative(e->shadow.square));
  }
  const double iou = static_cast<double>(all.both) / static_cast<double>(std::max<std::size_t>(all.either, 1));
  if (print)
    for (const auto& [what, sum] : {std::pair{"object", all.object}, {"shadow", all.shadow}})
      std::printf("%-9s %s %7zu pixels, rms %5.2f %%, bias %+5.2f %%, unchanged %5.1f %%, truth's own error %4.2f %%\n",
                  name.c_str(), what, sum.pixels, 100.0 * sum.relative(sum.square), 100.0 * sum.bias / sum.level,
                  100.0 * sum.relative(sum.unchanged), 100.0 * sum.relative(sum.own));
  return nlohmann::ordered_json{{"scene", name},   {"object", all.object.json()}, {"shadow", all.shadow.json()},
                                {"mask_iou", iou}, {"draw_ms", all.draw_ms},      {"frames", frames}};
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::ordered_json document{{"machine", machine()},
                                  {"size", a.size},
                                  {"stride", a.stride},
                                  {"renderer", a.renderer},
                                  {"regions", a.regions},
                                  {"indirect_shadow", a.indirect_shadow},
                                  {"scenes", nlohmann::json::array()}};
  PixelTable table(a.pixels);
  for (const std::string& name : a.scenes) {
    ProgressLine line(options.quiet || options.json);
    const auto scene = one_scene(a, name, line.callback(), table, !options.json);
    line.clear();
    if (!scene)
      return scene.error();
    document["scenes"].push_back(*scene);
  }
  return deliver(document, options);
}

} // namespace

Command add_sequence(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand(
      "sequence", "picture error of moving sequences against path-traced truth, at evenly spread pixels");
  parser->add_option("--folder", a->folder, "working files: rooms, volumes");
  parser->add_option("--scenes", a->scenes, "overcast, sun, shade")->delimiter(',');
  parser->add_option("--size", a->size, "picture size")->delimiter(',')->expected(2);
  parser->add_option("--frames", a->frames)->check(CLI::Range(1, 10000));
  parser->add_option("--stride", a->stride, "one pixel in stride x stride is traced")->check(CLI::Range(1, 64));
  parser->add_option("--spp", a->samples,
                     "paths per pixel of the truth (default: enough for a quarter of the allowed error)");
  parser->add_option("--only", a->only, "of the frames, these")->delimiter(',');
  parser->add_option("--pixels", a->pixels, "file to write every measured pixel to");
  parser->add_option("--renderer", a->renderer, "rays or gl")->check(CLI::IsMember({"rays", "gl"}));
  parser->add_flag("!--no-indirect-shadow", a->indirect_shadow,
                   "leave out what the object does to the room's indirect light");
  parser->add_option("--regions", a->regions, "of the volume, as for daylit-precompute");
  return {parser, [a](const CommonOptions& options) { return run(*a, options); }};
}

} // namespace daylit::bench
