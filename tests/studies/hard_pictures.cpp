/// hard_pictures FOLDER: pictures of hard cases for docs/developers/hard-cases.md: images (PNG), beads, substrate and
/// fit (SVG).
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include <opencv2/imgproc.hpp>

#include "mbtfm/tensions/intervals.h"
#include "pipeline/files/text.h"
#include "segment/beads/track.h"
#include "segment/cells/emptiness.h"
#include "segment/cells/segment_cell.h"
#include "segment/images/png.h"
#include "substrate/choice/factory.h"
#include "tests/support/bead_pair.h"
#include "tests/support/chart.h"
#include "tests/support/drawn_image.h"
#include "tests/support/substrate_scene.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
namespace fs = std::filesystem;
using charts::Chart;
using charts::kColours;

std::string stroke(int k) { return std::string("stroke:") + charts::kColours[k] + ";stroke-width:1.6"; }
std::string fill(int k) { return std::string("fill:") + charts::kColours[k]; }

// images

struct HardImage {
  std::string title;
  images::Image image;
  bool is_actin = false;
};

std::vector<HardImage> hard_images() {
  std::vector<HardImage> images;
  test::DrawnScene scene = test::drawn_scene(10, 7);
  for (float& value : scene.adhesion_image.pixels) value = std::min(value, 400.0f);
  images.push_back({"saturated in the adhesions", scene.adhesion_image});
  for (float& value : scene.adhesion_image.pixels) value = std::min(value, 190.0f);
  images.push_back({"saturated in the cytosol", scene.adhesion_image});
  images::Image noise = test::even_image(256, 256, 200);
  test::add_noise(noise, 15, 1);
  images.push_back({"noise alone", noise});
  images::Image body = test::even_image(256, 256, 100);
  test::draw_ellipse(body, test::ellipse(1, {12.8, 12.8}, 20, 14, 0.5), 1000, 0.15, 0.1);
  test::add_noise(body, 5, 5);
  images.push_back({"bright body of a cell", body});
  images::Image step = test::even_image(256, 256, 100);
  for (int row = 0; row < 256; ++row)
    for (int column = 0; column < 256; ++column)
      if (column + row / 4 > 150) step.at(column, row) = 400;
  test::add_noise(step, 10, 1);
  images.push_back({"a step (fibres)", step, true});
  test::DrawnScene faint = test::drawn_scene(200, 3);
  images.push_back({"noise of 40 % (fibres)", faint.actin_image, true});
  return images;
}

/// The image in grey with what was found in it, and a caption.
cv::Mat panel(const HardImage& hard) {
  constexpr int kSide = 384;
  const auto [low, high] = std::minmax_element(hard.image.pixels.begin(), hard.image.pixels.end());
  const double span = std::max(1.0f, *high - *low);
  cv::Mat grey(hard.image.height, hard.image.width, CV_8UC3);
  for (int row = 0; row < grey.rows; ++row)
    for (int column = 0; column < grey.cols; ++column)
      grey.at<cv::Vec3b>(row, column) =
          cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(235 * (hard.image.at(column, row) - *low) / span));
  cv::resize(grey, grey, cv::Size(kSide, kSide), 0, 0, cv::INTER_NEAREST);
  constexpr double kPixel_um = test::DrawnScene::kPixel_um;
  const double scale = kSide / (kPixel_um * hard.image.width);
  const cv::Scalar orange(230, 159, 0), green(0, 200, 140), ink(30, 30, 30);  // red, green, blue
  std::string found;
  if (hard.is_actin) {
    const auto fibres = cells::find_fibres(hard.image, {}, {}, kPixel_um, {});
    for (const Fibre& f : fibres)
      for (std::size_t i = 1; i < f.points_um.size(); ++i)
        cv::line(grey, {cvRound(scale * f.points_um[i - 1].x), cvRound(scale * f.points_um[i - 1].y)},
                 {cvRound(scale * f.points_um[i].x), cvRound(scale * f.points_um[i].y)}, orange, 2, cv::LINE_AA);
    found = std::to_string(fibres.size()) + " fibres";
  } else {
    const auto adhesions = cells::find_adhesions(hard.image, kPixel_um, {});
    for (const Adhesion& a : adhesions)
      cv::ellipse(
          grey,
          cv::RotatedRect(
              cv::Point2f(static_cast<float>(scale * a.position_um.x), static_cast<float>(scale * a.position_um.y)),
              cv::Size2f(static_cast<float>(scale * a.major_axis_um), static_cast<float>(scale * a.minor_axis_um)),
              static_cast<float>(a.angle_rad * 180 / CV_PI)),
          green, 2, cv::LINE_AA);
    found = adhesions.empty() ? "none: " + cells::why_no_adhesions(hard.image, kPixel_um, {})
                              : std::to_string(adhesions.size()) + " adhesions";
  }
  cv::Mat whole(kSide + 86, kSide + 16, CV_8UC3, cv::Scalar::all(255));
  grey.copyTo(whole(cv::Rect(8, 8, kSide, kSide)));
  const auto write = [&](const std::string& text, int y, double size) {
    cv::putText(whole, text, {10, y}, cv::FONT_HERSHEY_SIMPLEX, size, ink, 1, cv::LINE_AA);
  };
  write(hard.title, kSide + 30, 0.6);
  constexpr std::size_t kLine = 54;
  for (int line = 0; !found.empty() && line < 3; ++line) {
    const std::size_t end = found.size() <= kLine ? found.size() : found.rfind(' ', kLine);
    write(found.substr(0, end), kSide + 50 + 16 * line, 0.42);
    found.erase(0, end + 1);
  }
  return whole;
}

void draw_images(const fs::path& file) {
  std::vector<cv::Mat> panels;
  for (const HardImage& hard : hard_images()) panels.push_back(panel(hard));
  cv::Mat rows[2], sheet;
  cv::hconcat(std::vector<cv::Mat>(panels.begin(), panels.begin() + 3), rows[0]);
  cv::hconcat(std::vector<cv::Mat>(panels.begin() + 3, panels.end()), rows[1]);
  cv::vconcat(rows, 2, sheet);
  images::Picture picture{.width = sheet.cols, .height = sheet.rows, .rgb = {}};
  picture.rgb.assign(sheet.data, sheet.data + sheet.total() * 3);
  images::write_png(file, picture);
}

// beads

charts::Chart beads_chart(const std::string& title, const test::BeadScene& scene) {
  const auto peaks = test::ring_of_adhesions(scene.width, 6);
  const auto pair = test::draw_bead_pair(peaks, scene);
  const beads::Tracking tracking = beads::track_beads(pair.relaxed, pair.stressed, 1.0, {}, 2);
  charts::Chart chart(title, {.label = "true displacement (px)", .low = 0, .high = 7, .scale = charts::Scale::linear},
                      {.label = "measured along it (px)", .low = -1, .high = 9, .scale = charts::Scale::linear});
  chart.put_key(charts::Chart::KeySide::left);
  chart.curve({{0, 0}, {7, 7}}, "stroke:#999;stroke-width:1");
  int n_flagged = 0;
  for (const Bead& bead : tracking.field) {
    const Vec2 truth = test::displacement(peaks, bead.position_um - Vec2{0.5, 0.5});
    const double size = norm(truth);
    if (size < 0.05) continue;
    const bool is_flagged = !bead.flag.empty();
    n_flagged += is_flagged;
    chart.dot({size, dot(bead.displacement_um, truth) / size}, 1.6, fill(is_flagged ? 1 : 0) + ";fill-opacity:.6");
  }
  chart.key("tracked", charts::kColours[0]);
  chart.key("flagged", charts::kColours[1]);
  return chart;
}

std::string beads_sheet() {
  return charts::svg_file(
      {beads_chart(
           "One bead in ten lost, uneven light",
           {.width = 384, .n_beads = 2950, .lost = 0.05, .uneven_light = 0.5, .gain = 0.7, .offset = 200, .seed = 4}),
       beads_chart("Beads that step 0.6 px on their own", {.width = 384, .n_beads = 1500, .jitter = 0.6, .seed = 101}),
       beads_chart("Beads ten times fainter", {.width = 384, .n_beads = 1500, .brightness = 150, .seed = 1})},
      3, {});
}

// substrate

/// Displacement along x of points along a line through an ellipse that a unit force pulls.
charts::Chart profile(const std::string& title, const Gel& gel, const substrate::Ellipse& ellipse, double half_um,
                      const std::vector<std::string>& models) {
  std::vector<Vec2> points;
  for (int i = -100; i <= 100; ++i) points.push_back({half_um * i / 100, 0});
  std::vector<std::vector<Vec2>> curves;
  std::vector<double> values = {0};
  for (const std::string& model : models) {
    const Eigen::MatrixXd g =
        choice::make_substrate(gel, test::model_named(model), 2)->compliance_um_per_nN(points, {ellipse});
    curves.emplace_back();
    for (std::size_t i = 0; i < points.size(); ++i) {
      curves.back().push_back({points[i].x, g(2 * static_cast<Eigen::Index>(i), 0)});
      values.push_back(curves.back().back().y);
    }
  }
  charts::Chart chart(title, {.label = "x (um)", .low = -half_um, .high = half_um, .scale = charts::Scale::linear},
                      charts::axis_over("displacement for 1 nN (um)", values, charts::Scale::linear));
  for (const double rim : {-ellipse.semi_major_um, ellipse.semi_major_um})
    chart.upright(rim, "stroke:#bbb;stroke-width:1");
  const char* dashes[] = {"", ";stroke-dasharray:7 4", ";stroke-dasharray:2 4", ";stroke-dasharray:10 3 2 3"};
  for (std::size_t k = 0; k < curves.size(); ++k) {
    chart.curve(curves[k], stroke(static_cast<int>(k)) + dashes[k]);
    chart.key(models[k], charts::kColours[k]);
  }
  return chart;
}

std::string substrate_sheet() {
  const std::vector<std::string> all = {"half-space", "layer", "split", "refined"};
  return charts::svg_file(
      {profile("A slender adhesion, 1 : 10", {8.4, 0.49, 20}, {{0, 0}, 2, 0.2, 0}, 6, all),
       profile("Gel of 2 um, nu = 0.4999", {8.4, 0.4999, 2}, {{0, 0}, 0.6, 0.3, 0}, 6, all),
       profile("An adhesion of 0.01 um²", {8.4, 0.49, 20}, {{0, 0}, 0.08, 0.04, 0}, 0.4, all)},
      3,
      {"Grey lines: the adhesion's rim. Where the base is far away the models agree; on the thin gel only the "
       "half-space differs."});
}

// fit

charts::Chart intervals(const std::string& title, test::TensionScene& scene) {
  const tensions::EnsembleFit fit = test::fit_own_network(scene);
  std::vector<double> values = {0};
  for (std::size_t i = 1; i < fit.tensions.nN.size(); ++i) {
    const double higher = std::max(fit.tensions.nN[i].value, scene.tensions_nN[static_cast<Eigen::Index>(i)]);
    // a collapsed fibre pulls alike with any tension: its interval has no end
    values.push_back(std::min(tensions::interval_95(fit.tensions.nN[i]).high, std::max(40.0, 3 * higher)));
    values.push_back(higher);
  }
  charts::Chart chart(title,
                      {.label = "fibre",
                       .low = 0.3,
                       .high = static_cast<double>(fit.tensions.nN.size()) - 0.3,
                       .scale = charts::Scale::linear},
                      charts::axis_over("tension (nN)", values, charts::Scale::linear));
  for (std::size_t i = 1; i < fit.tensions.nN.size(); ++i) {
    const auto x = static_cast<double>(i);
    const tensions::Interval interval = tensions::interval_95(fit.tensions.nN[i]);
    chart.curve({{x, interval.low}, {x, interval.high}}, stroke(0));
    chart.dot({x, fit.tensions.nN[i].value}, 3, fill(0));
    chart.dot({x + 0.25, scene.tensions_nN[static_cast<Eigen::Index>(i)]}, 3, fill(1));
  }
  chart.key("fitted, 95 %", charts::kColours[0]);
  chart.key("true", charts::kColours[1]);
  return chart;
}

std::string fit_sheet() {
  test::TensionScene noisy = test::tension_scene("case_22", 2000, 1.0, 10);
  test::TensionScene half = test::tension_scene("case_21", 3000, 0.05, 4);
  double middle_um = 0;
  for (const Vec2 p : half.points_um) middle_um += p.x / static_cast<double>(half.points_um.size());
  std::vector<bool> is_used;
  for (const Vec2 p : half.points_um) is_used.push_back(p.x < middle_um - 5);
  half.data = tensions::reduce(half.beads, half.compliance_um_per_nN, is_used);
  test::TensionScene dead = test::tension_scene("case_21", 1000, 0.05, 5);
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal(0, 1);
  for (Bead& bead : dead.beads) bead.displacement_um = {0.02 * normal(random), 0.02 * normal(random)};
  for (Bead& bead : dead.beads) bead.sigma_um = 0.02;
  dead.data = tensions::reduce(dead.beads, dead.compliance_um_per_nN);
  dead.tensions_nN.setZero();
  return charts::svg_file(
      {intervals("Noise as large as the signal", noisy), intervals("Beads on one side of the cell only", half),
       intervals("A dead cell: noise only", dead)},
      3, {});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: hard_pictures FOLDER\n";
    return 2;
  }
  const fs::path folder = argv[1];
  draw_images(folder / "hard-images.png");
  files::write_text(folder / "hard-beads.svg", beads_sheet());
  files::write_text(folder / "hard-substrate.svg", substrate_sheet());
  files::write_text(folder / "hard-fit.svg", fit_sheet());
}
