#pragma once

// Temporary files of write_file_atomically() that are being written just now.

#include <string>

namespace daylit::detail {

/// The file exists while the object lives; then it was renamed or removed.
class UnfinishedFile {
public:
  explicit UnfinishedFile(const std::string& path);
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

private:
  const std::string& path_;
};

/// Removes them all; afterwards no more are begun or renamed: for a process that is about to end.
void remove_unfinished_files();

} // namespace daylit::detail
