#include "scene/core/output_file.h"

#include <fstream>
#include <string>

#include <unistd.h>

#include "scene/core/read_file.h"

namespace daylit {

namespace {

bool starts_as(const std::filesystem::path& path, const FileKind& kind) {
  std::string start(kind.start.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  return file.seekg(static_cast<std::streamoff>(kind.offset)) &&
         file.read(start.data(), static_cast<std::streamsize>(start.size())) && start == kind.start;
}

} // namespace

Result<void> check_output(const std::filesystem::path& path, const FileKind& kind, bool force) {
  namespace fs = std::filesystem;
  std::error_code failed;
  if (path.has_parent_path() && !fs::is_directory(path.parent_path(), failed))
    return Error{ErrorCode::io, "the folder to write to does not exist", path.string(), "make the folder first"};
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return Error{ErrorCode::io, "nothing can be written into the folder", folder.string(),
                 "give another folder, or the right to write there"};
  const fs::file_status status = fs::status(path, failed);
  if (!fs::exists(status))
    return {};
  if (!fs::is_regular_file(status))
    return Error{ErrorCode::value_invalid, "the output is a folder, a pipe or a device", path.string(),
                 "give the path of a file"};
  if (was_read(path))
    return Error{ErrorCode::value_invalid, "the output is an input of the same run", path.string(),
                 "give another name to write to"};
  if (force || fs::file_size(path, failed) == 0 || starts_as(path, kind))
    return {};
  return Error{ErrorCode::value_invalid, std::string("the file to write exists and is not ") + kind.name, path.string(),
               "give another name, or --force to replace it"};
}

} // namespace daylit
