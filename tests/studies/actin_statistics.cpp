/// actin_statistics [scenario …]: what actin looks like in real cells (../shared/data) and in simulated ones (seeds 201
/// to 204, default: dense and u2os): fibres, haze, texture, nucleus. The program's own segmentation says where the
/// fibres are, in all of them alike. Lengths in um; brightness over the dark of the image.
#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/imgproc.hpp>

#include "pipeline/contract/polyline.h"
#include "pipeline/numerics/order_statistics.h"
#include "samples/drawing/geometry.h"
#include "segment/cells/fibre_profile.h"
#include "segment/cells/fibre_scales.h"
#include "segment/cells/fibre_significance.h"
#include "segment/cells/grid.h"
#include "segment/cells/ridge.h"
#include "segment/cells/trace.h"
#include "tests/support/segmentation_accuracy.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::cells;

struct Picture {
  std::string group, name;
  images::Image image;
  double pixel_um = 0.1;
  std::optional<drawing::Nucleus> nucleus{};  ///< of real cells where an eye sees it
};

/// An ellipse with its axes along the image's.
drawing::Nucleus ellipse(Vec2 centre_px, Vec2 radii_px, double pixel_um) {
  return {pixel_um * centre_px, {1, 0}, pixel_um * radii_px.x, pixel_um * radii_px.y};
}

constexpr double kFwhm = 2.3548;

/// By name; the order of the table is that of the names.
using Statistics = std::map<std::string, double>;

/// A picture, what is found in it and what its pixels are.
struct Scene {
  cv::Mat image;
  double pixel_um = 0.1;
  Cell cell;
  double dark = 0;
  cv::Mat is_inside, ground;  ///< CV_8U; brightness over the dark after a Gaussian of 3 um
  cv::Mat is_fibre;           ///< CV_8U: within 0.8 um of a fibre, where the filters' side lobes end
  double area_um2 = 0;
};

std::vector<cv::Point> in_pixels(const Polyline& line, double pixel_um) {
  std::vector<cv::Point> points;
  for (const Vec2 p : line) points.emplace_back(cells::to_pixels(p, pixel_um));
  return points;
}

Scene scene_of(const Picture& picture) {
  Scene s;
  s.image = cells::matrix_of(picture.image).clone();
  s.pixel_um = picture.pixel_um;
  cells::SegmentParameters p;
  p.pixel_size_um = picture.pixel_um;
  s.cell = cells::segment_cell({}, images::Channel{picture.name, picture.image}, p).cell;
  s.dark = cells::quantile(cells::gaussian(s.image, 1 / s.pixel_um), 0.005F);
  s.is_inside = cv::Mat(s.image.size(), CV_8U, cv::Scalar(0));
  cv::fillPoly(s.is_inside, std::vector{in_pixels(s.cell.outline_um, s.pixel_um)}, cv::Scalar(255));
  s.area_um2 = cv::countNonZero(s.is_inside) * s.pixel_um * s.pixel_um;
  s.ground = cells::wide_gaussian(s.image, 3 / s.pixel_um) - s.dark;
  s.is_fibre = cv::Mat(s.image.size(), CV_8U, cv::Scalar(0));
  for (const Fibre& f : s.cell.fibres)
    cv::polylines(s.is_fibre, in_pixels(f.points_um, s.pixel_um), false, cv::Scalar(255), cvRound(1.6 / s.pixel_um));
  return s;
}

/// Consecutive pieces of about 3 um of a fibre, points a pixel apart.
std::vector<std::vector<cv::Point2d>> pieces_of(const Fibre& fibre, double pixel_um) {
  constexpr double kPiece_um = 3;
  const Polyline points = drawing::resampled(fibre.points_um, pixel_um);
  const auto n = std::max<std::size_t>(1, static_cast<std::size_t>(length_um(points) / kPiece_um));
  std::vector<std::vector<cv::Point2d>> pieces(n);
  for (std::size_t i = 0; i < points.size(); ++i)
    pieces[std::min(n - 1, i * n / points.size())].push_back(cells::to_pixels(points[i], pixel_um));
  return pieces;
}

/// Mean brightness across a piece of a line, out to `reach_um` on either side in steps of half a pixel.
std::vector<double> mean_across(const Scene& s, const std::vector<cv::Point2d>& points, double reach_um) {
  const int half = static_cast<int>(2 * reach_um / s.pixel_um);
  std::vector<double> mean(2 * half + 1, 0);
  const cv::Point2d d = points.back() - points.front();
  const double l = std::max(1e-9, std::hypot(d.x, d.y));
  for (int i = -half; i <= half; ++i)
    for (const cv::Point2d& p : points)
      mean[i + half] +=
          cells::sample(s.image, p + (0.5 * i / l) * cv::Point2d(-d.y, d.x)) / static_cast<double>(points.size());
  return mean;
}

/// From the middle to the nearest peak to one side that stands out by a share of the ground; none within the profile.
std::optional<double> to_next_peak_um(const std::vector<double>& profile, int direction, double least,
                                      double pixel_um) {
  const int n = static_cast<int>(profile.size()), middle = n / 2, clear = static_cast<int>(0.6 / pixel_um);
  double valley = profile[middle], peak = -1e300;
  int at = 0;
  for (int i = middle; i >= 0 && i < n; i += direction) {
    if (peak > valley + least && profile[i] < peak - least) return 0.5 * pixel_um * std::abs(at - middle);
    if (profile[i] < valley && peak < valley + least) valley = profile[i], peak = -1e300;
    if (std::abs(i - middle) >= clear && profile[i] > peak) peak = profile[i], at = i;
  }
  return std::nullopt;
}

void add_fibre_statistics(const Scene& s, Statistics& result) {
  constexpr double kReach_um = 6, kStandsOut = 0.04;
  std::vector<double> contrast, width, spacing, variation;
  double covered = 0, total = 0;
  for (const Fibre& f : s.cell.fibres) {
    std::vector<double> heights;
    for (const auto& points : pieces_of(f, s.pixel_um)) {
      if (points.size() < 5) continue;
      const cells::Profile p = cells::profile_across(s.image, points, 0.9 / s.pixel_um);
      contrast.push_back(p.height / std::max(1e-9, p.side - s.dark));
      width.push_back(p.width_px * s.pixel_um);
      heights.push_back(p.height);
      const auto across = mean_across(s, points, kReach_um);
      const double ground = std::max<double>(1e-9, cells::sample(s.ground, points[points.size() / 2]));
      for (const int direction : {-1, 1})
        if (const auto d = to_next_peak_um(across, direction, kStandsOut * ground, s.pixel_um)) spacing.push_back(*d);
    }
    total += length_um(f.points_um);
    covered += length_um(f.points_um) * f.width_um;
    if (heights.size() < 3) continue;
    cv::Scalar mean, deviation;
    cv::meanStdDev(heights, mean, deviation);
    variation.push_back(deviation[0] / std::max(1e-9, mean[0]));
  }
  result["01 fibres"] = static_cast<double>(s.cell.fibres.size());
  result["02 length by area of the cell (um/um2)"] = total / s.area_um2;
  result["03 share of the cell covered"] = covered / s.area_um2;
  result["04 height over ground, 10 %"] = numerics::quantile(contrast, 0.1);
  result["05 height over ground, median"] = numerics::quantile(contrast, 0.5);
  result["06 height over ground, 90 %"] = numerics::quantile(contrast, 0.9);
  result["07 variation of height along a fibre"] = numerics::quantile(variation, 0.5);
  result["08 width, median (um)"] = numerics::quantile(width, 0.5);
  result["09 to the next peak, 25 % (um)"] = numerics::quantile(spacing, 0.25);
  result["10 to the next peak, median (um)"] = numerics::quantile(spacing, 0.5);
}

/// Brightness outside of the outline over that inside, by distance.
void add_haze(const Scene& s, Statistics& result) {
  cv::Mat outside, distance;
  cv::distanceTransform(s.is_inside == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const double inside = cells::median_within(s.image, s.is_inside) - s.dark;
  for (const auto& [name, at_um] : {std::pair("11 light 0.5 um outside, over inside", 0.5),
                                    {"12 light 1 um outside", 1.0},
                                    {"13 light 2 um outside", 2.0},
                                    {"14 light 4 um outside", 4.0},
                                    {"15 light 8 um outside", 8.0}}) {
    cv::Mat ring;
    cv::inRange(distance, (at_um - 0.15) / s.pixel_um, (at_um + 0.15) / s.pixel_um, ring);
    result[name] = (cells::median_within(s.image, ring) - s.dark) / inside;
  }
}

/// The responses of the fibres' own filters away from fibres, and the lines that they would make there.
void add_texture(const Scene& s, Statistics& result) {
  const FibreParameters p;
  const RidgeScales scales = scales_of(p, s.pixel_um);
  Ridges ridges = find_ridges(s.image, s.is_inside, scales);
  cv::Mat deep, is_free;
  cv::erode(s.is_inside, deep, cells::disc_of(2 / s.pixel_um));  // without the cortex of the edge
  cv::bitwise_and(deep, s.is_fibre == 0, is_free);
  cells::set_noise(ridges, is_free, scales.noise_radius_px);
  cv::Mat relative, camera, excess;
  cv::divide(ridges.noise, s.ground, relative);
  cv::divide(ridges.camera_noise, s.ground, camera);
  cv::divide(ridges.strongest, ridges.noise, excess);
  result["16 texture: ridge responses over ground"] = cells::median_within(relative, is_free);
  result["17 the camera's part of it"] = cells::median_within(camera, is_free);
  std::vector<float> strengths;
  for (int y = 0; y < excess.rows; ++y)
    for (int x = 0; x < excess.cols; ++x)
      if (is_free.at<unsigned char>(y, x) != 0) strengths.push_back(excess.at<float>(y, x));
  result["18 texture's tail: 99 % of the strongest, in deviations"] = quantile(cv::Mat(strengths, true), 0.99F);
  int n_lines = 0;
  for (const Trace& t : trace_lines(ridges, deep, rule_of(p, s.pixel_um))) {
    const auto is_off = [&](const cv::Point2d& q) { return is_free.at<unsigned char>(cv::Point(q)) != 0; };
    if (2 * std::ranges::count_if(t.points, is_off) < static_cast<std::ptrdiff_t>(t.points.size())) continue;
    n_lines += significance(ridges, t.points, t.own_height(), independent_px(p, s.pixel_um)) > 7;
  }
  result["19 lines of significance > 7 beside the fibres, by 1000 um2"] = 1000 * n_lines / s.area_um2;
}

void add_nucleus(const Scene& s, const std::optional<drawing::Nucleus>& nucleus, Statistics& result) {
  if (!nucleus) return;
  std::vector<double> over, beside;
  for (int y = 0; y < s.image.rows; ++y)
    for (int x = 0; x < s.image.cols; ++x) {
      if (s.is_inside.at<unsigned char>(y, x) == 0 || s.is_fibre.at<unsigned char>(y, x) != 0) continue;
      const double d = nucleus->distance(cells::to_um({1.0 * x, 1.0 * y}, s.pixel_um));
      if (d < 0.9) over.push_back(s.image.at<float>(y, x) - s.dark);
      if (d > 1.3 && d < 1.8) beside.push_back(s.image.at<float>(y, x) - s.dark);
    }
  result["20 brightness over the nucleus, over that beside it"] =
      numerics::quantile(over, 0.5) / numerics::quantile(beside, 0.5);
}

Statistics statistics_of(const Picture& picture) {
  const Scene scene = scene_of(picture);
  Statistics result;
  add_fibre_statistics(scene, result);
  add_haze(scene, result);
  add_texture(scene, result);
  add_nucleus(scene, picture.nucleus, result);
  return result;
}

std::vector<Picture> real_pictures() {
  const std::filesystem::path data = std::filesystem::path(MBTFM_SOURCE_DIR) / ".." / "shared" / "data";
  if (!std::filesystem::exists(data / "real")) return {};
  std::vector<Picture> pictures = {{"drawn", "drawn",
                                    images::read_image(data / "real/cell_with_drawn_fibres/actin.tif"), 0.1,
                                    ellipse({690, 645}, {95, 75}, 0.1)}};
  const std::map<std::string, std::optional<drawing::Nucleus>> singles = {{"0000", {}},
                                                                          {"0002", ellipse({279, 192}, {60, 48}, 0.16)},
                                                                          {"0004", ellipse({221, 262}, {42, 55}, 0.16)},
                                                                          {"0006", ellipse({267, 200}, {45, 55}, 0.16)},
                                                                          {"0008", {}}};
  for (const auto& [name, nucleus] : singles)
    pictures.push_back(
        {"single", name, images::read_image(data / "actin/single_cells" / (name + ".jpg")), 0.16, nucleus});
  const auto pattern = data / "actin/micropattern_chirality";
  for (const auto& [file, page] : {std::pair("Control/0001_control.tif", 1),
                                   {"Control/0001_20Feb20_siNT.tif", 0},
                                   {"Control/0003_20Feb20_siNT.tif", 0},
                                   {"Control/0005_20Feb20_siNT.tif", 0}})
    pictures.push_back({"pattern", file, images::read_image(pattern / file, page), 0.16});
  return pictures;
}

std::vector<Picture> simulated_pictures(const std::string& scenario) {
  std::vector<Picture> pictures;
  for (std::uint64_t seed = 201; seed <= 204; ++seed) {
    const test::SimulatedCell cell = test::simulated_cell(scenario, "ordinary", seed);
    const double pixel_um = *cell.actin.image.pixel_size_um;
    pictures.push_back({scenario, scenario + " " + std::to_string(seed), cell.actin.image, pixel_um, cell.nucleus});
  }
  return pictures;
}

/// Median and range of each group's pictures.
void print(const std::vector<std::string>& groups, const std::map<std::string, std::vector<Statistics>>& measured) {
  std::map<std::string, bool> names;
  for (const auto& [group, all] : measured)
    for (const Statistics& s : all)
      for (const auto& [name, value] : s) names[name] = true;
  std::printf("%-58s", "median (range) of the pictures");
  for (const std::string& g : groups) std::printf(" %-22s", (g + ", " + std::to_string(measured.at(g).size())).c_str());
  for (const auto& [name, is_there] : names) {
    std::printf("\n%-58s", name.c_str() + 3);
    for (const std::string& g : groups) {
      std::vector<double> values;
      for (const Statistics& s : measured.at(g))
        if (s.contains(name)) values.push_back(s.at(name));
      char text[64] = "–";
      if (!values.empty())
        std::snprintf(text, sizeof text, "%.3g (%.3g … %.3g)", numerics::quantile(values, 0.5),
                      numerics::quantile(values, 0), numerics::quantile(values, 1));
      std::printf(" %-22s", text);
    }
  }
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> scenarios(argv + 1, argv + argc), groups;
  if (scenarios.empty()) scenarios = {"dense", "u2os"};
  std::vector<Picture> pictures = real_pictures();
  if (pictures.empty()) std::printf("the shared data are absent\n");
  for (const std::string& s : scenarios) std::ranges::move(simulated_pictures(s), std::back_inserter(pictures));
  std::map<std::string, std::vector<Statistics>> measured;
  for (const Picture& picture : pictures) {
    if (!measured.contains(picture.group)) groups.push_back(picture.group);
    measured[picture.group].push_back(statistics_of(picture));
  }
  print(groups, measured);
}
