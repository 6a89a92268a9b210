// daylit-simulate: rooms, skies and cameras with known truth.

#include "scene/core/command_line.h"
#include "simulate/commands.h"
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
  command->add_option("--frame", a.frame, "of a sequence")->check(CLI::Range(0, 9999));
  command->add_option("-o,--output", a.output, "PNG: result, truth, four times their difference");
  return command;
}

struct Chosen {
  const CLI::App *irradiance, *compare, *sky;
};

Result<void> run(const Chosen& chosen, const IrradianceArguments& i, const CompareArguments& c,
                 const SkyCommandArguments& k, const SimulateArguments& s) {
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
  CLI::App app{
      "Simulates rooms under daylight by path tracing: the pictures that cameras would record, and the truth.\n"
      "Example: daylit-simulate --demo overcast -o out"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.fallthrough();
  IrradianceArguments irradiance;
  CompareArguments compare;
  SkyCommandArguments sky;
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
  app.require_subcommand(0, 1);
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  watch_for_interrupt();
  set_thread_count(threads);
  irradiance.seed = simulate.seed;
  irradiance.quiet = sky.quiet = simulate.quiet;
  compare.force = sky.force = simulate.force;
  irradiance.json = compare.json = sky.json = simulate.json;
  return run_program("daylit-simulate", simulate.json, [&] {
    return run({irradiance_command, compare_command, sky_command}, irradiance, compare, sky, simulate);
  });
}
