#include <zip.h>

#include <fstream>
#include <memory>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/path.h"
#include "segment/rois/roi.h"

namespace mbtfm::rois {
namespace {

constexpr std::size_t kLargestRoi = 1u << 24;   // bytes: a million points, beyond anything drawn
constexpr std::size_t kLargestSet = 1u << 28;   // bytes of all ROIs together
constexpr std::size_t kMostRois = 1u << 16;     // beyond anything drawn; each may be drawn with 360 corners
constexpr double kLongestSplines_px = 1 << 24;  // of all ROIs together: a point every two pixels
constexpr const char* kExpected = "an ImageJ ROI (.roi) or a set of them (.zip)";

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using Archive = std::unique_ptr<zip_t, Discard>;
using Entry = std::unique_ptr<zip_file_t, Discard>;

std::string message_of(int code) {
  zip_error_t error;
  zip_error_init_with_code(&error, code);
  std::string message = zip_error_strerror(&error);
  zip_error_fini(&error);
  return message;
}

[[noreturn]] void refuse_damaged(const std::string& where, const std::string& found) {
  throw InputError(where, "a whole zip of ImageJ ROIs", found,
                   "it may be truncated: save it again from the ROI manager");
}

/// The bytes of an entry. The size that the zip claims is not believed: it is read up to the limit.
std::string bytes_of(zip_t* archive, zip_uint64_t index, const std::string& where) {
  const Entry entry(zip_fopen_index(archive, index, 0));
  if (!entry) refuse_damaged(where, zip_strerror(archive));
  std::string bytes;
  std::string part(1u << 16, '\0');
  for (;;) {
    const zip_int64_t n = zip_fread(entry.get(), part.data(), part.size());
    if (n < 0) refuse_damaged(where, zip_file_strerror(entry.get()));
    if (n == 0) return bytes;
    bytes.append(part, 0, static_cast<std::size_t>(n));
    if (bytes.size() > kLargestRoi) refuse_damaged(where, "more than " + std::to_string(kLargestRoi) + " bytes in it");
  }
}

std::vector<Roi> read_zip(const fs::path& file) {
  int code = 0;
  const Archive archive(zip_open(file.c_str(), ZIP_RDONLY, &code));
  if (!archive) refuse_damaged(file.string(), message_of(code));
  std::vector<Roi> rois;
  std::size_t n_bytes = 0;
  double splines_px = 0;
  const zip_int64_t n_entries = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < n_entries; ++i) {
    const auto index = static_cast<zip_uint64_t>(i);
    const char* raw_name = zip_get_name(archive.get(), index, ZIP_FL_ENC_GUESS);
    const fs::path name = raw_name ? raw_name : "";
    // what else is there, macOS' resource files among it, is none of ours
    if ((name.extension() != ".roi" && name.extension() != ".ROI") || name.string().starts_with("__MACOSX") ||
        name.filename().string().starts_with("._"))
      continue;
    const std::string where = file.string() + ": " + name.string();
    const std::string bytes = bytes_of(archive.get(), index, where);
    n_bytes += bytes.size();
    if (n_bytes > kLargestSet)
      refuse_damaged(file.string(), "more than " + std::to_string(kLargestSet) + " bytes in it");
    rois.push_back(decode_roi(bytes, where));
    if (rois.size() > kMostRois)
      refuse_damaged(file.string(), "more than " + std::to_string(kMostRois) + " ROIs in it");
    if (rois.back().is_spline) splines_px += length_um(rois.back().points_px);
    if (splines_px > kLongestSplines_px)
      refuse_damaged(file.string(), "splines of " + brief(splines_px) + " pixels in it");
    if (rois.back().name.empty()) rois.back().name = name.stem().string();
  }
  if (rois.empty())
    throw InputError(file.string(), kExpected, "a zip archive without a .roi in it",
                     "in ImageJ's ROI manager: More > Save");
  return rois;
}

void expect_distinct_names(const std::vector<Roi>& rois) {
  MBTFM_ASSERT(!rois.empty());
  std::set<std::string> names;
  for (const Roi& roi : rois) MBTFM_ASSERT(!roi.name.empty() && names.insert(roi.name).second);
}

}  // namespace

std::vector<Roi> read_rois(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) throw InputError(file.string(), kExpected, fs::is_directory(file) ? "a folder" : "no such file");
  std::ifstream stream(file, std::ios::binary);
  std::string head(4, '\0');
  stream.read(head.data(), 4);
  if (!stream) throw InputError(file.string(), kExpected, std::to_string(size) + " bytes that could be read");
  if (head.starts_with("PK")) return read_zip(file);
  if (head != "Iout")
    throw InputError(file.string(), kExpected, "bytes of neither",
                     "save the selection in ImageJ, to which File > Import > XY Coordinates brings a list of points; "
                     "from other programs export a mask (images.outline_mask, images.adhesion_mask)");
  if (size > kLargestRoi) throw InputError(file.string(), kExpected, "a file of " + std::to_string(size) + " bytes");
  const std::string bytes = head + std::string((std::istreambuf_iterator<char>(stream)), {});
  Roi roi = decode_roi(bytes, file.string());
  if (roi.name.empty()) roi.name = file.stem().string();
  return {roi};
}

void write_roi_set(const fs::path& file, const std::vector<Roi>& rois) {
  expect_distinct_names(rois);
  const auto require = [&](bool is_done, const std::string& why) {
    if (!is_done) throw OutputError(file.string() + ": cannot be written: " + why);
  };
  std::vector<std::string> bytes;  // the archive reads them when it is closed
  for (const Roi& roi : rois) bytes.push_back(encode_roi(roi));
  int code = 0;
  Archive archive(zip_open(file.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
  require(archive != nullptr, message_of(code));
  constexpr zip_uint16_t kMidnight = 0, kFirstDay = 1 << 5 | 1;  // 1 January 1980: no clock in the bytes
  for (std::size_t i = 0; i < rois.size(); ++i) {
    zip_source_t* source = zip_source_buffer(archive.get(), bytes[i].data(), bytes[i].size(), 0);
    require(source != nullptr, zip_strerror(archive.get()));
    const zip_int64_t index = zip_file_add(archive.get(), (rois[i].name + ".roi").c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) zip_source_free(source);
    require(index >= 0 &&
                zip_file_set_dostime(archive.get(), static_cast<zip_uint64_t>(index), kMidnight, kFirstDay, 0) == 0,
            zip_strerror(archive.get()));
  }
  require(zip_close(archive.get()) == 0, zip_strerror(archive.get()));
  archive.release();  // closed: nothing is left to discard
}

}  // namespace mbtfm::rois
