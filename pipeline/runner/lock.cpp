#include "pipeline/runner/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "pipeline/contract/errors.h"

namespace mbtfm::runner {

FolderLock::FolderLock(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / ".mbtfm.lock";
  descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw OutputError("cannot write " + file.string() + ": " + std::strerror(errno));
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    close(descriptor_);
    throw InputError(folder.string(), "a cell folder that no other mbtfm works on", "one that is locked",
                     "wait for the other run to end, or end it");
  }
}

FolderLock::~FolderLock() { close(descriptor_); }

}  // namespace mbtfm::runner
