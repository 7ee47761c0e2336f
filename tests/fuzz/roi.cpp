#include "segment/rois/roi.h"
#include "tests/fuzz/target.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::rois {
namespace {

using fuzz::bytes_of;
using fuzz::put;

/// Reads bytes as a file would be, and draws what was read; an InputError is the only thing that may be thrown.
bool is_read(const fs::path& file) {
  return !test::caught<InputError>([&] {
    for (const Roi& roi : read_rois(file)) {
      if (is_area(roi.shape)) area_px(roi);
      if (is_line(roi.shape)) line_px(roi);
    }
  });
}

/// Our own of each kind, and all that other programs wrote where they are at hand.
std::vector<std::string> samples(const fs::path& folder) {
  std::vector<std::string> result;
  Roi roi;
  roi.name = "ventral 1";
  roi.shape = RoiShape::polyline;
  for (int i = 0; i < 40; ++i) roi.points_px.push_back({10.0 + i, 20 + 0.5 * i * i});
  result.push_back(encode_roi(roi));
  std::vector<Roi> set = {roi};
  roi.name = "adhesion 1";
  roi.shape = RoiShape::ellipse;
  roi.points_px.resize(2);
  roi.aspect_ratio = 0.4;
  result.push_back(encode_roi(roi));
  set.push_back(roi);
  write_roi_set(folder / "set.zip", set);
  result.push_back(bytes_of(folder / "set.zip"));
  const fs::path shared = test::source_folder().parent_path() / "shared/data/roi";
  if (!fs::exists(shared)) return result;
  for (const auto& entry : fs::recursive_directory_iterator(shared))
    if (entry.path().extension() == ".roi") result.push_back(bytes_of(entry.path()));
  return result;
}

TEST(RoiFuzz, a_truncated_set_or_geometry_is_an_input_error_at_every_length) {
  const test::TemporaryFolder folder;
  for (const std::string& whole : samples(folder.path())) {
    const bool is_zip = whole.starts_with("PK");
    for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 200) {
      // a .roi may lose what follows the second header (names, properties) and still be whole
      const bool is_read_now = is_read(put("cut", whole.substr(0, length)));
      if (is_zip || length < 64) EXPECT_FALSE(is_read_now) << length << " of " << whole.size() << " bytes";
    }
  }
}

TEST(RoiFuzz, counts_beyond_the_bytes_take_no_memory) {
  const test::TemporaryFolder folder;
  std::string bytes = samples(folder.path()).front();
  for (const std::size_t at : {16u, 18u, 60u}) {  // points, points beyond 65535, place of the second header
    std::string changed = bytes;
    if (at == 18) changed[16] = changed[17] = 0;
    changed.replace(at, at == 16 ? 2 : 4, at == 16 ? 2 : 4, '\x7F');
    EXPECT_FALSE(is_read(put("changed", changed))) << at;
  }
}

}  // namespace
}  // namespace mbtfm::rois
