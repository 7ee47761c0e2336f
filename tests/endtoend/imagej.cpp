// A real ImageJ (Debian's `imagej`, under `xvfb-run`) reads what mbtfm writes, and mbtfm reads what it writes.

#include "pipeline/files/csv_files.h"
#include "segment/cells/ellipse.h"
#include "segment/rois/roi.h"
#include "tests/support/drawn_image.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

using rois::Roi;

bool has_imagej() { return std::system("command -v imagej xvfb-run > /dev/null") == 0; }

/// Run a macro; its output. ImageJ's exit code says nothing.
std::string run_macro(const fs::path& folder, const std::string& macro) {
  std::ofstream(folder / "macro.ijm") << macro << "\nrun('Quit');\n";
  const fs::path log = folder / "imagej.log";
  const std::string command = "timeout 120 xvfb-run -a imagej -b '" + (folder / "macro.ijm").string() + "' > '" +
                              log.string() + "' 2>&1 < /dev/null";
  [[maybe_unused]] const int ignored = std::system(command.c_str());
  return files::read_text(log);
}

struct Measured {
  std::string type, colour;
  double area = 0, length = 0;  ///< as ImageJ measures them, in px² and px
  Vec2 corner_px, size_px;      ///< of its box
  double shoelace = 0;          ///< area of the coordinates it gives, px²
  std::vector<Vec2> points_px;
};

/// Lines `name|type|colour|area|length|left top width height x1,y1 x2,y2 …` of a macro's table.
std::map<std::string, Measured> measured_in(const fs::path& table) {
  std::map<std::string, Measured> result;
  std::ifstream in(table);
  for (std::string line; std::getline(in, line);) {
    std::stringstream fields(line);
    std::string name, field;
    std::getline(fields, name, '|');
    Measured& m = result[name];
    std::getline(fields, m.type, '|');
    std::getline(fields, m.colour, '|');
    std::getline(fields, field, '|');
    m.area = std::stod(field);
    std::getline(fields, field, '|');
    m.length = std::stod(field);
    fields >> m.corner_px.x >> m.corner_px.y >> m.size_px.x >> m.size_px.y;
    for (std::string point; fields >> point;)
      m.points_px.push_back({std::stod(point), std::stod(point.substr(point.find(',') + 1))});
    m.shoelace = std::abs(signed_area_um2(m.points_px));
  }
  return result;
}

/// ImageJ measures areas by counting pixels: it is asked on a canvas on which the selection is some hundreds of pixels
/// wide.
std::string report_function() { return files::read_text(test::source_folder() / "tests/data/report.ijm"); }

using ImageJ = test::InFolder;

TEST_F(ImageJ, it_measures_the_areas_and_lengths_of_the_set_that_the_segmentation_writes) {
  if (!has_imagej()) GTEST_SKIP() << "imagej and xvfb-run are not installed";
  const test::DrawnScene scene = test::drawn_scene(10, 1);
  const double pixel_um = scene.kPixel_um;
  images::write_tiff(folder / "paxillin.tif", scene.adhesion_image);
  images::write_tiff(folder / "actin.tif", scene.actin_image);
  test::output_of("mbtfm-segment --pixel_size_um 0.1 --adhesion-image '" + (folder / "paxillin.tif").string() +
                  "' --actin-image '" + (folder / "actin.tif").string() + "' --out '" + folder.path().string() + "'");
  const fs::path table = folder / "measured";
  run_macro(folder.path(), report_function() + "roiManager('Open', '" + (folder / "RoiSet.zip").string() +
                               "');\nn = roiManager('count');\nfor (r = 0; r < n; r++) {\n" +
                               "  selectImage('image'); roiManager('select', r); report('" + table.string() + "');\n}");
  const Cell cell = files::read_cell(folder.path());
  std::map<std::string, Measured> by_name = measured_in(table);
  ASSERT_EQ(by_name.size(), 1 + cell.adhesions.size() + cell.fibres.size());
  ASSERT_GE(cell.adhesions.size(), 4u);
  ASSERT_GE(cell.fibres.size(), 2u);

  const Measured& outline = by_name["outline"];
  const double outline_px2 = std::abs(signed_area_um2(cell.outline_um)) / (pixel_um * pixel_um);
  EXPECT_NEAR(outline.area, outline_px2, 1e-3 * outline_px2);
  EXPECT_EQ(outline.type, "polygon");
  EXPECT_EQ(outline.colour, "#e1e1e1");
  for (const Adhesion& a : cell.adhesions) {
    const Measured& m = by_name["adhesion " + std::to_string(a.adhesion_id)];
    const double area_px2 = a.area_um2 / (pixel_um * pixel_um);
    // ImageJ draws an ellipse by 72 corners, which lack 1.3e-3 of its area
    EXPECT_NEAR(m.area, area_px2, 2.3e-3 * area_px2);
    EXPECT_NEAR(m.shoelace, area_px2, 2.3e-3 * area_px2);
    EXPECT_EQ(m.colour, "#ffaaeb");
    for (const Vec2 p : m.points_px) EXPECT_NEAR(cells::distance_to_ellipse_um(a, pixel_um * p), 0, 0.01 * pixel_um);
  }
  for (const Fibre& f : cell.fibres) {
    const Measured& m = by_name[std::string(name_of(f.type)) + " " + std::to_string(f.fibre_id)];
    const double length_px = length_um(f.points_um) / pixel_um;
    EXPECT_NEAR(m.length, length_px, 1e-4 * length_px);
    EXPECT_EQ(m.type, "polyline");
    ASSERT_EQ(m.points_px.size(), f.points_um.size());
    for (std::size_t i = 0; i < f.points_um.size(); ++i)
      EXPECT_NEAR(norm(pixel_um * (m.points_px[i] + Vec2{0.5, 0.5}) - f.points_um[i]), 0, 1e-4);
  }
}

TEST_F(ImageJ, a_line_it_profiles_lies_where_mbtfm_reads_it) {
  if (!has_imagej()) GTEST_SKIP() << "imagej and xvfb-run are not installed";
  // the grey value of a pixel is its column: a profile's first value tells where the line begins
  const std::string output = run_macro(folder.path(), R"(
newImage("ramp", "32-bit", 100, 80, 1);
run("Macro...", "code=v=x");
makeSelection("polyline", newArray(10.25, 30.5, 50.75), newArray(20, 20, 20)); p = getProfile();
saveAs("Selection", ")" + (folder / "a.roi").string() + R"("); print("begins", p[0]);)");
  const auto at = output.find("begins ");
  ASSERT_NE(at, std::string::npos) << output;
  const double centre_of_column = std::stod(output.substr(at + 7)) + 0.5;  // from the outer corner
  EXPECT_NEAR(rois::line_px(rois::read_rois(folder / "a.roi").front()).front().x, centre_of_column, 1e-3);
}

TEST_F(ImageJ, selections_it_saves_are_read_as_it_draws_them) {
  if (!has_imagej()) GTEST_SKIP() << "imagej and xvfb-run are not installed";
  const fs::path table = folder / "drawn";
  const std::string save = "save('";
  std::ostringstream macro;
  macro << report_function() << R"(
function save(name) { Roi.setName(name); saveAs("Selection", ")"
        << folder.path().string() << R"(/" + name + ".roi"); report(")" << table.string() << R"("); }
)";
  macro << files::read_text(test::source_folder() / "tests/data/selections.ijm");
  run_macro(folder.path(), macro.str());
  const auto drawn = measured_in(table);
  EXPECT_EQ(drawn.size(), 20u);
  for (const auto& [name, m] : drawn) {
    SCOPED_TRACE(name);
    const rois::Roi roi = rois::read_rois(folder / (name + ".roi")).front();
    EXPECT_EQ(roi.name, name);
    if (rois::is_line(roi.shape)) {
      const Polyline line = rois::line_px(roi);
      ASSERT_EQ(line.size(), m.points_px.size());
      for (std::size_t i = 0; i < line.size(); ++i)
        EXPECT_NEAR(norm(line[i] - m.points_px[i] - Vec2{0.5, 0.5}), 0, 1e-3);
      if (roi.shape != rois::RoiShape::freehand_line)  // which ImageJ smooths before it measures
        EXPECT_NEAR(length_um(line), m.length, 1e-4 * m.length);
      continue;
    }
    if (roi.shape == rois::RoiShape::composite) {  // ImageJ counts its pixels
      EXPECT_EQ(std::abs(signed_area_um2(rois::area_px(roi))), m.area);
      continue;
    }
    if (roi.shape == rois::RoiShape::oval) {  // which ImageJ widens to whole pixels before it draws and measures
      EXPECT_EQ(roi.corner_px, m.corner_px);
      EXPECT_EQ(roi.size_px, m.size_px);
      continue;
    }
    const Polygon area = rois::area_px(roi);
    const double found_px2 = std::abs(signed_area_um2(area));
    // ImageJ draws curves by straight steps: what lies between them and the curve is below a tenth of a pixel
    const bool is_round = name == "ellipse" || name == "rounded rectangle";
    EXPECT_NEAR(found_px2, m.shoelace, (is_round ? 3e-3 : 1e-5) * found_px2);
    for (const Vec2 p : m.points_px) EXPECT_LT(distance_to_boundary_um(area, p), is_round ? 0.1 : 1e-3);
  }
}

TEST_F(ImageJ, a_hyperstack_it_saves_is_read_by_channel_slice_and_frame) {
  if (!has_imagej()) GTEST_SKIP() << "imagej and xvfb-run are not installed";
  for (const char* bits : {"8", "16", "32"}) {
    const fs::path file = folder / (std::string(bits) + ".tif");
    run_macro(folder.path(), "newImage('h', '" + std::string(bits) + R"(-bit grayscale-mode', 20, 10, 2, 3, 4);
run("Properties...", "channels=2 slices=3 frames=4 unit=micron pixel_width=0.125 pixel_height=0.125 voxel_depth=1");
for (c = 1; c <= 2; c++) for (z = 1; z <= 3; z++) for (t = 1; t <= 4; t++)
  Stack.setPosition(c, z, t); run("Set...", "value=" + (100 * (c - 1) + 10 * z + t) + " slice");
saveAs("Tiff", ")" + file.string() +
                                 R"(");)");
    for (int c = 1; c <= 2; ++c)
      for (int z = 1; z <= 3; ++z)
        for (int t = 1; t <= 4; ++t) {
          const images::Image image =
              images::read_image(file, {.channel = std::to_string(c), .z = std::to_string(z), .time = t});
          EXPECT_EQ(image.pixels, std::vector<float>(200, static_cast<float>(100 * (c - 1) + 10 * z + t)));
          EXPECT_EQ(image.pixel_size_um, 0.125);
        }
  }
}

}  // namespace
}  // namespace mbtfm
