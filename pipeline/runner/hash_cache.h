/// SHA-256 of a cell's files, computed once as long as a file stays as it is.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::runner {

/// SHA-256 by path relative to the cell folder, as names.h shows it.
using Hashes = std::map<std::string, std::string>;

/// The hash is the truth; a file is not read again where its size, its times of content and of state (mtime, ctime, to
/// the nanosecond), device and inode are those it had when it was hashed. That is safe: whatever writes to a file sets
/// its ctime, which no program can set back, so a file that keeps its ctime keeps its bytes, but for two writes within
/// one tick of the file system's clock. A hash is therefore only kept of a file that had come to rest kRest before.
/// The clock compared with is the file system's own. Kept in CELL/.mbtfm.hashes, which may be deleted at any time.
/// Threads may share one.
class HashCache {
 public:
  explicit HashCache(fs::path cell);

  /// Of the files that exist; the others are left out.
  Hashes hash(const std::vector<std::string>& names);
  /// Write what was learnt; without effect where the folder cannot be written to.
  void save();

 private:
  /// size, mtime, ctime (ns), device, inode
  using Stamp = std::array<std::int64_t, 5>;
  struct Entry {
    Stamp stamp{};
    std::string sha256;
  };
  static std::optional<Stamp> stamp_of(const fs::path& file);
  bool has_rested(const Stamp& stamp);

  fs::path cell_;
  std::map<std::string, Entry> entries_;
  std::optional<std::int64_t> began_ns_;  ///< by the file system's clock, before the first hash; 0: unknown
  bool is_changed_ = false;
  std::mutex mutex_;  ///< of all members
};

}  // namespace mbtfm::runner
