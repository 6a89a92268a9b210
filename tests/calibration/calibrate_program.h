#pragma once

// The real daylit-calibrate, run in a folder of its own.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

namespace daylit::test {

namespace fs = std::filesystem;

/// Empty, of this process alone: tests of one file run beside each other. Goes with the process.
inline fs::path fresh_folder(const std::string& name) {
  struct Folders {
    std::vector<fs::path> made;
    ~Folders() {
      std::error_code none;
      for (const fs::path& folder : made)
        fs::remove_all(folder, none);
    }
  };
  static Folders folders;
  folders.made.push_back(fs::temp_directory_path() / ("daylit-calibrate-" + name + "-" + std::to_string(getpid())));
  fs::remove_all(folders.made.back());
  fs::create_directories(folders.made.back());
  return folders.made.back();
}

struct CalibrateOutcome {
  int exit_code = -1;
  nlohmann::json json; ///< of stdout
};

/// `arguments` of daylit-calibrate, --json is added.
inline CalibrateOutcome calibrate(const fs::path& folder, const std::string& arguments) {
  const fs::path out = folder / "stdout.json";
  const std::string line = "cd '" + folder.string() + "' && " DAYLIT_BINARY_DIR "/bin/daylit-calibrate " + arguments +
                           " --json > stdout.json 2> stderr.txt";
  const int status = std::system(line.c_str());
  std::ifstream file(out);
  std::string first;
  std::getline(file, first);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, nlohmann::json::parse(first, nullptr, false)};
}

/// Whether one of the reasons of the verdict says so.
inline bool says(const CalibrateOutcome& outcome, const std::string& what) {
  return outcome.json.contains("why") && outcome.json["why"].dump().find(what) != std::string::npos;
}

} // namespace daylit::test
