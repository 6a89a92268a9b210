#pragma once

// What the command lines of all programs have in common. For main.cpp files: the rest of the product does not see
// CLI11.

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "scene/core/program.h"
#include "scene/core/text_lines.h"

namespace daylit {

constexpr int kMostThreads = 1024;

inline CLI::Option* add_threads_option(CLI::App& app, int& threads) {
  return app.add_option("--threads", threads, "worker threads, 0 = all cores")->check(CLI::Range(0, kMostThreads));
}

inline CLI::Option* add_force_option(CLI::App& app, bool& force) {
  return app.add_flag("--force", force, "replace a file to be written that holds something else");
}

/// For check(): a number above zero; CLI::PositiveNumber prints the 309 digits of the largest one.
inline CLI::Validator positive_number() {
  const auto refuse = [](const std::string& text) {
    const auto number = parse_number(text);
    return number && std::isfinite(*number) && *number > 0 ? std::string() : text + " is not a positive number";
  };
  return CLI::Validator(refuse, "POSITIVE");
}

/// For transform() of an option that is bound to an enumeration: its words; another is refused with all of them.
template <class T>
CLI::Validator one_of(const std::vector<std::pair<std::string, T>>& words) {
  std::string list;
  for (const auto& word : words)
    list += (list.empty() ? "" : ", ") + word.first;
  const auto turn = [words, list](std::string& text) {
    for (const auto& [word, value] : words)
      if (text == word) {
        text = std::to_string(static_cast<int>(value));
        return std::string();
      }
    return text + " is not known; one of: " + list;
  };
  return CLI::Validator(turn, "{" + list + "}");
}

/// Throws CLI::ValidationError where an option that takes numbers was given NaN or infinity; ranges let NaN pass.
inline void refuse_numbers_that_are_not_finite(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    if (option->get_type_name().starts_with("FLOAT"))
      for (const std::string& text : option->results())
        if (const auto number = parse_number(text); number && !std::isfinite(*number))
          throw CLI::ValidationError(option->get_name(), text + " is not a finite number");
  for (const CLI::App* command : app.get_subcommands())
    refuse_numbers_that_are_not_finite(*command);
}

/// Fills what the options are bound to, then calls `check`, which may throw a CLI::ParseError for options that do not
/// go together. Nothing: the program goes on; else its exit code (--help, --version, or usage).
template <class Check>
std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv, const Check& check) {
  try {
    app.parse(argc, argv);
    refuse_numbers_that_are_not_finite(app);
    check();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitDone : kExitUsage;
  }
  return std::nullopt;
}

inline std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv) {
  return parse_command_line(app, argc, argv, [] {});
}

} // namespace daylit
