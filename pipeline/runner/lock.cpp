#include "pipeline/runner/lock.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "pipeline/contract/errors.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::runner {

LockFile::LockFile(const std::filesystem::path& cell) {
  const std::filesystem::path file = cell / ".mbtfm.lock";
  descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw OutputError("cannot write " + file.string() + ": " + std::strerror(errno));
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
  for (int i = 0; i < static_cast<int>(stages().size()); ++i) {
    if (!is_asked(stages()[i], only) || file_.lock(i, LockFile::IfTaken::give_up)) continue;
    throw CellBusy(cell.string() + ": another mbtfm works on it (" + stages()[i].name +
                   "); wait for it to end, or end it");
  }
}

void CellLock::share_with_programs() const { fcntl(file_.descriptor(), F_SETFD, 0); }

RunRecordLock::RunRecordLock(const std::filesystem::path& cell) : file_(cell) {
  file_.lock(static_cast<int>(stages().size()), LockFile::IfTaken::wait);
}

}  // namespace mbtfm::runner
