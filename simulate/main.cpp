// daylit-simulate: rooms, skies and cameras with known truth.

#include "scene/core/command_line.h"
#include "scene/core/prompt_exit.h"
#include "simulate/commands.h"
#include "simulate/photograph_command.h"
#include "simulate/simulate_command.h"

namespace {

using namespace daylit;

void add_sky_options(CLI::App& command, SkyArguments& sky) {
  command
      .add_option("--sky", sky.file,
                  "sky picture (EXR, Radiance .hdr), sky in words (.toml), or weather tape (.epw, .wea)")
      ->required();
  command.add_option("--time", sky.time, "weather tapes: \"06-21 12:30\", local standard time");
  command.add_option("--projection", sky.projection, "equirect, angular or fisheye:LENS.yaml")->capture_default_str();
  command.add_option("--sky-rotation", sky.rotation_deg, "degrees, turns the sky counter-clockwise about z");
  command.add_option("--forward", sky.forward, "forward axis of an angular map")->expected(3)->delimiter(',');
  command.add_option("--sky-up", sky.up, "up axis of an angular map")->expected(3)->delimiter(',');
}

CLI::App* add_sky(CLI::App& app, SkyCommandArguments& a) {
  CLI::App* command = app.add_subcommand(
      "sky", "a sky as others see it: radiance `r g b` along directions `x y z` from stdin, or with -o a picture");
  add_sky_options(*command, a.sky);
  command->add_option("--ground-albedo", a.ground_albedo, "ground of a sky in words")->check(CLI::Range(0.0, 1.0));
  CLI::Option* output = command->add_option("-o,--output", a.output, "EXR, equirectangular, centre column along +x");
  command->add_option("--height", a.height_px, "of the picture, pixels")
      ->check(CLI::Range(8, 8192))
      ->needs(output)
      ->capture_default_str();
  return command;
}

CLI::App* add_irradiance(CLI::App& app, IrradianceArguments& a) {
  CLI::App* command = app.add_subcommand(
      "irradiance",
      "irradiance at points by path tracing: `x y z nx ny nz` per line on stdin, `r g b se_r se_g se_b` on "
      "stdout, indirect light only unless --total");
  command->add_option("ROOM", a.room, "room model: OBJ, z up, metres")->required();
  add_sky_options(*command, a.sky);
  command
      ->add_option("--ground-albedo", a.ground_albedo,
                   "fills what a fish-eye does not see (0.2); ground of a sky in words")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--spp", a.samples, "paths per point")->check(CLI::Range(16, 1 << 26))->capture_default_str();
  command->add_option("--up", a.up, "axis that points up in the model")->check(CLI::IsMember({"y", "z"}));
  CLI::Option* sh = command->add_flag("--sh", a.coefficients,
                                      "nine coefficients instead: `x y z` in, 27 numbers and "
                                      "their 27 standard errors out");
  CLI::Option* total = command->add_flag("--total", a.total, "with the light that comes straight from the sky");
  command
      ->add_flag_callback(
          "--indirect", [&a] { a.total = false; }, "light from surfaces only (the default)")
      ->excludes(total);
  (void)sh;
  return command;
}

void add_simulate(CLI::App& app, SimulateArguments& a) {
  CLI::Option* scene = app.add_option("SCENE", a.scene, "SCENE.toml: sky model, room, objects, camera");
  CLI::Option* demo = app.add_option("--demo", a.demo, "a built-in scene instead: overcast, sun or shade")
                          ->check(CLI::IsMember({"overcast", "sun", "shade"}));
  demo->excludes(scene);
  app.add_option("-o,--output", a.folder, "folder to write to");
  app.add_option("--size", a.size, "W,H of the interior picture of a --demo")
      ->expected(2)
      ->delimiter(',')
      ->needs(demo)
      ->check(CLI::Range(16, 8192));
  CLI::Option* depth =
      app.add_option("--depth", a.depth,
                     "also a depth picture of the room without the object: exr (metres) or png (16 bits, millimetres)")
          ->check(CLI::IsMember({"exr", "png"}));
  app.add_option("--depth-noise", a.depth_noise_m,
                 "of the depth picture: deviation 1 m away, metres; z^2 times further")
      ->needs(depth)
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--frames", a.frames, "frames along the scene's [path], each with its own sensor noise")
      ->check(CLI::Range(1, 9999));
  app.add_option("--spp", a.samples, "paths per pixel where the object can be seen (default: as the scene says)")
      ->check(CLI::Range(16, 1 << 20));
}

CLI::App* add_compare(CLI::App& app, CompareArguments& a) {
  CLI::App* command = app.add_subcommand("compare", "picture error of a result against the truth in a folder");
  command->add_option("DIR", a.folder, "folder that daylit-simulate wrote")->required();
  command->add_option("--result", a.result, "linear EXR under test (default: DIR/result.exr)");
  command->add_option("--result-mask", a.result_mask,
                      "EXR, 1 where the result shows the object (default: DIR/result-mask.exr where it is there)");
  command->add_option(
      "--second-truth", a.second_truth,
      "truth.exr of another --seed: errors without the truths' noise, and the object's darkest third by it");
  command->add_option("--frame", a.frame, "of a sequence")->check(CLI::Range(0, 9999));
  command->add_option("-o,--output", a.output, "PNG: result, truth, four times their difference");
  command->add_option("--zoom", a.zoom, "of the PNG: the object's surroundings alone, so many times as large")
      ->check(CLI::Range(1, 16));
  return command;
}

CLI::App* add_photographs(CLI::App& app, PhotographsArguments& a) {
  CLI::App* command = app.add_subcommand(
      "photographs", "photographs of a print on paper from many sides: what a calibration takes, with known truth");
  command->add_option("PRINT", a.print, "PNG, as daylit-calibrate print writes it")->required();
  command->add_option("--width", a.width_m, "of the print with its margin, metres")
      ->required()
      ->check(positive_number());
  command->add_option("--lens", a.lens, "lens file of the camera")->required();
  command->add_option("-o,--output", a.folder, "folder to write to")->required();
  command->add_option("--views", a.views, "number of photographs")->check(CLI::Range(1, 1000))->capture_default_str();
  command->add_option("--tilt", a.tilt_deg, "of the print, at most, degrees")
      ->check(CLI::Range(0.0, 75.0))
      ->capture_default_str();
  command
      ->add_option("--part", a.part,
                   "of the field's half angle, what half of the print fills (0.4 of a fish-eye, else 1)")
      ->check(CLI::Range(0.02, 2.0));
  command->add_option("--distance", a.distance_m, "NEAR,FAR metres, instead of --part")
      ->expected(2)
      ->delimiter(',')
      ->check(positive_number());
  command->add_option("--reach", a.reach, "of a fish-eye's circle that the print may use")
      ->check(CLI::Range(0.1, 1.0))
      ->capture_default_str();
  command->add_flag("--partly", a.partly, "the print may reach out of the picture");
  command->add_option("--exposure", a.exposure, "factor; from 1.4 on white paper is saturated")
      ->check(positive_number())
      ->capture_default_str();
  command->add_option("--blur", a.blur_px, "standard deviation, pixels")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command->add_option("--noise", a.noise, "standard deviation, of full scale")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--colour-matrix", a.camera_from_rec709, "camera colours from linear Rec. 709, 9 numbers by rows")
      ->expected(9)
      ->delimiter(',');
  command->add_option("--format", a.format, "of the photographs: jpeg and png (sRGB), exr (linear)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, PictureFormat>{{"jpeg", PictureFormat::jpeg},
                                                                               {"png", PictureFormat::png},
                                                                               {"exr", PictureFormat::exr}},
                                          CLI::ignore_case));
  return command;
}

CLI::App* add_hand_held(CLI::App& app, HandHeldArguments& a) {
  CLI::App* command =
      app.add_subcommand("hand-held", "pictures of a sky map in all directions, with rough orientations "
                                      "and differing exposures: what probe-stitch takes");
  command->add_option("MAP", a.map, "sky map of the whole sphere, equirectangular (EXR, Radiance .hdr)")->required();
  command->add_option("-o,--output", a.folder, "folder to write to")->required();
  command->add_option("--pictures", a.pictures, "number of pictures")->check(CLI::Range(1, 999))->capture_default_str();
  command->add_option("--fov", a.fov_deg, "horizontal field of view, degrees")
      ->check(CLI::Range(10.0, 140.0))
      ->capture_default_str();
  command->add_option("--size", a.size, "W,H of the pictures")
      ->expected(2)
      ->delimiter(',')
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  command->add_option("--off", a.off_deg, "error of the rough orientations, degrees")
      ->check(CLI::Range(0.0, 30.0))
      ->capture_default_str();
  command->add_option("--stops", a.stops, "between the longest exposure and the shortest that the camera has")
      ->check(CLI::Range(0.0, 20.0))
      ->capture_default_str();
  command->add_option("--noise", a.noise, "photon noise: standard deviation at full scale")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--exposure-error", a.exposure_error, "relative deviation of the exposures from the stated ones")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--lowest", a.lowest_deg, "no picture looks further down, degrees")
      ->check(CLI::Range(-90.0, 80.0))
      ->capture_default_str();
  return command;
}

CLI::App* add_develop(CLI::App& app, DevelopArguments& a) {
  CLI::App* command =
      app.add_subcommand("develop", "what a camera makes of the light of a rendered picture: exposure, colour, codes");
  command->add_option("PICTURE", a.picture, "linear picture (EXR, Radiance .hdr)")->required();
  command->add_option("-o,--output", a.output, "PNG: the camera's codes; EXR: its light, without curve and limit")
      ->required();
  command->add_option("--exposure", a.exposure, "the largest code stands for light 1 / exposure")
      ->check(positive_number())
      ->capture_default_str();
  command->add_option("--mean", a.mean, "instead of --exposure: what the mean is metered to, of full scale")
      ->check(positive_number());
  command->add_option("--colour-matrix", a.camera_from_rec709, "camera colours from linear Rec. 709, 9 numbers by rows")
      ->expected(9)
      ->delimiter(',');
  command->add_option("--logarithmic", a.logarithmic, "A of the code ln(1 + A v) / ln(1 + A) of light v; 0: linear")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command->add_option("--noise", a.noise, "photon noise: standard deviation at full scale")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--lens", a.lens, "lens file, for --fall-off");
  command->add_option("--fall-off", a.fall_off, "file of daylit-calibrate vignette: the lens loses so much");
  return command;
}

struct Chosen {
  const CLI::App *irradiance, *compare, *sky, *photographs, *hand_held, *develop;
};

Result<void> run(const Chosen& chosen, const IrradianceArguments& i, const CompareArguments& c,
                 const SkyCommandArguments& k, const PhotographsArguments& p, const HandHeldArguments& h,
                 const DevelopArguments& d, const SimulateArguments& s) {
  if (*chosen.develop)
    return run_develop(d);
  if (*chosen.photographs)
    return run_photographs(p);
  if (*chosen.hand_held)
    return run_hand_held(h);
  if (*chosen.sky)
    return run_sky(k);
  if (*chosen.irradiance)
    return run_irradiance(i);
  if (*chosen.compare)
    return run_compare(c);
  if (s.folder.empty() || (s.scene.empty() && s.demo.empty()))
    return Error{ErrorCode::usage, "needs SCENE.toml or --demo NAME, and -o DIR", "command line",
                 "see daylit-simulate --help"};
  return run_simulate(s);
}

} // namespace

int main(int argc, char** argv) {
  watch_for_interrupt(); // first: an interrupt may come at once
  CLI::App app{
      "Simulates rooms under daylight by path tracing: the pictures that cameras would record, and the truth.\n"
      "Example: daylit-simulate --demo overcast -o out"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.fallthrough();
  IrradianceArguments irradiance;
  CompareArguments compare;
  SkyCommandArguments sky;
  PhotographsArguments photographs;
  HandHeldArguments hand_held;
  DevelopArguments develop;
  SimulateArguments simulate;
  int threads = 0;
  add_simulate(app, simulate);
  add_threads_option(app, threads);
  app.add_option("--seed", simulate.seed, "of the random numbers: same seed, same bits");
  add_force_option(app, simulate.force);
  app.add_flag("--quiet", simulate.quiet, "no progress, no summary");
  app.add_flag("--json", simulate.json, "the report as JSON on stdout, one object per line");
  CLI::App* irradiance_command = add_irradiance(app, irradiance);
  CLI::App* compare_command = add_compare(app, compare);
  CLI::App* sky_command = add_sky(app, sky);
  CLI::App* photographs_command = add_photographs(app, photographs);
  CLI::App* hand_held_command = add_hand_held(app, hand_held);
  CLI::App* develop_command = add_develop(app, develop);
  app.require_subcommand(0, 1);
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt;
  set_thread_count(threads);
  irradiance.seed = photographs.seed = hand_held.seed = develop.seed = simulate.seed;
  irradiance.quiet = sky.quiet = photographs.quiet = hand_held.quiet = develop.quiet = simulate.quiet;
  compare.force = sky.force = develop.force = simulate.force;
  irradiance.json = compare.json = sky.json = photographs.json = hand_held.json = develop.json = simulate.json;
  return run_program("daylit-simulate", simulate.json, [&] {
    return run(
        {irradiance_command, compare_command, sky_command, photographs_command, hand_held_command, develop_command},
        irradiance, compare, sky, photographs, hand_held, develop, simulate);
  });
}
