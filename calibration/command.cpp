#include "calibration/command.h"

#include <cstdio>

#include "scene/core/atomic_file.h"
#include "scene/core/text_lines.h"

namespace daylit::calibration {

namespace {

constexpr FileKind kReportKind{"a report of daylit-calibrate", "<!doctype html><html lang='en'><meta charset='utf-8'>"};

/// Makes the folder of the report. Error: there is a file of that name, or its page is no report.
Result<void> check_report(const CommonOptions& o) {
  if (o.report.empty())
    return {};
  std::error_code failed;
  std::filesystem::create_directories(o.report, failed);
  if (std::filesystem::exists(o.report, failed) && !std::filesystem::is_directory(o.report, failed))
    return Error{ErrorCode::usage, "is a file, not a folder", "--report " + o.report.string(),
                 "give the folder for report.html and report.json"};
  return check_output(o.report / "report.html", kReportKind, o.force);
}

} // namespace

void add_common_options(CLI::App& command, CommonOptions& o, const char* inputs, const char* output) {
  command.add_option("INPUT", o.inputs, inputs)->required();
  command.add_option("-o,--output", o.output, output)->required();
  command.add_option("--report", o.report, "folder for report.html and report.json");
  add_force_option(command, o.force);
  command.add_flag("--quiet", o.quiet, "no progress, no summary");
  command.add_flag("--json", o.json, "verdict and figures as one JSON object on stdout");
}

Result<void> check_outputs(const CommonOptions& o, const FileKind& kind) {
  if (const Result<void> good = check_output(o.output, kind, o.force); !good)
    return good;
  return check_report(o);
}

Result<void> deliver(const CommonOptions& o, const Report& report) {
  if (!o.report.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(o.report, failed);
    for (const auto& [name, text] :
         {std::pair{"report.html", to_html(report, o.command_line)}, {"report.json", to_json(report) + "\n"}})
      if (const Result<void> written = write_file_atomically(o.report / name, text); !written)
        return written;
  }
  if (o.json)
    std::printf("%s\n", to_json(report).c_str());
  else if (!o.quiet)
    std::fprintf(stderr, "%s", to_text(report).c_str());
  else if (!report.pass)
    for (const std::string& why : report.why)
      std::fprintf(stderr, "daylit-calibrate: repeat: %s\n", why.c_str());
  return {};
}

Result<void> deliver_result(CommonOptions& o, const FileKind& kind, Report report,
                            const std::function<Result<void>()>& write) {
  if (interrupted())
    return interrupted_error("calibration");
  if (const Result<void> good = check_outputs(o, kind); !good)
    return good;
  std::error_code failed;
  if (!report.pass && !o.force && std::filesystem::exists(o.output, failed) &&
      std::filesystem::file_size(o.output, failed) > 0) {
    report.why.push_back(o.output.string() + " is left as it was; --force replaces it with this result");
    o.nothing_written = true;
  } else if (const Result<void> written = write(); !written) {
    return written;
  }
  return deliver(o, report);
}

Result<void> deliver_without_result(CommonOptions& o, Report report, std::vector<std::string> faults) {
  report.pass = false;
  report.why = std::move(faults);
  o.nothing_written = true;
  if (const Result<void> good = check_report(o); !good)
    return good;
  return deliver(o, report);
}

Result<std::vector<double>> parse_numbers(const std::string& text, std::size_t count, const std::string& option) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto number = parse_number(trimmed(std::string_view(text).substr(begin, end - begin)));
    if (!number || !std::isfinite(*number))
      return Error{ErrorCode::usage, "'" + text + "' is no list of numbers", option,
                   "numbers with commas between them"};
    numbers.push_back(*number);
    begin = end + 1;
  }
  if (count > 0 && numbers.size() != count)
    return Error{ErrorCode::usage, std::to_string(numbers.size()) + " numbers instead of " + std::to_string(count),
                 option, "numbers with commas between them"};
  return numbers;
}

} // namespace daylit::calibration
