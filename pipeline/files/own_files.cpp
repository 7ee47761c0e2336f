#include "pipeline/files/own_files.h"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>

#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"

namespace mbtfm::files {
namespace {

/// Of the file itself, links not followed; `none` where it cannot be looked at.
fs::file_type type_of(const fs::path& file) {
  std::error_code ignored;
  return fs::symlink_status(file, ignored).type();
}

constexpr const char* kNoLinks = "copy what it points to there, or remove it";

std::string target_of(const fs::path& link) {
  std::error_code error;
  const fs::path target = fs::read_symlink(link, error);
  return error ? std::string("a link") : "a link to " + target.string();
}

void check_own_folder(const fs::path& folder) {
  const fs::file_type type = type_of(folder);
  if (type == fs::file_type::not_found) return;
  if (type == fs::file_type::symlink)
    throw InputError(folder.string(), "a folder of the cell's own", target_of(folder), kNoLinks);
  if (type != fs::file_type::directory) throw InputError(folder.string(), "a folder", "a file", "remove it");
  std::error_code error, is_gone;  // an entry that another run has just renamed
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::file_type its = entry->symlink_status(is_gone).type();
    if (its == fs::file_type::regular || its == fs::file_type::directory || is_gone) continue;
    if (its == fs::file_type::symlink)
      throw InputError(entry->path().string(), "a file of the cell's own", target_of(entry->path()), kNoLinks);
    throw InputError(entry->path().string(), "a file", "a pipe, a socket or a device", "remove it");
  }
  if (error && error != std::errc::no_such_file_or_directory)
    throw InputError(folder.string(), "a folder that can be read", error.message());
}

[[noreturn]] void refuse_device(const fs::path& file) {
  throw OutputError("cannot replace " + file.string() + ": a device is there; write into a folder");
}

}  // namespace

bool is_file(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored);
}

bool is_folder(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_directory(folder, ignored);
}

bool is_own_folder(const fs::path& folder) { return type_of(folder) == fs::file_type::directory; }

bool is_own_file(const fs::path& file) { return type_of(file) == fs::file_type::regular; }

bool is_own_text(const fs::path& file) {
  std::error_code error;
  return is_own_file(file) && fs::file_size(file, error) <= kLargestText_bytes;
}

void expect_no_hole(const fs::path& file) {
  constexpr std::uintmax_t kBlock_bytes = 512;      // of st_blocks, whatever the file system's own are
  constexpr std::uintmax_t kDensest_packing = 100;  // file systems that compress pack texts to a tenth
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return;  // reading reports why
  const auto size = static_cast<std::uintmax_t>(status.st_size);
  const auto taken = kBlock_bytes * static_cast<std::uintmax_t>(status.st_blocks);
  if (!S_ISREG(status.st_mode) || size <= kLargestText_bytes || taken >= size / kDensest_packing) return;
  throw InputError(file.string(), "a file of data", "a hole of " + std::to_string(size) + " bytes", "remove it");
}

fs::path inside(const fs::path& folder, const fs::path& name, const std::string& named_by) {
  const auto refuse = [&](const std::string& found) {
    throw InputError(named_by, "names of files inside of " + folder.string(), found,
                     "remove the file if it is not yours");
  };
  const std::string text = name.string();
  if (text.empty() || text.find('\0') != std::string::npos) refuse("a name that is none");
  if (name.is_absolute()) refuse("'" + text + "'");
  fs::path place = folder;
  for (const fs::path& part : name) {
    if (part == "..") refuse("'" + text + "'");
    place /= part;
    if (type_of(place) == fs::file_type::symlink) refuse("'" + text + "', which leads through " + target_of(place));
  }
  return folder / name;
}

void check_cell_folder(const fs::path& cell) {
  for (const char* folder :
       {"1_segment", "2_track", "3_network", "3_sheet", "3_surface", "4_fit", "4_traction", "truth"})
    check_own_folder(cell / folder);
}

void make_way(const fs::path& file) {
  std::error_code error;
  switch (type_of(file)) {
    case fs::file_type::directory:
      throw OutputError("cannot write " + file.string() + ": a folder of that name is there");
    case fs::file_type::not_found:
    case fs::file_type::character:
    case fs::file_type::none:  // opening it reports why
      return;
    case fs::file_type::regular:
      if (fs::hard_link_count(file, error) < 2) return;
      break;
    case fs::file_type::block:
      refuse_device(file);
    default:
      break;
  }
  fs::remove(file, error);
  if (error) throw OutputError("cannot replace " + file.string() + ": " + error.message());
}

std::string kind_of_file(const fs::path& file) {
  constexpr std::size_t kBeginning = 4096, kSignature = 4, kWord = 20;  // study.R: "# Repeats the tables"
  std::string text(kBeginning, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  const std::string line = text.substr(0, text.find_first_of("\r\n"));
  const bool is_text =
      is_utf8(line) && std::ranges::none_of(line, [](char c) { return c >= 0 && c < ' ' && c != '\t'; });
  if (!is_text) return text.substr(0, kSignature);
  if (line.starts_with("<!DOCTYPE")) return text.find("mbtfm</title>") == text.npos ? "a page" : kOwnPage;
  const char* const ends = line.starts_with('<') ? " >" : line.starts_with('{') ? "\"" : ",";
  return line.substr(0, line.find_first_of(ends)).substr(0, kWord);
}

void expect_own_kind(const fs::path& file, const std::string& kind) {
  std::error_code error;
  if (type_of(file) != fs::file_type::regular || is_hidden(file) || fs::file_size(file, error) == 0) return;
  if (kind_of_file(file) == kind) return;
  throw OutputError(file.string() +
                    " is there, and mbtfm did not make it: nothing is written over it; move it to another place, or "
                    "choose another name for the output");
}

void put_in_place(const fs::path& temporary, const fs::path& file) {
  const fs::file_type type = type_of(file);  // as root, a rename would take /dev/null away from the whole machine
  if (type == fs::file_type::character || type == fs::file_type::block) refuse_device(file);
  expect_own_kind(file, kind_of_file(temporary));
  std::error_code error;
  fs::rename(temporary, file, error);
  if (error) throw OutputError("cannot put " + file.string() + " in place: " + error.message());
}

}  // namespace mbtfm::files
