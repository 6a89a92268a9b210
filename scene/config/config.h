#pragma once

// CONFIG.toml (daylit-run) and SCENE.toml (daylit-simulate): one plain struct each, parsed once, validated as a
// whole; unknown keys are errors with line and suggestion. All problems of a file are reported together. Relative
// paths are relative to the file. Matrices are row-major in the file, flat or one array per row.
//
//   [sky]      image, projection = "equirect" | "angular" | "fisheye", lens, rotation (degrees, counter-clockwise),
//              ground = "none" | { albedo = 0.2 } (fisheye only: what the lens does not see),
//              fall_off = file of daylit-calibrate vignette (fisheye only): divided out of the picture
//              camera in the place of image: its id or network address; beside it pixel_format, mosaic, exposure_us,
//              gain, frame_rate (Hz), packet_size (bytes), size = [width, height] (default: the lens file's)
//              with a camera also response as in [interior]; exposures_us = [10, 640, 40960], cycled and merged, in
//              the place of exposure_us; white = radiance of the largest code value, exposed for a millisecond
//              (default 1); illuminance = number | file with one, horizontal, of the whole sky in the unit of white
//              times sr; place = { latitude, longitude } (degrees, east positive; +x is east): see docs/live.md
//   [interior] image, or camera as in [sky] (both sections have a camera, or neither); lens, response = "linear" |
//   "srgb" | file, scale = number | "marker", colour_matrix,
//              blur_px, noise = relative deviation | { floor, photon, relative };
//              depth = a depth picture of the same view (scene/image/depth_picture.h), with depth_unit_m = 0.001 (of a
//              PNG) and depth_noise_m = 0.002 (deviation 1 m away; it grows with the square of depth)
//   [marker]   dictionary, ids, size_m, white_reflectance, world_from_board; for a board of several markers of one size
//              columns and gap_m: ids row by row from the top left, the board's origin in its middle
//   [pose]     world_from_camera, or position and look_at; beside it [marker] only serves scale = "marker"
//   [room]     volume; model (optional): the volume must have been baked from it; glossy (optional): real materials
//              that mirror, { NAME = reflectance face on }
//   [[object]] model, position, rotation (degrees about x, then y, then z), scale, reflectance, material = a name of
//              scene/material/library.h in the place of the model's own materials;
//              on = material of the room, with position = [x, y], or alone: in the middle of it; or on = [x, y]:
//              set down on the surface below (scene/placing/set_down.h)
//   [light]    samples, indirect_shadow = true | false, reflect_by = "rays" | "maps"
//   [output]   png, exr, mask; size = [width, height], pixels: what is written is resampled to it by area, in linear
//              light; of the picture's own shape, at most four times as wide; left out: as [interior] image
//   [http]     port, address = "127.0.0.1", token_file: the live pictures over HTTP; needed for any address but
//   loopback
// SCENE.toml has no [interior] image and no volume; it adds
//   [sky]      the sky in words (scene/sky/sky_description.h), or a picture as above
//   [fisheye]  size, fov (degrees); or lens [interior] fov (degrees, horizontal); or lens, which also gives the size
//   [simulate] samples, sensor_noise, marker_board
//   [path]     camera = [[x, y, z, target x, y, z], ...], sun = [[azimuth, elevation], ...] (degrees): what moves while
//              a sequence is recorded, keys at equal steps of time from its first frame to its last

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/depth_picture.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_image.h"
#include "scene/sky/sky_model.h"

namespace daylit {

/// camera = "..." and the settings beside it; what is not given stays as the camera has it.
struct CameraConfig {
  std::string camera;       ///< id or network address
  std::string pixel_format; ///< name in the camera, "Mono16", "BayerRG8", "RGB8"
  std::string mosaic;       ///< "rggb", "grbg", "gbrg" or "bggr" where the camera says mono; else empty
  std::optional<double> exposure_us, gain, frame_rate_hz;
  int packet_bytes = 0;            ///< 0: as large as the network takes
  int width_px = 0, height_px = 0; ///< 0: the lens file's
};

/// +x of the room is east, +y north.
struct SkyPlace {
  double latitude_deg = 0.0, longitude_deg = 0.0; ///< north and east positive
};

struct SkyConfig {             // [sky]
  std::filesystem::path image; ///< EXR or .hdr; empty where there is a camera
  std::optional<CameraConfig> camera;
  std::string projection = "equirect";
  std::filesystem::path lens;               ///< for projection = "fisheye"
  std::filesystem::path fall_off{};         ///< of that lens (scene/lens/fall_off.h); empty: the picture has none
  double rotation = 0.0;                    ///< radians in the struct, degrees in the file
  GroundFill ground;                        ///< ground = { albedo = 0.2 }
  std::vector<int> exposures_us{};          ///< of a bracket that the camera cycles through; empty: none
  std::string response = "linear";          ///< of the camera: "linear", "srgb", or a response file
  double white = 1.0;                       ///< radiance of the largest code value, exposed for a millisecond
  std::optional<SkyPlace> place{};          ///< says where a sun beyond the camera's range stands
  std::optional<double> illuminance{};      ///< horizontal, unit of white x sr: says how bright it is
  std::filesystem::path illuminance_file{}; ///< holds the number instead; written again and again
};

/// Noise of one photograph pixel of linear value v (EMVA 1288, with the gain's own part): its deviation is the root
/// of floor^2 + photon v + (relative v)^2.
struct CameraNoise {
  double floor = 0.0;    ///< deviation of black
  double photon = 0.0;   ///< variance per value
  double relative = 0.0; ///< deviation per value
  bool any() const { return floor > 0.0 || photon > 0.0 || relative > 0.0; }
  double variance(double v) const { return floor * floor + photon * std::max(v, 0.0) + relative * relative * v * v; }
};

struct InteriorConfig {        // [interior]
  std::filesystem::path image; ///< linear EXR, or an LDR photograph (PNG, JPEG); empty where there is a camera
  std::optional<CameraConfig> camera;
  std::filesystem::path lens;      ///< camera YAML
  std::string response = "linear"; ///< "linear", "srgb", or a response file
  double scale = 1.0;              ///< photograph = scale * colour_matrix * radiance
  bool scale_from_marker = false;  ///< scale = "marker"
  glm::dmat3 colour_matrix{1.0};
  double blur_px = 0.0;        ///< standard deviation of the camera's point spread; what is drawn is blurred alike
  CameraNoise noise;           ///< of the linear photograph; what is drawn gets it too
  std::filesystem::path depth; ///< of the same view, as large or a whole fraction; empty: none
  double depth_unit_m = kDepthUnit_m; ///< of a number in a PNG
  double depth_noise_m = 0.002;       ///< deviation of a depth 1 m away; z metres away z^2 times as large
};

struct MarkerConfig { // [marker]
  std::string dictionary = "6X6_250";
  std::vector<int> ids;
  int columns = 0;                   ///< of a board of several markers; 0: not given
  double size_m = 0.05, gap_m = 0.0; ///< side of a marker; between neighbours
  double white_reflectance = 0.8;    ///< of the paper around the marker, for scale = "marker"
  glm::dmat4 world_from_board{1.0};  ///< board: x right, y up, z out of the board
};

/// [[object]] on: the height of the object follows from what it stands on.
struct StandsOn {
  std::string surface;   ///< material of the room; empty: whatever is below
  bool has_place = true; ///< false: in the middle of the surface, x and y of the position are not given
};

struct ObjectConfig { // [[object]]
  std::filesystem::path model;
  glm::dvec3 position{0.0};     ///< metres, world, of the object's origin
  glm::dvec3 rotation_deg{0.0}; ///< about x, then y, then z
  double scale = 1.0;
  std::optional<Rgb> reflectance; ///< overrides the model's; with a material, its base colour
  std::string material;           ///< of the library; empty: the model's own
  std::optional<StandsOn> on;
};

struct OutputConfig { // [output]
  std::filesystem::path png, exr;
  std::filesystem::path mask;      ///< EXR, 1 where the object is drawn
  int width_px = 0, height_px = 0; ///< size = [w, h], pixels of what is written; 0: the interior image's
};

/// How what objects mirror is found.
enum class ReflectBy {
  rays, ///< rays for every pixel
  maps, ///< a map around each object, and one look-up in it for each lobe of a pixel; glass by rays
};

struct HttpConfig { // [http]
  int port = 8080;
  std::string address = "127.0.0.1";
  std::filesystem::path token_file; ///< empty: none is needed, the address is loopback
};

struct RunConfig {
  SkyConfig sky;
  InteriorConfig interior;
  std::optional<MarkerConfig> marker;
  std::optional<glm::dmat4> world_from_camera; ///< [pose] (else [marker] is there): camera x right, y down, z forward
  std::filesystem::path room_model, volume;    ///< [room]
  /// [room] glossy = { MATERIAL = 0.1, ... }: real surfaces that mirror, with the part of light that they mirror seen
  /// face on.
  std::map<std::string, double> glossy_room;
  std::vector<ObjectConfig> objects;
  int light_samples = 64;      ///< [light] samples
  bool indirect_shadow = true; ///< [light] indirect_shadow: the objects' effect on the room's indirect light is drawn
  ReflectBy reflect_by = ReflectBy::rays; ///< [light] reflect_by
  OutputConfig output;
  std::optional<HttpConfig> http;
  bool is_live() const { return interior.camera.has_value(); } ///< frames come from cameras, not from files
};

/// Where the camera is and what it looks at, world metres.
struct CameraKey {
  glm::dvec3 position{0.0}, target{0.0};
};

/// What daylit-simulate adds to the same scene.
struct SimulateConfig {
  RunConfig run;                      ///< object, room and output as above, and the sky where it is a picture
  SkyModel sky_model;                 ///< [sky] in words
  std::vector<std::string> sky_notes; ///< what reading the sky had to say: weather row, limits
  int fisheye_width_px = 512, fisheye_height_px = 496;
  double fisheye_fov = 3.3161255787892263; ///< 190 degrees
  double interior_fov = 0.9;               ///< horizontal, radians
  bool marker_board = true;                ///< a printed board stands in the scene
  double sensor_noise = 0.0;               ///< relative standard deviation per pixel
  int samples_per_pixel = 64;
  std::vector<CameraKey> camera_path; ///< [path] camera; empty: it stands at [pose]
  std::vector<glm::dvec3> sun_path;   ///< [path] sun, unit directions; empty: it stands
  bool has_sky_picture() const { return !run.sky.image.empty(); }
  bool moves() const { return !camera_path.empty() || !sun_path.empty(); }
};

/// The scene at time t of its path, 0 (first frame) to 1 (last): camera and sun between their keys, linearly.
SimulateConfig at_time(const SimulateConfig& config, double t);

/// Error: missing, not TOML, or every unknown key, wrong type, value out of range and missing part, each with its line.
/// That a named file exists is checked by whoever reads it.
Result<RunConfig> read_run_config(const std::filesystem::path& path);
/// For measuring colours of surfaces in a picture: the sky, the picture, its pose and [room] model. [room] volume and
/// [[object]] may be missing; cameras are an error, and so is a missing model.
Result<RunConfig> read_view_config(const std::filesystem::path& path);
Result<SimulateConfig> read_simulate_config(const std::filesystem::path& path);
/// The file that daylit-run reads, as text; paths as they are in the struct. Reading it back gives the same struct
/// (angles to 1e-15).
std::string to_toml(const RunConfig& config);
std::string to_toml(const SimulateConfig& config);

/// The picture that [sky] names. Error: it cannot be read, or is no sky of that projection. `notes`: as in sky_image.h.
Result<SkyImage> read_sky(const SkyConfig& sky, std::vector<std::string>* notes = nullptr);

/// Camera pose (x right, y down, z forward) at `position` with the optical axis through `target`, image upright.
/// The view must not be vertical.
glm::dmat4 look_at(const glm::dvec3& position, const glm::dvec3& target);

/// world_from_object of an [[object]] entry.
glm::dmat4 object_transform(const ObjectConfig& object);

} // namespace daylit
