#include <iostream>
#include <memory>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/sh_sections.h"
#include "scene/image/image_formats.h"
#include "sh/basis.h"
#include "sh/detail/kernels.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::string peer, probe, vectors;
  bool high = false;
};

/// One line per row, the named columns only.
void print_table(const std::string& title, const nlohmann::json& rows, const std::vector<std::string>& columns) {
  std::cout << title << '\n';
  for (const std::string& c : columns)
    std::cout << (c == columns.front() ? "" : " | ") << c;
  std::cout << '\n';
  for (const auto& row : rows) {
    for (const std::string& c : columns) {
      std::cout << (c == columns.front() ? "" : " | ");
      const auto at = nlohmann::json::json_pointer("/" + c);
      if (!row.contains(at))
        std::cout << "-";
      else if (row.at(at).is_number_float())
        std::cout << CLI::detail::to_string(float(row.at(at).get<double>()));
      else
        std::cout << row.at(at);
    }
    std::cout << '\n';
  }
  std::cout << '\n';
}

void print(const nlohmann::json& d) {
  print_table("harmonics: error relative to the row's largest value", d["basis"],
              {"degree", "error_double", "error_float", "error_factorials_double", "error_factorials_float",
               "ns_per_harmonic"});
  print_table("RGB transforms on a Gauss-Legendre grid, one thread", d["transforms"],
              {"degree", "round_trip_double", "round_trip_float", "synthesis_ms", "analysis_ms", "peer/synthesis_ratio",
               "peer/analysis_ratio"});
  print_table("rotation", d["rotation"], {"degree", "max_error_over_rms", "ms"});
  std::cout << "nine coefficients: " << d["nine"].dump() << "\n\n";
  if (!d.contains("lobe_maps"))
    return;
  print_table("Phong lobe maps, 512 x 512 angular map, mean error against direct summation", d["lobe_maps"]["maps"],
              {"exponent", "degree", "needed_degree", "mean_error", "max_error", "ms", "order_35_exact_mean_error",
               "order_35_float_factorials_mean_error", "order_50_float_factorials_mean_error"});
  std::cout << "eight maps 512 x 1024: " << d["eight_maps"].dump() << "\n";
}

Result<void> choose_vectors(const std::string& name) {
  for (const sh::detail::Kernels* set : sh::detail::all_kernels())
    if (set->name == name)
      sh::detail::select_kernels(*set);
  if (name.empty() || name == sh::instruction_set())
    return {};
  return Error{ErrorCode::usage, "this processor has no such vectors", "--vectors " + name,
               "give baseline, avx2 or avx512"};
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  std::optional<ShPeer> peer;
  if (!a.peer.empty()) {
    auto loaded = ShPeer::load(a.peer);
    if (!loaded)
      return loaded.error();
    peer = std::move(*loaded);
  }
  if (const auto chosen = choose_vectors(a.vectors); !chosen)
    return chosen.error();
  std::optional<HdrFile> probe;
  if (!a.probe.empty()) {
    auto file = read_hdr_image(a.probe);
    if (!file)
      return file.error();
    if (file->radiance.width * 4 != file->radiance.height * 3 || file->radiance.width < 6)
      return Error{ErrorCode::value_invalid, "not a vertical cross of cube faces (3 x 4)", a.probe,
                   "give such a probe"};
    probe = std::move(*file);
  }
  ProgressLine line(options.quiet);
  const Step step = [&](const std::string& what, double fraction) {
    return line.update(what, fraction) && !interrupted();
  };
  nlohmann::json d{{"machine", machine()}};
  d["nine"] = measure_nine();
  step("harmonics", 0.0);
  d["basis"] = measure_basis();
  step("rotation", 0.0);
  d["rotation"] = measure_rotation();
  auto transforms = measure_transforms(a.high, peer, step);
  if (!transforms)
    return transforms.error();
  d["transforms"] = *transforms;
  if (probe) {
    auto eight = measure_eight_maps(probe->radiance);
    auto maps = eight ? measure_lobe_maps(probe->radiance, step) : eight;
    if (!maps)
      return maps.error();
    d["eight_maps"] = *eight;
    d["lobe_maps"] = *maps;
  }
  line.clear();
  if (!options.json)
    print(d);
  return deliver(d, options);
}

} // namespace

Command add_sh(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("sh", "spherical harmonics: error and time by degree");
  parser->add_option("--peer", arguments->peer, "shared object of another transform library, see docs/sh.md");
  parser->add_option("--probe", arguments->probe, "light probe as a vertical cross (.hdr, .exr) for the lobe maps");
  parser->add_option("--vectors", arguments->vectors, "narrower instructions than the processor has: baseline, avx2");
  parser->add_flag("--high", arguments->high, "degrees 2047 and 4095 too (some seconds, 3 GB)");
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
