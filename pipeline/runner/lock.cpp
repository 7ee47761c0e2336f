#include "pipeline/runner/lock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "pipeline/contract/errors.h"
#include "pipeline/runner/cell_stages.h"

namespace mbtfm::runner {

LockFile::LockFile(const std::filesystem::path& cell) {
  const std::filesystem::path file = cell / ".mbtfm.lock";
  // Not replaced where it is a link, as other outputs are: another run may just have replaced it, and hold the new one.
  descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
  const int error = errno;
  struct stat status {};
  if (lstat(file.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    if (descriptor_ >= 0) close(descriptor_);
    throw InputError(file.string(), "a lock file", "a link, a folder or a pipe", "remove it");
  }
  if (descriptor_ < 0) throw OutputError("cannot write " + file.string() + ": " + std::strerror(error));
}

LockFile::~LockFile() { close(descriptor_); }

bool LockFile::lock(int byte, IfTaken if_taken) const {
  struct flock place {};
  place.l_type = F_WRLCK;
  place.l_whence = SEEK_SET;
  place.l_start = byte;
  place.l_len = 1;
  while (fcntl(descriptor_, if_taken == IfTaken::wait ? F_OFD_SETLKW : F_OFD_SETLK, &place) != 0) {
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == EACCES) return false;
    throw OutputError(std::string("cannot lock .mbtfm.lock: ") + std::strerror(errno));
  }
  return true;
}

CellLock::CellLock(const std::filesystem::path& cell, const std::vector<std::string>& only) : file_(cell) {
  for (int i = 0; i < static_cast<int>(all_stages().size()); ++i) {
    if (!is_asked(all_stages()[i], only) || file_.lock(i, LockFile::IfTaken::give_up)) continue;
    throw CellBusy(cell.string() + ": another mbtfm works on it (" + all_stages()[i].name +
                   "); wait for it to end, or end it");
  }
}

void CellLock::share_with_programs() const { fcntl(file_.descriptor(), F_SETFD, 0); }

RunRecordLock::RunRecordLock(const std::filesystem::path& cell) : file_(cell) {
  file_.lock(static_cast<int>(all_stages().size()), LockFile::IfTaken::wait);
}

}  // namespace mbtfm::runner
