/// A folder that lives as long as the test.
#pragma once

#include <unistd.h>
#include <system_error>

#include "tests/support/test.h"

namespace mbtfm::test {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "mbtfm-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::filesystem::filesystem_error("mkdtemp", name, {});
    path_ = name;
  }
  ~TemporaryFolder() {
    // what a stopped program's children write meanwhile makes it fail
    std::error_code error;
    for (int attempt = 0; attempt < 100; ++attempt) {
      std::filesystem::remove_all(path_, error);
      if (!error) return;
      usleep(10000);
    }
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// For cases that write files: each has a folder of its own. `using Suite = test::InFolder;`
class InFolder : public testing::Test {
 protected:
  const TemporaryFolder folder;
};

}  // namespace mbtfm::test

namespace mbtfm {

using test::TemporaryFolder;

}  // namespace mbtfm
