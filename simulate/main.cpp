// daylit-simulate: rooms, skies and cameras with known truth.

#include <CLI/CLI.hpp>

#include "scene/program.h"
#include "simulate/irradiance_command.h"

namespace {

using namespace daylit;

CLI::App* add_irradiance(CLI::App& app, IrradianceArguments& a) {
  CLI::App* command = app.add_subcommand(
      "irradiance",
      "irradiance at points by path tracing: `x y z nx ny nz` per line on stdin, `r g b se_r se_g se_b` on "
      "stdout, indirect light only unless --total");
  command->add_option("ROOM", a.room, "room model: OBJ, z up, metres")->required();
  command->add_option("--sky", a.sky, "sky image: EXR or Radiance .hdr")->required();
  command->add_option("--projection", a.projection, "equirect, angular or fisheye:LENS.yaml")->capture_default_str();
  command->add_option("--sky-rotation", a.sky_rotation_deg, "degrees, turns the sky counter-clockwise about z");
  command->add_option("--forward", a.forward, "forward axis of an angular map")->expected(3)->delimiter(',');
  command->add_option("--sky-up", a.sky_up, "up axis of an angular map")->expected(3)->delimiter(',');
  command->add_option("--ground-albedo", a.ground_albedo, "fills what a fish-eye does not see")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
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

} // namespace

int main(int argc, char** argv) {
  CLI::App app{"Simulates rooms under daylight by path tracing.\n"
               "Example: echo 2 2 1 0 0 1 | daylit-simulate irradiance room.obj --sky sky.exr"};
  app.set_version_flag("--version", DAYLIT_VERSION);
  app.fallthrough();
  IrradianceArguments irradiance;
  int threads = 0;
  bool quiet = false, json = false;
  std::uint32_t seed = 0;
  app.add_option("--threads", threads, "worker threads, 0 = all cores")->check(CLI::NonNegativeNumber);
  app.add_option("--seed", seed, "of the random numbers: same seed, same bits");
  app.add_flag("--quiet", quiet, "no progress");
  app.add_flag("--json", json, "one JSON object per line on stdout");
  CLI::App* irradiance_command = add_irradiance(app, irradiance);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitDone : kExitUsage;
  }
  watch_for_interrupt();
  set_thread_count(threads);
  irradiance.seed = seed;
  irradiance.quiet = quiet;
  irradiance.json = json;
  return run_program("daylit-simulate", json, [&]() -> Result<void> {
    if (*irradiance_command)
      return run_irradiance(irradiance);
    return Error{ErrorCode::usage, "nothing to do", "daylit-simulate", "see daylit-simulate --help"};
  });
}
