#include "pipeline/runner/hash_cache.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"

namespace mbtfm::runner {
namespace {

// The coarsest clock of a file system in use: FAT's 2 s; of others it is 10 ms at most.
constexpr std::int64_t kRest_ns = 2'000'000'000;
constexpr std::size_t kHashLength = 64;

std::int64_t nanoseconds(const timespec& time) {
  return static_cast<std::int64_t>(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

fs::path file_in(const fs::path& cell) { return cell / ".mbtfm.hashes"; }

/// What the file system's clock says, by touching a file; 0 where it cannot be touched.
std::int64_t file_system_time_ns(const fs::path& file) {
  try {
    files::make_way(file);  // a file elsewhere must not be touched through a link
  } catch (const OutputError&) {
    return 0;
  }
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
  if (descriptor < 0) return 0;
  struct stat status {};
  const bool is_known = futimens(descriptor, nullptr) == 0 && fstat(descriptor, &status) == 0;
  close(descriptor);
  return is_known ? nanoseconds(status.st_mtim) : 0;
}

}  // namespace

HashCache::HashCache(fs::path cell) : cell_(std::move(cell)) {
  if (!files::is_own_text(file_in(cell_))) return;
  std::ifstream file(file_in(cell_));
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    Entry entry;
    std::string name;
    fields >> entry.sha256;
    for (std::int64_t& number : entry.stamp) fields >> number;
    // A line that is not as we write it, as the last one of a file cut short, is as good as none.
    if (!fields || entry.sha256.size() != kHashLength || fields.get() != ' ' || !std::getline(fields, name)) continue;
    entries_[name] = std::move(entry);
  }
}

std::optional<HashCache::Stamp> HashCache::stamp_of(const fs::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
  return Stamp{status.st_size, nanoseconds(status.st_mtim), nanoseconds(status.st_ctim),
               static_cast<std::int64_t>(status.st_dev), static_cast<std::int64_t>(status.st_ino)};
}

bool HashCache::has_rested(const Stamp& stamp) {
  if (!began_ns_) began_ns_ = file_system_time_ns(file_in(cell_));
  return std::max(stamp[1], stamp[2]) + kRest_ns < *began_ns_;
}

Hashes HashCache::hash(const std::vector<std::string>& names) {
  Hashes hashes;
  for (const std::string& name : names) {
    const auto stamp = stamp_of(cell_ / name);
    if (!stamp) continue;
    std::unique_lock guard(mutex_);
    if (const auto known = entries_.find(name); known != entries_.end() && known->second.stamp == *stamp) {
      hashes[files::shown_name(name)] = known->second.sha256;
      continue;
    }
    const bool is_kept = has_rested(*stamp) && name.find('\n') == std::string::npos;
    guard.unlock();
    const std::string sha256 = files::sha256_of_file(cell_ / name);
    hashes[files::shown_name(name)] = sha256;
    if (!is_kept) continue;
    guard.lock();
    entries_[name] = {.stamp = *stamp, .sha256 = sha256};
    is_changed_ = true;
  }
  return hashes;
}

void HashCache::save() {
  const std::lock_guard guard(mutex_);
  if (!is_changed_) return;
  std::ostringstream text;
  for (const auto& [name, entry] : entries_) {
    text << entry.sha256;
    for (const std::int64_t number : entry.stamp) text << ' ' << number;
    text << ' ' << name << '\n';
  }
  try {
    files::write_whole(file_in(cell_), text.str());
  } catch (const OutputError&) {
    // it saves time only
  }
}

}  // namespace mbtfm::runner
