// daylit-run: draws the virtual objects of a CONFIG.toml into its camera picture with the daylight of its sky image.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "runtime/cmd/doctor_command.h"
#include "runtime/cmd/live_command.h"
#include "runtime/cmd/pose_command.h"
#include "runtime/cmd/record_command.h"
#include "runtime/input/camera_pose.h"
#include "runtime/input/interior_input.h"
#include "runtime/live/live_status.h"
#include "runtime/live/replay.h"
#include "runtime/output/outputs.h"
#include "runtime/session/session.h"
#include "runtime/window/viewer.h"
#include "scene/config/config.h"
#include "scene/config/placement_text.h"
#include "scene/core/command_line.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"

namespace daylit {
namespace {

struct Options {
  std::string config, replay, record, share;
  int frames = 0, threads = 0;
  bool window = false, quiet = false, json = false, force = false;
  Backend backend = Backend::rays;
};

/// Where the objects are, in the words of the configuration.
nlohmann::ordered_json to_json(const std::vector<ObjectConfig>& objects) {
  auto list = nlohmann::ordered_json::array();
  const auto triple = [](const glm::dvec3& v) { return nlohmann::ordered_json{v.x, v.y, v.z}; };
  for (const ObjectConfig& o : objects) {
    nlohmann::ordered_json object{{"model", o.model.string()},
                                  {"position", triple(o.position)},
                                  {"rotation", triple(o.rotation_deg)},
                                  {"scale", o.scale}};
    if (o.on)
      object["on"] = o.on->surface.empty() ? "anything" : o.on->surface;
    list.push_back(std::move(object));
  }
  return list;
}

nlohmann::json to_json(const FrameReport& report, const std::vector<ObjectConfig>& objects, int frame) {
  nlohmann::ordered_json stages;
  for (const auto& [name, ms] : report.stage_ms)
    stages[name] = ms;
  stages["total"] = report.total_ms;
  return {{"frame", frame},
          {"objects", to_json(objects)},
          {"stage_ms", stages},
          {"sky_lights", report.sky_lights},
          {"sun_lights", report.sun_lights},
          {"object_pixels", report.object_pixels},
          {"shadow_pixels", report.shadow_pixels},
          {"thing_pixels", report.thing_pixels},
          {"vertices_lit", report.vertices_lit},
          {"shadow_rays", report.shadow_rays},
          {"glossy_pixels", report.glossy_pixels},
          {"glossy_rays", report.glossy_rays},
          {"reflection_maps", report.reflection_maps},
          {"reflection_map_texels", report.reflection_map_texels},
          {"reused",
           {{"sky", report.reused.sky},
            {"samples", report.reused.samples},
            {"probes", report.reused.probes},
            {"object_light", report.reused.object_light},
            {"drawn", report.reused.drawn},
            {"picture", report.reused.picture}}},
          {"ringing", {{"vertices", report.ringing.vertices}, {"added_fraction", report.ringing.added_fraction}}},
          {"indirect_shadow_left_out", report.indirect_shadow_left_out},
          {"skipped", report.skipped},
          {"warnings", report.warnings}};
}

void print_report(const FrameReport& report, int frame) {
  std::printf("frame %d:", frame);
  for (const auto& [name, ms] : report.stage_ms)
    std::printf(" %s %.1f", name.c_str(), ms);
  std::printf(" | total %.1f ms; %zu + %zu lights, %zu object and %zu shadow pixels\n", report.total_ms,
              report.sky_lights, report.sun_lights, report.object_pixels, report.shadow_pixels);
}

/// The configuration with what only the picture says: the camera's pose, and the scale of its values.
Result<RunConfig> resolve(const RunConfig& given, const InteriorInput& input, const SkyImage& sky) {
  RunConfig config = given;
  config.world_from_camera = input.world_from_camera;
  if (!config.interior.scale_from_marker)
    return config;
  const auto scale = scale_from_marker(config, input, sky);
  if (!scale)
    return scale.error();
  config.interior.scale = scale->scale;
  config.interior.colour_matrix = scale->colour_matrix;
  const glm::dmat3& m = scale->colour_matrix;
  std::fprintf(
      stderr,
      "daylit-run: from the marker's paper: scale = %.5g, colour_matrix = [[%.4g, %.4g, %.4g], [%.4g, %.4g, %.4g], "
      "[%.4g, %.4g, %.4g]]; photograph = scale x colour_matrix x radiance\n",
      scale->scale, m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]);
  return config;
}

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes)
    std::fprintf(stderr, "daylit-run: %s\n", note.c_str());
}

/// The files are one picture: the same frame again and again.
Result<Composite> draw_frames(const Options& options, Session session, const SkyImage& sky, const PhotoPixels& photo,
                              const DepthPicture* depth) {
  for (int k = 0; k < std::max(1, options.frames); ++k) {
    const auto frame = render_again_once(session, {sky, photo, 1, 1, depth});
    if (!frame)
      return frame.error();
    if (interrupted())
      return interrupted_error("frame " + std::to_string(k));
    const FrameReport& report = (*frame)->report;
    if (k == 0)
      print_notes(report.warnings);
    if (options.json)
      std::printf("%s\n", to_json(report, session.placements(), k).dump().c_str());
    else if (!options.quiet)
      print_report(report, k);
  }
  return std::move(session).take_composite();
}

/// The window stays open whatever becomes of the file.
void save_placements(const std::filesystem::path& config, const Session& session) {
  print_notes(session.standing_warnings());
  const auto written = write_placements(config, session.placements());
  print_notes({written ? config.string() + ": the objects' places are written" : written.error().message()});
}

void print_drawn(const DrawnFrame& f, const Options& options) {
  if (options.json)
    std::printf("%s\n", to_json(f).c_str());
  else if (!options.quiet)
    std::printf("frame %zu: sky %.3f s old, pose %s%s, %.1f ms\n", f.index, f.sky_age_s, name_of(f.tracking),
                f.drawn ? "" : " (the photograph is left as it is)", f.total_ms);
}

/// A daemon says a line per picture only where it was told to draw so many.
void print_live(const DrawnFrame& frame, const Options& options) {
  if (options.json || options.frames > 0)
    print_drawn(frame, options);
}

Result<void> run(const Options& options) {
  set_thread_count(options.threads);
  if (options.threads > 0)
    setenv("LP_NUM_THREADS", std::to_string(options.threads).c_str(), 1); // software OpenGL counts its own threads
  const auto given = read_run_config(options.config);
  if (!given)
    return given.error();
  std::optional<PromptExit> at_interrupt; // cameras and recordings are closed in order
  if (!given->is_live() || !options.replay.empty()) {
    watch_for_reload(false);
    at_interrupt.emplace();
  }
  if (!options.replay.empty() && !options.record.empty())
    return Error{ErrorCode::usage, "--record is for cameras, --replay draws what was recorded", options.config,
                 "give one of them"};
  if (!options.replay.empty())
    return replay_recording(*given, {options.replay, options.frames, options.backend},
                            [&](const DrawnFrame& frame) { print_drawn(frame, options); });
  if ((!options.record.empty() || !options.share.empty()) && !given->is_live())
    return Error{ErrorCode::usage, "--record and --share are for cameras", options.config,
                 "set [sky] camera and [interior] camera"};
  if (given->is_live())
    return run_live(*given,
                    {options.config, options.record, options.frames, options.backend, options.window, options.share,
                     options.quiet, options.force},
                    [&](const DrawnFrame& frame) { print_live(frame, options); });
  const auto input = read_interior(*given);
  if (!input)
    return input.error();
  const PhotoPixels photo = input->photo.pixels();
  const DepthPicture* depth = input->depth ? &*input->depth : nullptr;
  if (const auto fits = check_output_size(given->output, photo.width(), photo.height()); !fits)
    return fits;
  std::vector<std::string> sky_notes;
  auto sky = read_sky(given->sky, &sky_notes);
  if (!sky)
    return sky.error();
  const auto config = resolve(*given, *input, *sky);
  if (!config)
    return config.error();
  ProgressLine progress(options.quiet || options.json);
  auto session = Session::open(*config, photo.width(), photo.height(), progress.callback(), options.backend);
  if (!session)
    return session.error();
  progress.clear();
  if (const auto writable = check_outputs(config->output, options.force); !writable)
    return writable;
  print_notes(sky_notes);
  print_notes(input->notes);
  print_notes(session->notes());
  if (!options.window) {
    const auto composite = draw_frames(options, std::move(*session), *sky, photo, depth);
    return composite ? write_outputs(config->output, input->photo, *composite) : composite.error();
  }
  const auto view = [&](const RgbImage& picture) { return view_of(input->photo, picture); };
  const auto save = [&] { save_placements(options.config, *session); };
  return run_viewer(*session, *sky, {photo, depth}, view, save, options.frames > 1 ? options.frames : 0);
}

} // namespace
} // namespace daylit

/// Options of a run; the sub-commands have their own.
int main(int argc, char** argv) {
  daylit::watch_for_interrupt(); // first: an interrupt may come at once
  const std::map<std::string_view, int (*)(int, char**)> commands{{"cameras", daylit::cameras_command},
                                                                  {"doctor", daylit::doctor_command},
                                                                  {"pose", daylit::pose_command},
                                                                  {"record", daylit::record_command}};
  if (argc > 1)
    if (const auto command = commands.find(argv[1]); command != commands.end())
      return command->second(argc - 1, argv + 1);
  daylit::watch_for_reload(); // now: it may come to a service that has just been started
  daylit::Options options;
  CLI::App app{
      "Draws virtual objects into a camera picture of a real room, lit by the daylight outside.\n"
      "Also: daylit-run pose IMAGE, where the markers of a picture are; daylit-run cameras, which cameras\n"
      "answer; daylit-run record CAMERA, a sequence of a camera's frames; daylit-run doctor CONFIG, what is wrong\n"
      "on this machine and what to change. Each has its own --help."};
  app.add_option("config", options.config, "CONFIG.toml: sky, camera, room, objects, output")->required();
  app.add_option(
         "--replay", options.replay,
         "folder with the recordings sky and interior (daylit-run record): drawn frame by frame in the place of\n"
         "the configuration's pictures, the outputs numbered")
      ->check(CLI::ExistingDirectory);
  app.add_option("--record", options.record, "with cameras: folder for recordings of both, for --replay");
  app.add_option("--share", options.share,
                 "with cameras: the newest picture in shared memory of that name (/dev/shm/NAME)");
  app.add_option("--frames", options.frames,
                 "how often the frame is drawn (default: once); with --replay: the first so many (default: all);\n"
                 "with cameras: so many, written to [output] and numbered (default: none is written, and no end)")
      ->check(CLI::Range(1, 1000000));
  const std::vector<std::pair<std::string, daylit::Backend>> backends{{"rays", daylit::Backend::rays},
                                                                      {"gl", daylit::Backend::opengl},
                                                                      {"osmesa", daylit::Backend::osmesa},
                                                                      {"window", daylit::Backend::window}};
  app.add_flag(
      "--window", options.window,
      "show it (with cameras: the live picture; close it to end): drag objects or turn the camera with the mouse; 1, "
      "2, 3: direct, indirect, differential light; "
      "g: frame times; r: the photograph's view; s: write the objects' places to the configuration; Escape: end");
  app.add_option(
         "--renderer", options.backend,
         "rays (on the processor), gl (OpenGL), osmesa (OpenGL without a driver) or window (a desktop's OpenGL)")
      ->transform(daylit::one_of(backends));
  daylit::add_threads_option(app, options.threads);
  daylit::add_force_option(app, options.force);
  app.add_flag("--quiet", options.quiet, "print errors only");
  app.add_flag("--json", options.json, "one JSON object per frame on stdout");
  app.set_version_flag("--version", std::string("daylit-run ") + DAYLIT_VERSION);
  if (const auto code = daylit::parse_command_line(app, argc, argv))
    return *code;
  return daylit::run_program("daylit-run", options.json, [&] { return daylit::run(options); });
}
