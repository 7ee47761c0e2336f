/// ImageJ's selections, alone and in a zip, until they are outline, adhesions and fibres.
#include "segment/roi.h"

#include "segment/hand_drawn.h"
#include "tests/fuzz/target.h"

namespace mbtfm::fuzz {

const char* const kFamily = "roi";
const int kInputs = 40000;

std::vector<std::string> samples() {
  using segment::Roi;
  using segment::RoiShape;
  Roi polyline;
  polyline.shape = RoiShape::polyline;
  polyline.name = "ventral 1";
  for (int i = 0; i < 12; ++i) polyline.points_px.push_back({10.0 + 9 * i, 20 + 0.5 * i * i});
  Roi polygon = polyline;
  polygon.shape = RoiShape::polygon;
  polygon.name = "outline";
  Roi ellipse = polyline;
  ellipse.shape = RoiShape::ellipse;
  ellipse.name = "adhesion 1";
  ellipse.points_px.resize(2);
  ellipse.aspect_ratio = 0.4;
  std::vector<std::string> files;
  for (const Roi& roi : {polyline, polygon, ellipse}) files.push_back(encode_roi(roi));
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
  segment::write_roi_set(folder() / "whole.zip", {polyline, polygon, ellipse});
  files.push_back(bytes_of(folder() / "whole.zip"));
  return files;
}

}  // namespace mbtfm::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t n) {
  using namespace mbtfm;
  using namespace mbtfm::segment;
  const auto file = fuzz::put("input", fuzz::text_of(bytes, n));
  fuzz::answer([&] {
    const RoiSet set{.name = "input", .rois = read_rois(file)};
    const Field field{.width_px = 512, .height_px = 400, .pixel_um = 0.1};
    fuzz::answer([&] { hand_drawn_outline(set, field); });
    std::vector<Adhesion> adhesions;
    fuzz::answer([&] { adhesions = hand_drawn_adhesions(set, {}, field); });
    const CellOutline cell{.outer_um = {{0, 0}, {50, 0}, {50, 40}}, .holes_um = {}};
    fuzz::answer([&] { hold_fibres(drawn_lines(set, {}, field, {}), adhesions, cell, {}, 1); });
    for (const Roi& roi : set.rois) {
      if (is_area(roi.shape)) area_px(roi);
      if (is_line(roi.shape)) line_px(roi);
      binned(roi, 2);
    }
  });
  return 0;
}
