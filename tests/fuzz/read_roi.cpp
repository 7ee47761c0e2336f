/// ImageJ's selections, alone and in a zip, until they are outline, adhesions and fibres.
#include "segment/cells/hand_drawn.h"
#include "segment/rois/roi.h"
#include "tests/fuzz/target.h"
#include "tests/support/folders.h"

namespace mbtfm::fuzz::roi_readers {
namespace {

std::vector<std::string> samples() {
  using rois::Roi;
  using rois::RoiShape;
  rois::Roi polyline;
  polyline.shape = rois::RoiShape::polyline;
  polyline.name = "ventral 1";
  for (int i = 0; i < 12; ++i) polyline.points_px.push_back({10.0 + 9 * i, 20 + 0.5 * i * i});
  rois::Roi polygon = polyline;
  polygon.shape = rois::RoiShape::polygon;
  polygon.name = "outline";
  rois::Roi ellipse = polyline;
  ellipse.shape = rois::RoiShape::ellipse;
  ellipse.name = "adhesion 1";
  ellipse.points_px.resize(2);
  ellipse.aspect_ratio = 0.4;
  std::vector<std::string> files;
  for (const rois::Roi& roi : {polyline, polygon, ellipse}) files.push_back(rois::encode_roi(roi));
  constexpr std::size_t kType = 6, kOptions = 51;
  for (const char type : {1, 2, 3, 7, 8, 9, 10}) {  // the shapes that are only read
    std::string other = files[1];
    other[kType] = type;
    files.push_back(other);
  }
  for (const std::size_t k : {0, 1}) {
    std::string spline = files[k];
    spline[kOptions] = static_cast<char>(spline[kOptions] | 1);
    files.push_back(spline);
  }
  put("whole.zip", "");
  std::filesystem::remove(folder() / "whole.zip");
  rois::write_roi_set(folder() / "whole.zip", {polyline, polygon, ellipse});
  files.push_back(bytes_of(folder() / "whole.zip"));
  std::set<std::filesystem::path> others;  // of other programs, where they are at hand
  const auto shared = test::source_folder().parent_path() / "shared/data/roi";
  if (std::filesystem::exists(shared))
    for (const auto& entry : std::filesystem::recursive_directory_iterator(shared))
      if (entry.path().extension() == ".roi") others.insert(entry.path());
  for (const auto& file : others) files.push_back(bytes_of(file));
  return files;
}

void read(std::string_view bytes) {
  using namespace mbtfm::cells;
  const auto file = fuzz::put("input", bytes);
  fuzz::answer([&] {
    const cells::RoiSet set{.name = "input", .rois = rois::read_rois(file)};
    const cells::Field field{.width_px = 512, .height_px = 400, .pixel_um = 0.1};
    fuzz::answer([&] { cells::hand_drawn_outline(set, field); });
    std::vector<Adhesion> adhesions;
    fuzz::answer([&] { adhesions = cells::hand_drawn_adhesions(set, {}, field); });
    const cells::CellOutline cell{.outer_um = {{0, 0}, {50, 0}, {50, 40}}};
    fuzz::answer([&] { cells::hold_fibres(cells::drawn_lines(set, {}, field, {}), adhesions, cell, {}, 1); });
    for (const rois::Roi& roi : set.rois) {
      if (rois::is_area(roi.shape)) rois::area_px(roi);
      if (rois::is_line(roi.shape)) rois::line_px(roi);
      binned(roi, 2);
    }
  });
}

const bool is_added = add({"roi", 20000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::roi_readers
