#include <set>

#include <fmt/format.h>

#include "runtime/doctor/doctor.h"
#include "runtime/http/http_server.h"
#include "scene/core/read_file.h"

namespace daylit {

namespace {

constexpr std::uint64_t kLittle_bytes = 1'000'000'000, kNothing_bytes = 50'000'000;
constexpr std::size_t kTokenCharacters = 16;

Finding check_token(const std::filesystem::path& file) {
  const auto bytes = read_whole_file(file);
  if (!bytes)
    return failure("http token", bytes.error());
  const std::string text(bytes->begin(), bytes->end());
  const std::size_t characters = text.find_last_not_of(" \t\r\n") + 1;
  if (characters < kTokenCharacters)
    return failure("http token", fmt::format("{} has {} characters", file.string(), characters),
                   fmt::format("{} at least: openssl rand -hex 16 > {}", kTokenCharacters, file.string()));
  std::error_code none;
  const auto rights = std::filesystem::status(file, none).permissions();
  if ((rights & std::filesystem::perms::others_read) != std::filesystem::perms::none)
    return warning("http token", file.string() + " can be read by every user of this machine",
                   "chmod 600 " + file.string());
  return all_well("http token", file.string());
}

} // namespace

Findings check_disks(const RunConfig& config) {
  std::set<std::filesystem::path> folders;
  // Transfer vectors of the objects are kept beside the volume.
  for (const auto& file : {config.volume, config.output.png, config.output.exr, config.output.mask})
    if (!file.empty())
      folders.insert(std::filesystem::absolute(file).parent_path());
  Findings all;
  for (const auto& folder : folders) {
    const auto disk = disk_of(folder);
    const std::string found =
        disk ? fmt::format("{}: {:.1f} GB free", folder.string(), 1e-9 * static_cast<double>(disk->free_bytes)) : "";
    if (!disk)
      all.push_back(failure("disk", folder.string() + " does not exist", "mkdir -p " + folder.string()));
    else if (!disk->writable)
      all.push_back(failure("disk", folder.string() + " cannot be written to", "give its rights to the daemon's user"));
    else if (disk->free_bytes < kNothing_bytes)
      all.push_back(failure("disk", found, "make room"));
    else if (disk->free_bytes < kLittle_bytes)
      all.push_back(warning("disk", found, "make room: a recording fills it within minutes"));
    else
      all.push_back(all_well("disk", found));
  }
  return all;
}

Findings check_http(const HttpConfig& http) {
  Findings all;
  const std::string where = fmt::format("{}:{}", http.address, http.port);
  // Tried as the daemon does it. The token has a finding of its own.
  const auto server = HttpServer::start({http.address, http.port, std::string(kTokenCharacters, '-')}, {});
  if (server)
    all.push_back(all_well("http", where));
  else if (server.error().code == ErrorCode::device) // it may be the daemon that runs
    all.push_back(warning("http", where + ": " + server.error().what, server.error().hint));
  else
    all.push_back(failure("http", server.error()));
  if (!http.token_file.empty())
    all.push_back(check_token(http.token_file));
  return all;
}

} // namespace daylit
