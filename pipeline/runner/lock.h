/// One mbtfm at a time works on a cell folder.
#pragma once

#include <filesystem>

namespace mbtfm::runner {

/// Holds the folder's lock file while it lives; the system frees the lock when the process ends, however it ends.
class FolderLock {
 public:
  /// @throws InputError where another process holds it, OutputError where the lock file cannot be made
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace mbtfm::runner
