/// One mbtfm at a time works on a stage of a cell folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mbtfm::runner {

/// Another process works on the cell.
struct CellBusy : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The lock file of a cell folder, open.
class LockFile {
 public:
  enum class IfTaken { give_up, wait };

  /// @throws InputError where a link or the like is in its place, OutputError where it cannot be made
  explicit LockFile(const std::filesystem::path& cell);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

  /// Lock a byte for whoever has this opening of the file (not for the process: those it starts may inherit it).
  /// @returns whether it is ours now
  bool lock(int byte, IfTaken if_taken) const;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

/// Holds stages of the cell while it lives: each is a byte of the folder's lock file, so that different stages of a
/// cell may run at the same time, also on different machines of one file system. The system frees the bytes when all
/// who hold them have ended, however they end.
class CellLock {
 public:
  /// @param only  names of stages; empty: all
  /// @throws CellBusy where another process holds one of them, OutputError where the lock file cannot be made
  CellLock(const std::filesystem::path& cell, const std::vector<std::string>& only);

  /// Programs that are started from now on hold the lock with us, until they have ended, too.
  void share_with_programs() const;

 private:
  LockFile file_;
};

/// Held while run.json is read and rewritten, which concerns all stages. Waits for its turn.
class RunRecordLock {
 public:
  explicit RunRecordLock(const std::filesystem::path& cell);

 private:
  LockFile file_;
};

}  // namespace mbtfm::runner
