// daylit-bench selftest: the installed libraries against closed forms, as a table a lighting engineer recognises.

#include <cmath>
#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/selftest/closed_form_cases.h"

namespace daylit::bench {
namespace {

struct Arguments {
  std::string quality = "normal";
};

nlohmann::json to_json(const ClosedFormCase& c, const Comparison& row, double tolerance) {
  return {{"case", c.name},         {"subject", c.subject},
          {"what", row.what},       {"reference", row.reference},
          {"result", row.result},   {"deviation", row.deviation()},
          {"tolerance", tolerance}, {"passed", std::abs(row.deviation()) <= tolerance}};
}

void print_row(const ClosedFormCase& c, const Comparison& row, double tolerance) {
  std::printf("%-14s %-62s %12.6g %12.6g %+9.4f %%%s\n", c.name, row.what.c_str(), row.reference, row.result,
              100 * row.deviation(), std::abs(row.deviation()) <= tolerance ? "" : "  OUTSIDE");
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  const auto quality = selftest_quality(a.quality);
  if (!quality)
    return quality.error();
  nlohmann::json document = {{"machine", machine()}, {"quality", a.quality}, {"rows", nlohmann::json::array()}};
  ProgressLine progress(options.quiet);
  std::size_t rows = 0, outside = 0;
  double worst = 0;
  if (!options.json)
    std::printf("%-14s %-62s %12s %12s %11s\n", "case", "", "reference", "result", "deviation");
  for (const ClosedFormCase& c : closed_form_cases()) {
    const auto list = c.run(*quality, progress.callback());
    progress.clear();
    if (!list)
      return list.error();
    for (const Comparison& row : *list) {
      document["rows"].push_back(to_json(c, row, quality->tolerance));
      if (!options.json)
        print_row(c, row, quality->tolerance);
      // The negation catches NaN.
      outside += !(std::abs(row.deviation()) <= quality->tolerance) ? 1 : 0;
      worst = std::max(worst, std::abs(row.deviation()));
      ++rows;
    }
  }
  document["worst_deviation"] = worst;
  document["outside"] = outside;
  if (!options.json)
    std::printf("%zu comparisons, worst deviation %.4f %%, allowed %.2g %%, outside: %zu\n", rows, 100 * worst,
                100 * quality->tolerance, outside);
  if (const auto delivered = deliver(document, options); !delivered)
    return delivered.error();
  if (outside > 0)
    return Error{ErrorCode::value_invalid, std::to_string(outside) + " comparisons are outside their tolerance",
                 "selftest", "this installation computes wrong light: rebuild it, and report the table"};
  return {};
}

} // namespace

Command add_selftest(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* parser = program.add_subcommand("selftest", "closed-form lighting cases (CIE 171:2006 and others) against "
                                                        "this installation; exit code 1 when one is off");
  parser->add_option("--quality", arguments->quality, "normal (within 2 %) or high (within 0.5 %, minutes)")
      ->capture_default_str();
  return {parser, [arguments](const CommonOptions& options) { return run(*arguments, options); }};
}

} // namespace daylit::bench
