#include <fcntl.h>
#include <unistd.h>

#include "tests/fuzz/target.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::fuzz {

std::vector<Target>& targets() {
  static std::vector<Target> all;
  return all;
}

const fs::path& folder() {
  static const test::TemporaryFolder made = [] {
    if (fs::is_directory("/dev/shm")) setenv("TMPDIR", "/dev/shm", 1);
    return test::TemporaryFolder();
  }();
  return made.path();
}

fs::path put(const std::string& name, std::string_view bytes) {
  const fs::path file = folder() / name;
  int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) {
    fs::create_directories(file.parent_path());
    descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  }
  const bool is_written = descriptor >= 0 && write(descriptor, bytes.data(), bytes.size()) == ssize_t(bytes.size());
  if (descriptor >= 0) close(descriptor);
  if (!is_written) throw std::runtime_error("cannot write " + file.string());
  return file;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {(std::istreambuf_iterator<char>(in)), {}};
}

}  // namespace mbtfm::fuzz
