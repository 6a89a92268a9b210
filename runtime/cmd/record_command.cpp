#include "runtime/cmd/record_command.h"

#include <cstdio>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "capture/frames/aravis_source.h"
#include "capture/frames/recording.h"
#include "scene/core/command_line.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"
#include "scene/core/seconds.h"

namespace daylit {

namespace {

constexpr auto kWait = std::chrono::milliseconds(200);

struct Options {
  CameraSettings camera;
  std::string mosaic;
  std::filesystem::path folder;
  int frames = 0;
  double first_frame_s = 10;
  bool quiet = false, json = false;
};

nlohmann::ordered_json to_json(const SourceReport& r, std::uint64_t recorded) {
  return {{"recorded", recorded}, {"whole", r.whole},     {"superseded", r.superseded},
          {"damaged", r.damaged}, {"missing", r.missing}, {"connections", r.connections}};
}

void print_summary(const SourceReport& r, std::uint64_t recorded) {
  std::fprintf(stderr, "%llu frames recorded; %llu came too fast to be written, %llu damaged, %llu missing\n",
               static_cast<unsigned long long>(recorded), static_cast<unsigned long long>(r.superseded),
               static_cast<unsigned long long>(r.damaged), static_cast<unsigned long long>(r.missing));
}

Error no_frame(const Options& o, const SourceReport& report) {
  return {ErrorCode::device, report.trouble.empty() ? "no frame came" : report.trouble,
          o.camera.camera.empty() ? "camera" : o.camera.camera,
          "see which cameras answer with daylit-run cameras, and what they take with arv-tool-0.8 features"};
}

/// A camera that goes away later is waited for: it says so once.
Result<void> record_frames(const Options& o, FrameSource& source, RecordingWriter& writer) {
  const double start = wall_seconds();
  bool away = false;
  while (!interrupted() && (o.frames == 0 || writer.frames() < static_cast<std::uint64_t>(o.frames))) {
    const auto frame = source.next(kWait);
    if (!frame)
      return frame.error();
    const SourceReport report = source.report();
    if (away != (writer.frames() > 0 && !report.connected)) {
      away = !away;
      std::fprintf(stderr, "daylit-run record: %s\n", away ? report.trouble.c_str() : "the camera is back");
    }
    if (!*frame) {
      if (writer.frames() == 0 && wall_seconds() - start > o.first_frame_s)
        return no_frame(o, report);
      continue;
    }
    if (const auto written = writer.add(**frame); !written)
      return written;
  }
  // Without a number of frames Ctrl-C is the way to end.
  if (o.frames > 0 && writer.frames() < static_cast<std::uint64_t>(o.frames))
    return interrupted_error("frame " + std::to_string(writer.frames()));
  return {};
}

Result<void> run(Options o) {
  if (!o.mosaic.empty()) {
    const auto mosaic = mosaic_named(o.mosaic);
    if (!mosaic)
      return mosaic.error();
    o.camera.mosaic = *mosaic;
  }
  auto source = open_camera(o.camera);
  if (!source)
    return source.error();
  auto writer = RecordingWriter::create(o.folder);
  if (!writer)
    return writer.error();
  const auto recorded = record_frames(o, **source, *writer);
  const SourceReport report = (*source)->report();
  if (o.json)
    std::printf("%s\n", to_json(report, writer->frames()).dump().c_str());
  else if (!o.quiet && writer->frames() > 0)
    print_summary(report, writer->frames());
  return recorded;
}

void add_camera_options(CLI::App& app, CameraSettings& c, std::string& mosaic) {
  app.add_option("CAMERA", c.camera, "id or network address, as daylit-run cameras lists them")->required();
  app.add_option("--pixel-format", c.pixel_format,
                 "name in the camera: Mono16, BayerRG12, RGB8, ... (default: as it is)");
  app.add_option("--mosaic", mosaic, "what a camera that says Mono really sends: rggb, grbg, gbrg or bggr");
  app.add_option("--exposure-us", c.exposure_us, "microseconds")->check(positive_number());
  app.add_option("--gain", c.gain, "in the unit of the camera")->check(CLI::NonNegativeNumber);
  app.add_option("--frame-rate", c.frame_rate_hz, "frames per second")->check(positive_number());
  auto* width = app.add_option("--width", c.width_px, "pixels")->check(CLI::Range(1, 32768));
  auto* height = app.add_option("--height", c.height_px, "pixels")->check(CLI::Range(1, 32768));
  width->needs(height), height->needs(width);
  app.add_option("--packet-size", c.packet_bytes, "bytes of a network packet (default: as large as the network takes)")
      ->check(CLI::Range(0, 65535));
}

} // namespace

int cameras_command(int argc, char** argv) {
  bool json = false;
  CLI::App app{"Lists the cameras (GigE Vision, USB3 Vision) that answer: id and network address.",
               "daylit-run cameras"};
  app.add_flag("--json", json, "one JSON object per camera");
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt;
  return run_program("daylit-run cameras", json, [&]() -> Result<void> {
    const auto cameras = find_cameras();
    if (cameras.empty())
      std::fprintf(stderr,
                   "daylit-run cameras: none answers; look at power, cable, network and firewall (UDP port 3956)\n");
    for (const FoundCamera& found : cameras)
      if (json)
        std::printf("%s\n", nlohmann::ordered_json{{"id", found.id}, {"address", found.address}}.dump().c_str());
      else
        std::printf("%s %s\n", found.id.c_str(), found.address.c_str());
    return {};
  });
}

int record_command(int argc, char** argv) {
  Options o;
  CLI::App app{"Records the frames of a camera bit for bit: a folder of PGM or PPM pictures and frames.jsonl.\n"
               "Frames that the network damaged are counted and left out; a camera that goes away is waited for.",
               "daylit-run record"};
  add_camera_options(app, o.camera, o.mosaic);
  app.add_option("-o,--output", o.folder, "the folder, new or without a recording")->required();
  app.add_option("--frames", o.frames, "how many (default: until Ctrl-C)")->check(CLI::Range(1, 100000000));
  app.add_option("--first-frame", o.first_frame_s, "seconds that the first frame may take")
      ->check(positive_number())
      ->capture_default_str();
  app.add_flag("--quiet", o.quiet, "print errors only");
  app.add_flag("--json", o.json, "what became of the frames as one JSON object");
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  return run_program("daylit-run record", o.json, [&] { return run(o); });
}

} // namespace daylit
