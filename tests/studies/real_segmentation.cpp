/// real_segmentation [FOLDER] [name=value …]: how well adhesions and outlines of real cells are found that others have
/// marked (../shared/data), all with default parameters, or adhesions with these; into FOLDER, pictures of default
/// parameters: theirs green, found red.
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "segment/cells/grid.h"
#include "segment/images/png.h"
#include "tests/support/real_adhesions.h"
#include "tests/support/settings.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::test;

void print(const std::string& name, const Overlaps& o) {
  std::printf("%-12s %9.3f %6.3f %9.3f %6.3f %8d %6d\n", name.c_str(), o.pixels.dice, o.pixels.f1, o.ellipses.dice,
              o.ellipses.f1, o.pixels.n_true, o.pixels.n_found);
}

Overlaps mean_of(const std::vector<Overlaps>& all) {
  Overlaps mean;
  for (const Overlaps& o : all)
    for (const auto& [to, from] : {std::pair(&mean.pixels, &o.pixels), {&mean.ellipses, &o.ellipses}}) {
      to->dice += from->dice / static_cast<double>(all.size());
      to->f1 += from->f1 / static_cast<double>(all.size());
      to->n_true += from->n_true;
      to->n_found += from->n_found;
    }
  return mean;
}

/// An image, what others see in it and what is found, at twice the size.
void draw(const std::filesystem::path& file, const images::Image& image, const images::Image& mask, double pixel_um,
          const std::vector<Polygon>& found) {
  constexpr double kScale = 2;
  const cv::Mat values = cells::matrix_of(image);
  const double dark = cells::quantile(values, 0.005), bright = cells::quantile(values, 0.998);
  cv::Mat grey = cv::min(cv::max((values - dark) / std::max(1e-9, bright - dark), 0.0), 1.0), bytes, picture, theirs;
  cv::resize(grey, grey, cv::Size(), kScale, kScale, cv::INTER_LINEAR);
  cv::sqrt(grey, grey);
  grey.convertTo(bytes, CV_8U, 255);
  cv::cvtColor(bytes, picture, cv::COLOR_GRAY2RGB);
  cv::resize(cells::matrix_of(mask) > 0, theirs, picture.size(), 0, 0, cv::INTER_NEAREST);
  std::vector<std::vector<cv::Point>> rings;
  cv::findContours(theirs, rings, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  cv::drawContours(picture, rings, -1, cv::Scalar(0, 200, 0));
  for (const Polygon& polygon : found) {
    std::vector<cv::Point> points;
    for (const Vec2 p : polygon)
      points.emplace_back(cvRound(kScale * p.x / pixel_um), cvRound(kScale * p.y / pixel_um));
    cv::polylines(picture, points, true, cv::Scalar(255, 60, 60));
  }
  images::write_png(file, {picture.cols, picture.rows, {picture.data, picture.data + 3 * picture.total()}});
}

std::vector<Polygon> shapes_in(const images::Image& image, double pixel_um) {
  const auto adhesions = cells::find_adhesions(image, pixel_um, {});
  std::vector<Polygon> shapes{cells::find_outline(image, adhesions, pixel_um, {})};
  for (const Adhesion& a : adhesions) shapes.push_back(cells::ellipse_polygon(a, 24));
  return shapes;
}

void draw_all(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const int i : kHandMasked) {
    const std::string name = std::to_string(i) + ".tif";
    const images::Image image = images::read_image(kHandMasks / "images" / name);
    draw(folder / ("hand_mask_" + std::to_string(i) + ".png"), image, images::read_image(kHandMasks / "masks" / name),
         kHandMasksPixel_um, shapes_in(image, kHandMasksPixel_um));
  }
  const images::Image fibroblast = images::read_image(kFibroblast / "focal_image.png");
  draw(folder / "fibroblast.png", fibroblast, images::read_image(kFibroblast / "adhesions.png"), kFibroblastPixel_um,
       shapes_in(fibroblast, kFibroblastPixel_um));
  const images::Image doublet = images::read_image(kDoublet / "actin.tif");
  draw(folder / "doublet.png", doublet, images::read_image(kDoublet / "mask.tif"), kDoubletPixel_um,
       {cells::find_outline(doublet, {}, kDoubletPixel_um, {})});
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const bool has_folder = !words.empty() && words.front().find('=') == std::string::npos;
  cells::AdhesionParameters p;
  stage::ParameterList list;
  declare(list, p);
  set_all(list, {words.begin() + has_folder, words.end()});
  if (!std::filesystem::exists(kHandMasks)) {
    std::printf("the shared data are absent: %s\n", kSharedData.c_str());
    return 0;
  }
  std::printf("%-12s %16s %16s %15s\n%-12s %9s %6s %9s %6s %8s %6s\n", "adhesions", "by pixels", "by ellipses",
              "number", "", "Dice", "F1", "Dice", "F1", "theirs", "found");
  std::vector<Overlaps> all;
  for (const int i : kHandMasked) {
    all.push_back(hand_mask_overlaps(i, p));
    print("hand mask " + std::to_string(i), all.back());
  }
  print("mean", mean_of(all));
  print("fibroblast", fibroblast_overlaps(p));
  std::printf("outline of the doublet: intersection over union %.3f\n", doublet_overlap());
  if (has_folder) draw_all(words.front());
}
