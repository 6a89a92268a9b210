#pragma once

// Options of the subcommands that read exposure brackets. For the program alone: sees CLI11.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibration/bracket_files.h"
#include "calibration/command.h"

namespace daylit::calibration {

struct BracketOptions {
  std::string exposures, mosaic = "mono", ignore;
  std::filesystem::path list;
};

void add_bracket_options(CLI::App& command, BracketOptions& options);

/// The bracket's pictures, told one after another from the shortest exposure to the longest.
struct Bracket {
  BracketFiles files;
  std::vector<PlaceCodes> places; ///< of the pictures that count
  std::vector<DroppedPicture> dropped;
  int bits = 8;
};

/// `take` gets each picture that counts, its time and its pixels without a picture. A picture of another size or depth
/// than the first is dropped.
using TakePicture =
    std::function<Result<void>(const CodePicture&, double time, const std::vector<std::uint8_t>& ignored)>;
Result<Bracket> read_bracket(const CommonOptions& common, const BracketOptions& options, const TakePicture& take);

/// With the pictures that count and those that do not.
Report report_on(const std::string& title, const Bracket& bracket);

/// What to do with a bracket that is none; nothing: it is one.
std::optional<std::string> no_bracket(const Bracket& bracket);

} // namespace daylit::calibration
