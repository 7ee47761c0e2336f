#include "segment/beads/given_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/place.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/effects.h"
#include "segment/beads/common_motion.h"
#include "segment/beads/local_motion.h"

namespace mbtfm::beads {
namespace {

/// Commas instead of the separators that spreadsheets and other programs write.
std::string with_commas(std::string text) {
  const std::string header = text.substr(0, text.find('\n'));
  for (const char separator : {';', '\t'}) {
    if (header.find(',') == std::string::npos && header.find(separator) != std::string::npos) {
      std::replace(text.begin(), text.end(), separator, ',');
    }
  }
  if (!text.empty() && text.back() != '\n') text += '\n';
  return text;
}

bool is_missing(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text.empty() || text == "nan" || text == "-nan" || text == "na" || text == "inf" || text == "-inf";
}

double scale_of(const TrackParameters& parameters) {
  if (parameters.length_unit == LengthUnit::um) return 1;
  if (parameters.pixel_size_um) return *parameters.pixel_size_um;
  throw UsageError("length_unit = px needs pixel_size_um: give it in cell.toml or as --pixel_size_um");
}

struct GivenField {
  DisplacementField field;
  bool has_sigma = false;
};

GivenField read_rows(const std::filesystem::path& file, const TrackParameters& p) {
  const files::CsvTable table(with_commas(files::read_text(file)), file.string());
  table.require({p.x_column, p.y_column, p.ux_column, p.uy_column});
  const double scale = scale_of(p), first = p.length_unit == LengthUnit::px ? 0.5 : 0;
  const Range within = Range::between(-kFarthest_um / scale, kFarthest_um / scale);
  GivenField given{.field = {}, .has_sigma = table.has(p.sigma_column)};
  std::set<std::pair<double, double>> taken;
  for (int row = 0; row < table.n_rows(); ++row) {
    Bead bead;
    bead.position_um = {scale * (table.number(row, p.x_column, within) + first),
                        scale * (table.number(row, p.y_column, within) + first)};
    if (table.has("flag")) bead.flag = table.text(row, "flag");
    const bool lacks = is_missing(table.text(row, p.ux_column)) || is_missing(table.text(row, p.uy_column)) ||
                       (given.has_sigma && is_missing(table.text(row, p.sigma_column)));
    if (lacks) {
      bead.flag = "not a number";
    } else {
      bead.displacement_um = {scale * table.number(row, p.ux_column, within),
                              scale * table.number(row, p.uy_column, within)};
      if (given.has_sigma)
        bead.sigma_um = scale * table.number(row, p.sigma_column, Range::between(0, kFarthest_um / scale));
    }
    if (!taken.emplace(bead.position_um.x, bead.position_um.y).second) bead.flag = "duplicate";
    given.field.push_back(bead);
  }
  return given;
}

/// What a point differs by from the affine motion of its nearest neighbours.
struct Misfit {
  double distance = 0, spread = 0, gradient = 0, component = -1;
};

std::vector<Misfit> misfits_of(const DisplacementField& field) {
  constexpr int kNeighbours = 12;
  std::vector<Vec2> positions;
  std::vector<Motion> motions;
  std::vector<int> indices;
  for (std::size_t k = 0; k < field.size(); ++k) {
    if (!field[k].flag.empty()) continue;
    positions.push_back(field[k].position_um);
    motions.push_back({field[k].displacement_um});
    indices.push_back(static_cast<int>(k));
  }
  std::vector<Misfit> result(field.size());
  if (positions.size() < kNeighbours) return result;
  const double area = std::max(1e-12, extent_of(positions).area_um2());
  const double spacing = std::sqrt(area / static_cast<double>(positions.size()));
  const Neighbours neighbours(positions, 2 * spacing);
  for (std::size_t k = 0; k < positions.size(); ++k) {
    std::vector<int> around = neighbours.within(positions[k], 4 * spacing, kNeighbours + 1);
    std::erase(around, static_cast<int>(k));
    const auto local = local_motion(positions[k], around, positions, motions);
    if (!local || local->n_beads < 6) continue;
    const Vec2 apart = motions[k].u - local->motion.u;
    const Motion& g = local->motion;
    result[indices[k]] = {.distance = norm(apart),
                          .spread = local->spread_px,
                          .gradient = std::hypot(std::hypot(g.ux_x, g.ux_y), std::hypot(g.uy_x, g.uy_y)),
                          .component = norm(apart) / std::sqrt(2 * (1 + local->noise_share))};
  }
  return result;
}

/// Robust standard deviation of a component about the neighbours, where the field changes least.
double scatter_um(const std::vector<Misfit>& misfits) {
  std::vector<double> gradients, sizes;
  for (const Misfit& m : misfits) {
    if (m.component >= 0) gradients.push_back(m.gradient);
  }
  const double calm = numerics::quantile(std::move(gradients), 0.5);
  for (const Misfit& m : misfits) {
    if (m.component >= 0 && m.gradient <= calm) sizes.push_back(m.component);
  }
  return numerics::quantile(std::move(sizes), 0.5) / std::sqrt(std::log(2.0));  // the median of a component pair's rms
}

}  // namespace

DisplacementField read_given_field(const std::filesystem::path& file, const TrackParameters& parameters) {
  auto [field, has_sigma] = read_rows(file, parameters);
  std::vector<double> lengths;
  for (const Bead& bead : field) {
    if (bead.flag.empty()) lengths.push_back(norm(bead.displacement_um));
  }
  if (lengths.empty()) throw InputError(file.string(), "displacements", "none that is a number", "check the columns");
  const std::vector<Misfit> misfits = misfits_of(field);
  // what a field's curvature between the neighbours may do without being wrong
  const double floor_um = 0.05 * numerics::quantile(lengths, 0.99);
  const double sigma_um = has_sigma ? 0 : scatter_um(misfits);
  for (std::size_t k = 0; k < field.size(); ++k) {
    Bead& bead = field[k];
    if (!has_sigma) bead.sigma_um = sigma_um;
    const double allowed = parameters.outlier_threshold * std::hypot(misfits[k].spread, bead.sigma_um) + floor_um;
    if (bead.flag.empty() && misfits[k].distance > allowed) bead.flag = "neighbours disagree";
  }
  return field;
}

double outwardness(const DisplacementField& field) {
  const auto moves = [](const Bead& b) { return b.flag.empty() && norm(b.displacement_um) > 3 * b.sigma_um; };
  Vec2 centre;
  double total = 0;
  int n = 0;
  for (const Bead& bead : field) {
    if (!moves(bead)) continue;
    const double weight = dot(bead.displacement_um, bead.displacement_um);
    centre += weight * bead.position_um;
    total += weight;
    ++n;
  }
  if (n < 20) return 0;
  centre = (1 / total) * centre;
  struct Quarter {
    double cosines = 0, total = 0;
  };
  std::array<Quarter, 4> quarters;
  for (const Bead& bead : field) {
    const Vec2 out = bead.position_um - centre;
    if (!moves(bead) || !(norm(out) > 0)) continue;
    Quarter& quarter = quarters[(out.x > 0) + 2 * (out.y > 0)];
    quarter.cosines += norm(bead.displacement_um) * dot(bead.displacement_um, out) / norm(out);
    quarter.total += dot(bead.displacement_um, bead.displacement_um);
  }
  double sum = 0;  // where nothing moves, nothing moves outward
  for (const auto& [cosines, of_quarter] : quarters) sum += of_quarter > 0 ? cosines / of_quarter : 0;
  return sum / 4;
}

GivenMotion take_motion_off(DisplacementField& field, const TrackParameters& parameters) {
  std::vector<Vec2> positions, displacements;
  for (const Bead& bead : field) {
    if (!bead.flag.empty()) continue;
    positions.push_back(bead.position_um);
    displacements.push_back(bead.displacement_um);
  }
  const auto [first, last] = extent_of(positions);
  constexpr std::size_t kFewest = 100;  // squares enough that a motion of six numbers is no chance
  if (positions.size() < kFewest || !(last.x > first.x) || !(last.y > first.y)) {
    if (parameters.places == TablePlaces::relaxed)
      throw InvalidData("the displacement", std::to_string(kFewest) + " vectors, so that the stage's motion is found",
                        std::to_string(positions.size()));
    return {
        .common = {},
        .affine = stage::decided(EffectKind::affine_drift, Switch::automatic, false, "too few places would show it")};
  }
  const MotionTaken all = motion_taken(positions, displacements, first, last.x - first.x, last.y - first.y,
                                       parameters.drift_affine, parameters.effect_tolerance, 0);
  const bool are_moved = parameters.places == TablePlaces::relaxed;
  if (all.affine.is_on || are_moved) {
    for (Bead& bead : field) {
      const Vec2 motion_um = all.motion.at(bead.position_um);
      bead.displacement_um = bead.displacement_um - motion_um;
      if (are_moved) bead.position_um += motion_um;
    }
  }
  // a cell that lies aside by 0.3 um, half an adhesion, costs one or two per cent of its force
  constexpr double kMatters_um = 0.3, kCertain = 4;  // standard errors
  const double drift_um = norm(all.common.drift_um);
  const bool matters =
      drift_um > std::max(kMatters_um, kCertain * all.common.drift_sigma_um) && all.common.has_far_field;
  GivenMotion result{.common = all.common, .affine = all.affine};
  if (matters && parameters.places == TablePlaces::automatic) result.unplaced_um = drift_um;
  return result;
}

bool points_outward(const DisplacementField& field, const CommonMotion& common, bool is_affine_left) {
  // a contracting cell has -0.7 to -0.5, exchanged +0.5 to +0.7; one whose part alone is in view up to +0.3
  constexpr double kOutward = 0.4;
  // a cell that the border cuts moves it as much as anything
  constexpr double kReached = 0.5;
  return common.has_far_field && !is_affine_left && common.pull_of_border <= kReached && outwardness(field) > kOutward;
}

}  // namespace mbtfm::beads
