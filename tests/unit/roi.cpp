#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/files/text.h"
#include "segment/rois/roi.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::rois {
namespace {

using nlohmann::json;

constexpr double kFloat = 1e-4;  // px: half of a float's spacing below 2048 px

Roi polygon(const std::string& name, std::vector<Vec2> points_px) {
  Roi roi;
  roi.name = name;
  roi.points_px = std::move(points_px);
  return roi;
}

void expect_equal(const std::vector<Vec2>& found, const std::vector<Vec2>& expected, double tolerance_px) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i].x, expected[i].x, tolerance_px) << i;
    EXPECT_NEAR(found[i].y, expected[i].y, tolerance_px) << i;
  }
}

TEST(Roi, a_written_roi_comes_back) {
  Roi roi = polygon("adhesion 12", {{10.25, 20.5}, {1300.125, 40.75}, {-3.5, 900.625}});
  roi.group = 3;
  roi.stroke_argb = 0xFF00D68F;
  roi.stroke_width_px = 2.5;
  for (const RoiShape shape : {RoiShape::polygon, RoiShape::polyline}) {
    roi.shape = shape;
    const Roi back = decode_roi(encode_roi(roi), "here");
    EXPECT_EQ(back.shape, shape);
    EXPECT_EQ(back.name, roi.name);
    EXPECT_EQ(back.group, roi.group);
    EXPECT_EQ(back.stroke_argb, roi.stroke_argb);
    EXPECT_EQ(back.stroke_width_px, roi.stroke_width_px);
    expect_equal(back.points_px, roi.points_px, 0);  // eighths of a pixel are floats
  }
  roi.shape = RoiShape::ellipse;
  roi.points_px.resize(2);
  roi.aspect_ratio = 0.375;
  const Roi back = decode_roi(encode_roi(roi), "here");
  EXPECT_EQ(back.shape, RoiShape::ellipse);
  EXPECT_EQ(back.aspect_ratio, 0.375);
  expect_equal(back.points_px, roi.points_px, 0);
}

TEST(Roi, a_set_comes_back_in_its_order_and_its_bytes_depend_on_the_rois_alone) {
  const test::TemporaryFolder folder;
  const std::vector<Roi> rois = {polygon("outline", {{0, 0}, {9, 0}, {9, 9}}), polygon("b", {{1, 1}, {2, 1}, {2, 3}}),
                                 polygon("a 1", {{4, 4}, {5, 4}, {5, 5}})};
  write_roi_set(folder / "1.zip", rois);
  write_roi_set(folder / "2.zip", rois);
  EXPECT_EQ(files::read_text(folder / "1.zip"), files::read_text(folder / "2.zip"));
  const std::vector<Roi> back = read_rois(folder / "1.zip");
  ASSERT_EQ(back.size(), rois.size());
  for (std::size_t i = 0; i < rois.size(); ++i) {
    EXPECT_EQ(back[i].name, rois[i].name);
    expect_equal(back[i].points_px, rois[i].points_px, 0);
  }
}

TEST(Roi, a_set_has_names_in_capitals_too_and_one_without_any_says_how_to_save_it) {
  const test::TemporaryFolder folder;
  write_roi_set(folder / "a.zip", {polygon("b", {{1, 1}, {2, 1}, {2, 3}})});
  std::string bytes = files::read_text(folder / "a.zip");
  for (std::size_t at = 0; (at = bytes.find("b.roi", at)) != bytes.npos; ++at) bytes.replace(at, 5, "B.ROI");
  files::write_text(folder / "capitals.zip", bytes);
  EXPECT_EQ(read_rois(folder / "capitals.zip").size(), 1u);
  for (std::size_t at = 0; (at = bytes.find("B.ROI", at)) != bytes.npos; ++at) bytes.replace(at, 5, "B.tif");
  files::write_text(folder / "others.zip", bytes);
  EXPECT_TRUE(has_words(test::thrown<InputError>([&] { read_rois(folder / "others.zip"); }).hint, "More > Save"));
}

TEST(Roi, a_set_that_cannot_be_written_is_an_output_error) {
  EXPECT_THROW(write_roi_set("/nowhere/RoiSet.zip", {polygon("a", {{0, 0}, {1, 0}, {1, 1}})}), OutputError);
}

TEST(Roi, lines_count_from_pixel_centres_and_areas_from_their_corners) {
  Roi roi = polygon("", {{10, 20}, {30, 20}, {30, 40}});
  expect_equal(area_px(roi), roi.points_px, 0);
  roi.shape = RoiShape::polyline;
  expect_equal(line_px(roi), {{10.5, 20.5}, {30.5, 20.5}, {30.5, 40.5}}, 0);
}

TEST(Roi, lies_at_the_same_place_on_a_binned_image) {
  Roi roi = polygon("", {{10, 20}, {30, 20}, {30, 44}});
  const Polygon area = area_px(roi), reduced = area_px(binned(roi, 4));
  roi.shape = RoiShape::polyline;
  const Polyline line = line_px(roi), reduced_line = line_px(binned(roi, 4));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(4 * reduced[i], area[i]);
    EXPECT_EQ(4 * reduced_line[i], line[i]);
  }
}

TEST(Roi, round_areas_are_those_of_their_formulas) {
  Roi roi;
  roi.shape = RoiShape::oval;
  roi.corner_px = {3, 4};
  roi.size_px = {30, 18};
  // a polygon of n corners on an ellipse lacks (1 - sin(2 pi/n) / (2 pi/n)) of its area: 5e-5 of 360 corners
  EXPECT_NEAR(signed_area_um2(area_px(roi)), std::numbers::pi / 4 * 30 * 18, 6e-5 * 424);
  roi.shape = RoiShape::ellipse;
  roi.points_px = {{10, 10}, {40, 50}};
  roi.aspect_ratio = 0.5;
  EXPECT_NEAR(signed_area_um2(area_px(roi)), std::numbers::pi / 4 * 50 * 25, 6e-5 * 982);
  roi.shape = RoiShape::rectangle;
  EXPECT_EQ(signed_area_um2(area_px(roi)), 30 * 18);
  roi.corner_diameter_px = 12;
  // 31 chords a quarter lack 4e-4 of the circle's area
  EXPECT_NEAR(signed_area_um2(area_px(roi)), 30 * 18 - (4 - std::numbers::pi) * 36, 5e-4 * 113);
}

TEST(Roi, a_spline_passes_its_nodes_and_turns_nowhere_sharply) {
  Roi roi = polygon("", {{10, 20}, {30, 40}, {50, 20}, {60, 70}});
  roi.shape = RoiShape::polyline;
  roi.is_spline = true;
  const Polyline curve = line_px(roi);
  for (const Vec2 node : roi.points_px) {
    double nearest = 1e9;
    for (const Vec2 p : curve) nearest = std::min(nearest, norm(p - node - Vec2{0.5, 0.5}));
    EXPECT_LT(nearest, 0.5 * length_um(curve) / 99);  // half of a step
  }
  for (std::size_t i = 1; i + 1 < curve.size(); ++i) {
    const Vec2 a = curve[i] - curve[i - 1], b = curve[i + 1] - curve[i];
    EXPECT_LT(std::abs(std::atan2(cross(a, b), dot(a, b))), 0.3) << i;
  }
}

TEST(Roi, a_spline_longer_than_any_image_is_refused_before_it_is_drawn) {
  constexpr std::size_t kOptions = 51;
  constexpr char kSpline = 1;
  const auto spline = [&](double reach_px) {
    std::string bytes = encode_roi(polygon("outline", {{0, 0}, {reach_px, 0}, {0, reach_px}, {reach_px, 1}}));
    bytes[kOptions] = static_cast<char>(bytes[kOptions] | kSpline);
    return bytes;
  };
  EXPECT_EQ(decode_roi(spline(3000), "here").points_px.size(), 4u);
  for (const double reach_px : {6e4, 1e7, 1e20, 3e38})
    EXPECT_THROW(decode_roi(spline(reach_px), "here"), InputError) << reach_px;
}

std::string error_of(const fs::path& file) {
  const auto error = test::caught<InputError>([&] { read_rois(file); });
  if (error) EXPECT_EQ(error->where.substr(0, file.string().size()), file.string());
  return error ? error->found : "no error";
}

TEST(Roi, what_is_no_roi_is_named_for_what_it_is) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(error_of(folder / "none.roi"), "no such file");
  EXPECT_EQ(error_of(folder.path()), "a folder");
  std::ofstream(folder / "text.roi") << "outline 1 2 3";
  EXPECT_EQ(error_of(folder / "text.roi"), "bytes of neither");
  std::ofstream(folder / "short.roi") << "Io";
  EXPECT_EQ(error_of(folder / "short.roi"), "2 bytes that could be read");
  std::ofstream(folder / "cut.roi") << "Iout and no more";
  EXPECT_EQ(error_of(folder / "cut.roi"), "only 16 bytes");
  std::ofstream(folder / "cut.zip") << "PK\x03\x04 and no more";
  EXPECT_NE(error_of(folder / "cut.zip"), "no error");
}

// ---- files that ImageJ wrote, and what other readers make of them

const fs::path kShared = test::source_folder().parent_path() / "shared/data/roi";

void expect_coordinates(const Roi& roi, const json& answer) {
  const auto number = [&](const char* key) { return answer.at(key).get<double>(); };
  if (answer.contains("left") && answer["type"] != "composite") {
    EXPECT_EQ(roi.corner_px, (Vec2{number("left"), number("top")}));
    EXPECT_EQ(roi.size_px, (Vec2{number("width"), number("height")}));
  } else if (answer.contains("ex1")) {
    EXPECT_EQ(roi.shape, RoiShape::ellipse);
    expect_equal(roi.points_px, {{number("ex1"), number("ey1")}, {number("ex2"), number("ey2")}}, 1e-3);
    EXPECT_NEAR(roi.aspect_ratio, number("aspect_ratio"), 1e-6);
  } else if (answer.contains("x")) {
    std::vector<Vec2> expected;
    for (std::size_t i = 0; i < answer["x"].size(); ++i) expected.push_back({answer["x"][i], answer["y"][i]});
    expect_equal(roi.points_px, expected, answer["x"][0].is_number_integer() ? 0 : 1e-3);
  } else {
    EXPECT_EQ(roi.shape, RoiShape::composite);
    ASSERT_EQ(roi.paths_px.size(), answer["paths"].size());
    for (std::size_t k = 0; k < roi.paths_px.size(); ++k) {
      std::vector<Vec2> expected;
      for (const json& point : answer["paths"][k]) expected.push_back({point[0], point[1]});
      expect_equal(roi.paths_px[k], expected, 1e-3);
    }
  }
}

TEST(Roi, files_of_imagej_are_read_as_another_reader_does) {
  if (!fs::exists(kShared)) GTEST_SKIP() << "the ROIs of other programs are not here";
  int n_compared = 0;
  for (const auto& entry : fs::directory_iterator(kShared / "read_roi")) {
    if (entry.path().extension() != ".json") continue;
    SCOPED_TRACE(entry.path().stem().string());
    const json whole = json::parse(files::read_text(entry.path()));
    const json& answer = whole.begin().value();
    const std::vector<Roi> rois = read_rois(fs::path(entry.path()).replace_extension(".roi"));
    ASSERT_EQ(rois.size(), 1u);
    expect_coordinates(rois[0], answer);
    ++n_compared;
  }
  EXPECT_GE(n_compared, 20);
}

TEST(Roi, holes_of_a_composite_are_not_of_its_area) {
  if (!fs::exists(kShared)) GTEST_SKIP() << "the ROIs of other programs are not here";
  const Polygon area = area_px(read_rois(kShared / "read_roi/composite-rect-in-rect.roi").front());
  EXPECT_DOUBLE_EQ(std::abs(signed_area_um2(area)), 61 * 42 - 31 * 18);
  EXPECT_TRUE(contains(area, {45, 90}));
  EXPECT_FALSE(contains(area, {60, 90}));
  EXPECT_FALSE(contains(area, {30, 90}));
}

TEST(Roi, files_of_a_third_program_are_read_as_imagej_does) {
  if (!fs::exists(kShared)) GTEST_SKIP() << "the ROIs of other programs are not here";
  const auto read = [](const char* name) { return read_rois(kShared / "ijroi" / name).front(); };
  const std::vector<Vec2> triangle = {{1, 1}, {10, 10}, {10, 1}};
  expect_equal(read("polygon_integer.roi").points_px, triangle, 0);
  expect_equal(read("freehand_integer.roi").points_px, triangle, 0);
  expect_equal(area_px(read("integer_rectangle.roi")), {{4, 5}, {8, 5}, {8, 10}, {4, 10}}, 0);
  expect_equal(area_px(read("subpixel_rectangle.roi")), {{4, 5}, {8, 5}, {8, 10}, {4, 10}}, 0);
  expect_equal(area_px(read("unit_rectangle.roi")), {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 0);
  expect_equal(read("float_point.roi").points_px, {{123.4, 567.8}}, kFloat);
  expect_equal(read("int_point.roi").points_px, {{128, 256}}, 0);
  for (const char* name : {"polygon_circle.roi", "freehand_circle.roi"})
    for (const Vec2 p : read(name).points_px) EXPECT_NEAR(norm(p - Vec2{10, 15}), 1, kFloat) << name;
}

TEST(Roi, a_set_or_a_geometry_is_refused_wherever_it_is_cut) {
  const TemporaryFolder folder;
  Roi roi;
  roi.name = "ventral 1";
  roi.shape = RoiShape::polyline;
  for (int i = 0; i < 40; ++i) roi.points_px.push_back({10.0 + i, 20 + 0.5 * i * i});
  write_roi_set(folder / "set.zip", {roi});
  const std::string set = files::read_text(folder / "set.zip");
  // of a .roi alone what follows the second header may be lacking
  for (const auto& [name, whole] : {std::pair("cut.zip", set), {"cut.roi", encode_roi(roi).substr(0, 64)}})
    for (std::size_t n = 0; n < whole.size(); n += 1 + whole.size() / 100) {
      files::write_text(folder / name, whole.substr(0, n));
      EXPECT_NE(error_of(folder / name), "no error") << n << " of " << whole.size() << " bytes";
    }
}

}  // namespace
}  // namespace mbtfm::rois
