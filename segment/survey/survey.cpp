#include "segment/survey/survey.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/plausible.h"
#include "segment/beads/pair_look.h"
#include "segment/beads/plane.h"
#include "segment/beads/track.h"
#include "segment/cells/adhesions.h"
#include "segment/cells/outline.h"

namespace mbtfm::survey {
namespace {

using images::Channel;

// Fewer than these three by three beads under a fibre of 10 um and its surroundings leave its tension to its
// neighbours.
constexpr double kWidestSpacing_um = 3;
// Beads of unlike focus: as the tracker's finding `defocused` has it.
constexpr double kUnlikeSizes = 1.1;
// A force's displacement falls to a tenth of its peak some five adhesions' lengths away; the drift is measured beyond.
constexpr double kLeastMargin_um = 5;

std::vector<const Channel*> all_of(const CellImages& cell) {
  std::vector<const Channel*> all;
  for (const auto* image : {&cell.adhesion, &cell.actin, &cell.beads_stressed, &cell.beads_relaxed})
    if (*image) all.push_back(&**image);
  return all;
}

/// Of the bead images, as cell.toml has it.
std::optional<double> given_for_beads(const CellImages& cell) {
  return cell.given_beads_pixel_size_um ? cell.given_beads_pixel_size_um : cell.given_pixel_size_um;
}

images::NamedField field_of(const Channel& channel, std::optional<double> given_um) {
  const images::Image& image = channel.image;
  return {channel.name, {image.width, image.height, given_um ? given_um : image.pixel_size_um}};
}

double pixel_size_um(const CellImages& cell) {
  std::optional<double> size = cell.given_pixel_size_um;
  const std::vector<const Channel*> all = all_of(cell);
  for (std::size_t i = 0; i < all.size(); ++i) size = images::common_pixel_size_um(*all[0], *all[i], size);
  return size.value_or(0);
}

void look_at_each(const CellImages& cell, Survey& survey) {
  for (const Channel* image : all_of(cell)) {
    for (const auto& finding : {images::noticed_saturation(*image), images::noticed_loss(*image)})
      if (finding) survey.doubts.push_back(finding->text + " " + finding->remedy);
  }
}

void look_for_twins(const CellImages& cell, Survey& survey) {
  const std::vector<const Channel*> all = all_of(cell);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (all[i]->image.pixels == all[j]->image.pixels)
        survey.doubts.push_back(all[j]->name + " and " + all[i]->name +
                                " are the same picture. Name the right files in [images] of cell.toml.");
    }
  }
}

/// Gaussian size (px) of the beads in an image; 0: none are seen.
double bead_size_px(const images::Image& image) {
  constexpr double kWide_px = 8;  // wider than any bead, for a first look
  return beads::bead_sigma_of(beads::without_background(image, kWide_px));
}

void look_at_beads(const CellImages& cell, int threads, Survey& survey) {
  if (!cell.beads_stressed || !cell.beads_relaxed) return;
  const double pixel_um =
      images::common_pixel_size_um(*cell.beads_relaxed, *cell.beads_stressed, given_for_beads(cell));
  const images::Image& relaxed = cell.beads_relaxed->image;
  const double size_relaxed = bead_size_px(relaxed), size_stressed = bead_size_px(cell.beads_stressed->image);
  for (const Channel* channel : {&*cell.beads_relaxed, &*cell.beads_stressed})
    if ((channel == &*cell.beads_relaxed ? size_relaxed : size_stressed) == 0)
      survey.doubts.push_back(channel->name + " shows no beads, only noise. Check the channel and the focus.");
  if (size_relaxed == 0 || size_stressed == 0) return;
  const double ratio = size_stressed / size_relaxed, unlike = std::max(ratio, 1 / ratio);
  if (unlike > kUnlikeSizes)
    survey.doubts.push_back("The beads of " + (ratio > 1 ? cell.beads_stressed : cell.beads_relaxed)->name +
                            " are wider by a factor of " + brief(unlike) + " (limit " + brief(kUnlikeSizes) +
                            "). Focus both images on the same beads, or take the slice that is as sharp. If one of "
                            "them shows another channel, name the right files in [images] of cell.toml.");
  const std::size_t n_beads = beads::detect_beads(relaxed, beads::TrackParameters{}.detection_snr, threads).size();
  const double field_um2 = relaxed.width * pixel_um * relaxed.height * pixel_um;
  const double spacing_um = std::sqrt(field_um2 / static_cast<double>(std::max<std::size_t>(1, n_beads)));
  survey.facts += "; " + std::to_string(n_beads) + " beads, " + brief(spacing_um) + " um apart";
  if (spacing_um > kWidestSpacing_um)
    survey.doubts.push_back("The beads are " + brief(spacing_um) + " um apart (limit " + brief(kWidestSpacing_um) +
                            " um): single fibres will not be resolved. Use more beads, or two colours of them.");
}

/// Do both show the same beads, how far apart, and the same way up?
void look_at_pair(const CellImages& cell, double pixel_um, Survey& survey) {
  if (!cell.beads_stressed || !cell.beads_relaxed) return;
  const beads::PairLook look = beads::look_at_pair(cell.beads_relaxed->image, cell.beads_stressed->image);
  if (!look.orientation.empty()) {
    survey.doubts.push_back(cell.beads_stressed->name + " looks " + look.orientation + " against " +
                            cell.beads_relaxed->name + ". Save both as the microscope recorded them.");
    return;
  }
  const images::Image& image = cell.beads_relaxed->image;
  const double shared = std::max(0.0, 1 - std::abs(look.shift_px.x) / image.width) *
                        std::max(0.0, 1 - std::abs(look.shift_px.y) / image.height);
  survey.facts += "; stage moved " + brief(0.01 * std::round(100 * norm(look.shift_px) * pixel_um)) +
                  " um between the bead images, " + brief(100 * shared) + " % of the field in both";
  constexpr double kLeastShared = 2.0 / 3;  // beads are followed up to a third of the image
  if (shared < kLeastShared)
    survey.doubts.push_back("Only " + brief(100 * shared) + " % of the field is in both bead images (limit " +
                            brief(100 * kLeastShared) +
                            " %): do they belong to one cell? Put the stage back before the second one is recorded.");
}

std::vector<Adhesion> adhesions_of(const Channel& adhesion, double pixel_um) {
  constexpr double kCoarse_um = 0.25;  // about the blur of the microscope: shapes are enough here
  const images::Image& image = adhesion.image;
  const int binning = std::clamp(static_cast<int>(kCoarse_um / pixel_um), 1, std::min(image.width, image.height));
  return cells::find_adhesions(images::binned(image, binning), pixel_um * binning, {});
}

/// Does a table lie as the cell's picture does, and point as cells pull?
void look_at_table(const CellImages& cell, double pixel_um, Survey& survey) {
  if (cell.given.empty()) return;
  survey.facts += "; " + std::to_string(cell.given.size()) + " vectors of a table";
  const auto& picture = cell.adhesion ? cell.adhesion : cell.actin;
  if (!picture) return;
  const beads::FieldLook look = beads::look_at_field(cell.given, picture->image, pixel_um);
  const std::string mend =
      ". Export the table as the picture lies, or set track.y_axis or the columns (track.x_column, track.ux_column …).";
  if (!look.places.empty())
    survey.doubts.push_back("The displacements look " + look.places + " against " + picture->name + mend);
  else if (!look.vectors.empty())
    survey.doubts.push_back("The vectors of the table look " + look.vectors + " at their places" + mend);
  if (!look.places.empty() || !look.vectors.empty() || !cell.adhesion) return;
  constexpr std::size_t kMost = 200;  // the largest: what costs grows with the cube
  std::vector<Adhesion> adhesions = adhesions_of(*cell.adhesion, pixel_um);
  std::ranges::stable_sort(adhesions, std::ranges::greater{}, &Adhesion::area_um2);
  std::vector<Vec2> places;
  for (std::size_t k = 0; k < std::min(kMost, adhesions.size()); ++k) places.push_back(adhesions[k].position_um);
  const Vec2 middle_um = 0.5 * pixel_um * Vec2{double(picture->image.width), double(picture->image.height)};
  const std::string turned = beads::orientation_of_forces(cell.given, places, middle_um);
  if (!turned.empty())
    survey.doubts.push_back("The table as a whole looks " + turned + " against " + picture->name +
                            ": forces at its adhesions explain it far better so" + mend);
}

/// From the cell to the nearest side of the image.
double margin_um(const cells::CellOutline& cell, Vec2 field_um) {
  double margin = std::min(field_um.x, field_um.y);
  for (const Vec2 p : cell.outer_um) margin = std::min({margin, p.x, p.y, field_um.x - p.x, field_um.y - p.y});
  return std::max(0.0, margin);
}

void look_at_cell(const CellImages& cell, double pixel_um, Survey& survey) {
  if (!cell.actin) return;
  constexpr int kCoarse = 4;  // px: the outline to half a micrometre is enough here
  const int binning = std::min({kCoarse, cell.actin->image.width, cell.actin->image.height});
  const images::Image coarse = images::binned(cell.actin->image, binning);
  const double coarse_um = pixel_um * binning;
  const auto found = cells::find_cells(coarse, {}, coarse_um, cells::OutlineParameters{}).cells;
  if (found.empty()) {
    survey.doubts.push_back(cell.actin->name + " shows no cell. Check the channel.");
    return;
  }
  const double margin = margin_um(found.front(), {coarse.width * coarse_um, coarse.height * coarse_um});
  if (found.size() > 1) survey.facts += "; " + std::to_string(found.size()) + " cells, of which the largest counts";
  survey.facts += "; margin " + brief(margin) + " um";
  if (margin < kLeastMargin_um)
    survey.doubts.push_back(
        "The cell comes within " + brief(margin) + " um of the image's border (limit " + brief(kLeastMargin_um) +
        " um): forces beyond the image are then unknown. Take a larger field, or a cell in its middle.");
}

/// As the finding `bleed-through` of the stage segment.
void look_at_adhesions(const CellImages& cell, double pixel_um, Survey& survey) {
  if (!cell.adhesion) return;
  const double ratio = cells::aspect_ratio(adhesions_of(*cell.adhesion, pixel_um));
  if (const auto found = noticed(Symptom::adhesions_long, ratio))
    survey.doubts.push_back(cell.adhesion->name + ": " + found->text + " " + found->remedy);
}

}  // namespace

Survey survey(const CellImages& cell, int threads) {
  Survey survey;
  const std::vector<const Channel*> all = all_of(cell);
  if (all.empty()) return {.facts = "no images", .doubts = {}};
  if (cell.adhesion && cell.actin) images::require_equal_sizes(*cell.adhesion, *cell.actin);
  if (cell.beads_stressed && cell.beads_relaxed) images::require_equal_sizes(*cell.beads_stressed, *cell.beads_relaxed);
  for (const auto* of_cell : {&cell.adhesion, &cell.actin}) {
    if (*of_cell && cell.beads_relaxed)
      images::require_same_field(field_of(**of_cell, cell.given_pixel_size_um),
                                 field_of(*cell.beads_relaxed, given_for_beads(cell)));
  }
  const double pixel_um = pixel_size_um(cell);
  survey.facts = std::to_string(all[0]->image.width) + " x " + std::to_string(all[0]->image.height) + " pixels of " +
                 images::in_um(pixel_um);
  for (const Channel* image : all) {
    if (!image->image.taken.empty()) survey.facts += "; " + image->name + ": " + image->image.taken;
    const auto is_it = [&](const std::optional<Channel>& channel) { return channel && image == &*channel; };
    const bool is_of_beads = is_it(cell.beads_relaxed) || is_it(cell.beads_stressed);
    if (const auto doubt =
            images::doubt_about_calibration(*image, is_of_beads ? given_for_beads(cell) : cell.given_pixel_size_um))
      survey.doubts.push_back(image->name + ": " + stage::sentence_of(*doubt) + ". " + doubt->remedy);
  }
  look_at_each(cell, survey);
  look_for_twins(cell, survey);
  look_at_beads(cell, threads, survey);
  look_at_pair(cell, pixel_um, survey);
  look_at_table(cell, pixel_um, survey);
  look_at_cell(cell, pixel_um, survey);
  look_at_adhesions(cell, pixel_um, survey);
  return survey;
}

}  // namespace mbtfm::survey
