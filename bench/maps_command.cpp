#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/maps_sections.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::vector<std::string> probes;
  bool tables = false;
};

void print(const nlohmann::json& probe) {
  const auto& m = probe["eight_maps"];
  std::printf("%s, largest / mean %.0f\n", probe["name"].get<std::string>().c_str(),
              m["largest_over_mean"].get<double>());
  for (const auto& [name, method] : m["methods"].items()) {
    std::printf("  %-10s %8.1f ms of processor, %.1f elapsed", name.c_str(), method["ms"].get<double>(),
                method["wall_ms"].get<double>());
    for (std::size_t k = 0; k < method["maps"].size(); ++k)
      std::printf(" | %g: %.1e", m["exponents"][k].get<double>(), method["maps"][k]["mean"].get<double>());
    std::printf(" | mean %.1e, largest %.1e\n", method["mean_error"].get<double>(),
                method["largest_error"].get<double>());
  }
  std::printf("  plain sum  %8.0f ms; exact takes %.3f of it, %.3f from exponent 40 on\n", m["plain_ms"].get<double>(),
              m["exact_over_plain"].get<double>(), m["exact_over_plain_from_exponent_40"].get<double>());
}

Result<nlohmann::json> measure(const Probe& probe, bool tables, const Step& step) {
  auto eight = measure_map_methods(probe, step);
  if (!eight)
    return eight.error();
  nlohmann::json out{{"name", probe.name}, {"eight_maps", *eight}};
  if (tables) {
    auto thesis = measure_thesis_tables(probe, step);
    if (!thesis)
      return thesis.error();
    out["thesis"] = *thesis;
  }
  return out;
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  ProgressLine line(options.quiet || options.json);
  const auto step = [&](const std::string& what, double fraction) {
    return line.update(what, fraction) && !interrupted();
  };
  nlohmann::json d{{"machine", machine()}, {"probes", nlohmann::json::array()}};
  d["machine"]["clock"] = "processor time of all threads, least of the runs";
  d["machine"]["threads"] = options.threads;
  for (std::size_t k = 0; k <= a.probes.size(); ++k) {
    auto probe = k == 0 ? Result<Probe>(generated_probe()) : read_probe(a.probes[k - 1]);
    if (!probe)
      return probe.error();
    auto measured = measure(*probe, a.tables, step);
    if (!measured)
      return measured.error();
    line.clear();
    if (!options.json)
      print(*measured);
    d["probes"].push_back(*measured);
  }
  return deliver(d, options);
}

} // namespace

Command add_maps(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("maps", "blurred radiance maps by three methods: error and time");
  parser->add_option("--probe", arguments->probes,
                     "light probes as angular maps or vertical crosses (.hdr, .exr), beside the generated one");
  parser->add_flag("--tables", arguments->tables, "the tables of the thesis too (some minutes)");
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
