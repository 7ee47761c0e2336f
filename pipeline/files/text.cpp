#include "pipeline/files/text.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/files/own_files.h"

namespace mbtfm::files {

namespace {

/// Of a pipe or a device, which may have no end.
std::string read_stream(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string(), "a readable file", std::strerror(errno));
  std::string text;
  std::vector<char> block(1 << 16);
  while (stream) {
    stream.read(block.data(), static_cast<std::streamsize>(block.size()));
    text.append(block.data(), static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kLargestText_bytes)
      throw InputError(file.string(), "a file", "more than 256 MB from a pipe or a device");
  }
  return text;
}

}  // namespace

std::string read_text(const std::filesystem::path& file) {
  if (is_folder(file)) throw InputError(file.string(), "a file", "a folder", "name the file in it");
  std::error_code unreachable;
  if (!std::filesystem::exists(file, unreachable))
    throw InputError(file.string(), "a file", unreachable ? unreachable.message() : "none of that name");
  if (!is_file(file)) return read_stream(file);
  expect_no_hole(file);
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) {
    if (std::filesystem::file_size(file) == 0) return {};
    throw InputError(file.string(), "a readable file", std::strerror(errno));
  }
  return std::move(text).str();
}

void write_text(const std::filesystem::path& file, std::string_view text) {
  make_way(file);
  errno = 0;
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) throw OutputError("cannot write " + file.string() + ": " + std::strerror(errno ? errno : EIO));
}

std::filesystem::path temporary_name(const std::filesystem::path& file) {
  return file.parent_path() / (std::string(kPartialPrefix) + std::to_string(getpid()) + "-" + file.filename().string());
}

void write_whole(const std::filesystem::path& file, std::string_view text) {
  const std::filesystem::path temporary = temporary_name(file);
  try {
    write_text(temporary, text);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
  put_in_place(temporary, file);
}

}  // namespace mbtfm::files
