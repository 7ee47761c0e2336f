#include "segment/cells/contact_sheet.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"
#include "segment/cells/overlay.h"
#include "segment/cells/report.h"

namespace mbtfm::cells {
namespace {

constexpr int kTile_px = 640;    // three beside each other fill a screen
constexpr int kCaption_px = 84;  // two lines
constexpr int kGap_px = 10;
constexpr std::size_t kMostPictures = 64;
const cv::Scalar kPaper(255, 255, 255), kInk(15, 15, 15), kGrey(90, 90, 90);

SheetAxis parse_axis(const std::string& text) {
  SheetAxis axis;
  const auto equals = text.find('=');
  axis.parameter = text.substr(0, equals);
  std::istringstream values(equals == std::string::npos ? "" : text.substr(equals + 1));
  for (std::string value; std::getline(values, value, ',');) axis.values.push_back(value);
  const bool has_empty = std::any_of(axis.values.begin(), axis.values.end(), [](const auto& v) { return v.empty(); });
  if (axis.parameter.empty() || axis.values.empty() || has_empty)
    throw UsageError("contact_sheet: expected name=a,b,c, found '" + text + "'");
  return axis;
}

/// What one pair of values gives.
struct Trial {
  std::string values;  ///< "adhesion_seed_noise = 3, fibre_least_probability = 0.5"
  std::optional<Segmentation> segmentation;
  std::string outcome;
};

std::string outcome_of(const Segmentation& s) {
  return std::to_string(s.cell.adhesions.size()) + " adhesions, fibres: " + types_in_words(s.cell.fibres);
}

Trial trial_of(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
               SegmentParameters parameters, const HandDrawn& drawn,
               const std::vector<std::pair<std::string, std::string>>& settings) {
  stage::ParameterList list;
  declare(list, parameters);
  Trial trial;
  for (const auto& [name, value] : settings) {
    stage::set_from_text(stage::parameter_named(list, name), value);
    trial.values += (trial.values.empty() ? "" : ", ") + name + " = " + value;
  }
  try {
    trial.segmentation = segment_cell(adhesion, actin, parameters, drawn);
    trial.outcome = outcome_of(*trial.segmentation);
  } catch (const InputError& error) {  // nothing found with these values: the sheet is there to show that
    trial.outcome = error.found;
  }
  return trial;
}

/// What all the pictures show: every cell found, or the whole image.
Extent common_view(const std::vector<Trial>& trials, const images::Image& image, double pixel_um) {
  std::vector<Vec2> corners;
  for (const Trial& trial : trials) {
    if (!trial.segmentation) continue;
    const Extent view = view_of(*trial.segmentation);
    corners.insert(corners.end(), {view.low_um, view.high_um});
  }
  if (corners.empty()) return {{0, 0}, {image.width * pixel_um, image.height * pixel_um}};
  return extent_of(corners);
}

void write_line(cv::Mat& picture, const std::string& text, cv::Point at, double size, const cv::Scalar& colour) {
  int baseline = 0;
  const int width = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, 1, &baseline).width;
  const double fitting = std::min(size, size * (kTile_px - 2 * kGap_px) / std::max(width, 1));
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, fitting, colour, 1, cv::LINE_AA);
}

}  // namespace

std::vector<SheetAxis> parse_axes(const std::string& text) {
  std::vector<SheetAxis> axes;
  std::istringstream words(text);
  for (std::string word; words >> word;) axes.push_back(parse_axis(word));
  if (axes.empty() || axes.size() > 2)
    throw UsageError("contact_sheet: expected one or two parameters, found " + std::to_string(axes.size()));
  if (axes.size() == 2 && axes[0].parameter == axes[1].parameter)
    throw UsageError("contact_sheet: expected two different parameters, found '" + axes[0].parameter + "' twice");
  const std::size_t n = axes.front().values.size() * (axes.size() == 2 ? axes.back().values.size() : 1);
  if (n > kMostPictures)
    throw UsageError("contact_sheet: expected at most " + std::to_string(kMostPictures) + " pictures, found " +
                     std::to_string(n));
  return axes;
}

images::Picture draw_contact_sheet(const std::optional<images::Channel>& adhesion,
                                   const std::optional<images::Channel>& actin, const SegmentParameters& parameters,
                                   const HandDrawn& drawn) {
  const std::vector<SheetAxis> axes = parse_axes(parameters.contact_sheet);
  const SheetAxis rows = axes.size() == 2 ? axes[1] : SheetAxis{"", {""}};
  std::vector<Trial> trials;
  for (const std::string& below : rows.values)
    for (const std::string& across : axes[0].values) {
      std::vector<std::pair<std::string, std::string>> settings = {{axes[0].parameter, across}};
      if (!rows.parameter.empty()) settings.emplace_back(rows.parameter, below);
      trials.push_back(trial_of(adhesion, actin, parameters, drawn, settings));
    }
  const images::Channel &first = adhesion ? *adhesion : *actin, &second = actin ? *actin : *adhesion;
  Segmentation nothing;
  nothing.pixel_size_um = images::common_pixel_size_um(first, second, parameters.pixel_size_um);
  const Extent view = common_view(trials, first.image, nothing.pixel_size_um);
  std::vector<cv::Mat> tiles;
  for (const Trial& trial : trials)
    tiles.push_back(draw_thumbnail(adhesion, actin, trial.segmentation.value_or(nothing), view, kTile_px));
  const int n_columns = static_cast<int>(axes[0].values.size()), n_rows = static_cast<int>(rows.values.size());
  const cv::Size step(kTile_px + kGap_px, tiles.front().rows + kCaption_px + kGap_px);
  cv::Mat sheet(n_rows * step.height + kGap_px, n_columns * step.width + kGap_px, CV_8UC3, kPaper);
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const int k = static_cast<int>(i);
    const cv::Point corner(kGap_px + k % n_columns * step.width, kGap_px + k / n_columns * step.height);
    write_line(sheet, trials[i].values, corner + cv::Point(0, 30), 0.8, kInk);
    write_line(sheet, trials[i].outcome, corner + cv::Point(0, 66), 0.65, kGrey);
    tiles[i].copyTo(sheet(cv::Rect(corner + cv::Point(0, kCaption_px), tiles[i].size())));
  }
  return picture_of(sheet);
}

}  // namespace mbtfm::cells
