#include "segment/beads/given_field.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/place.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/numerics/masked_values.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/effects.h"
#include "segment/beads/far_field.h"
#include "segment/beads/given_table.h"
#include "segment/beads/local_motion.h"

namespace mbtfm::beads {
namespace {

/// What no field can be displaced by is flagged later on.
constexpr double kNoDisplacement_um = 2 * kFarthest_um;

/// A number of the table in um, whatever its size: programs write 1e10 where they have none. Nothing where it is
/// missing.
std::optional<double> um_in(const GivenTable& table, int row, const std::string& column, double unit_um,
                            double first = 0) {
  const std::string cell = table.rows.text(row, column);
  if (files::is_missing(cell)) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (end != cell.data() + cell.size() || (error != std::errc() && error != std::errc::result_out_of_range))
    table.rows.fail(
        row, column, "a number",
        "one decimal mark, nothing between thousands; take out a row that is no vector, and save each time or "
        "zone by itself");
  // too small, or too large, for a number
  if (error != std::errc())
    value = cell.find("e-") == cell.npos && cell.find("E-") == cell.npos ? kNoDisplacement_um : 0;
  return std::clamp(unit_um * (value + first), -kNoDisplacement_um, kNoDisplacement_um);
}

/// @throws InputError where many places have several displacements: a table of several times, slices or cells
void flag_duplicates(DisplacementField& field, const std::string& name) {
  std::vector<std::size_t> order(field.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto place = [&](std::size_t k) { return std::pair(field[k].position_um.x, field[k].position_um.y); };
  std::ranges::sort(order,
                    [&](std::size_t a, std::size_t b) { return std::pair(place(a), a) < std::pair(place(b), b); });
  constexpr std::size_t kSome = 10;  // of so many rows one may be a slip
  std::size_t n_unlike = 0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    Bead &bead = field[order[k]], &other = field[order[k - 1]];
    if (place(order[k]) != place(order[k - 1])) continue;
    n_unlike += bead.flag.empty() && !(bead.displacement_um == other.displacement_um);
    bead.flag = "duplicate";
  }
  if (kSome * n_unlike > field.size())
    throw InputError(name, "one displacement at each place",
                     std::to_string(n_unlike) + " of " + std::to_string(field.size()) + " rows at another one's place",
                     "leave one time, slice or frame in the table");
}

/// y from upwards to downwards. The windows of a lattice begin at the picture's corner: the first row is as far from
/// the upper border as the first column from the left one. Of single beads the picture's height must be known, or their
/// middle is its middle.
void mirror(DisplacementField& field, const GivenTable& table, std::optional<double> height_um) {
  const Extent extent = extent_of(field, &Bead::position_um);
  const double sum_um =
      table.is_lattice ? extent.high_um.y + extent.low_um.x : height_um.value_or(extent.low_um.y + extent.high_um.y);
  for (Bead& bead : field) {
    bead.position_um.y = sum_um - bead.position_um.y;
    bead.displacement_um.y = -bead.displacement_um.y;
  }
}

/// Half a spacing of a lattice along x.
double half_step_um(const DisplacementField& field) {
  std::vector<double> places;
  for (const Bead& bead : field) places.push_back(bead.position_um.x);
  std::ranges::sort(places);
  const double same = 1e-6 * (places.back() - places.front());
  places.erase(std::unique(places.begin(), places.end(), [&](double a, double b) { return b - a <= same; }),
               places.end());
  return places.size() > 1 ? 0.5 * (places.back() - places.front()) / static_cast<double>(places.size() - 1) : 0;
}

/// Programs count from a calibrated origin within the picture, too. A lattice of theirs begins at the picture's corner.
void move_to_corner(GivenField& given, const GivenTable& table) {
  const Extent extent = extent_of(given.field, &Bead::position_um);
  if (table.is_ours || !table.is_lattice || (extent.low_um.x >= 0 && (table.is_y_up || extent.low_um.y >= 0))) return;
  const double half_um = half_step_um(given.field);
  const Vec2 shift = Vec2{half_um, half_um} - extent.low_um;
  for (Bead& bead : given.field) bead.position_um += shift;
  given.findings.push_back(*noticed(Symptom::assumed_input, 1,
                                    {.at = "The table's places begin at (" + brief(extent.low_um.x) + ", " +
                                           brief(extent.low_um.y) + ") um and are moved to the picture's corner.",
                                     .severity = Severity::caution}));
}

/// What one program calls a mask is 1 where it measured, in others where it did not: the smaller part is masked.
void expect_most_measured(const GivenTable& table) {
  for (const MarkColumn& column : table.marks) {
    if (column.mark != RowMark::zero_if_measured) continue;
    int n_masked = 0;
    for (int row = 0; row < table.rows.n_rows(); ++row)
      n_masked += !flag_of(column.mark, table.rows.text(row, column.name)).empty();
    if (2 * n_masked <= table.rows.n_rows()) continue;
    table.rows.fail(0, column.name, "0 in most rows, as of vectors that were measured",
                    "if it has 1 where they were measured, call the column valid; else take the masked rows out");
  }
}

GivenField read_rows(const GivenTable& table, std::optional<double> height_um, const std::string& name) {
  GivenField given{.form = table.form, .how = table.how, .n_left_out = table.n_left_out};
  given.has_sigma = !table.sigma.empty();
  expect_most_measured(table);
  const bool has_flags = table.rows.has("flag");
  const Range within = possible_place_um();
  for (int row = 0; row < table.rows.n_rows(); ++row) {
    const auto x = um_in(table, row, table.x, table.place_um, table.first);
    const auto y = um_in(table, row, table.y, table.place_um, table.first);
    if (!x || !y) {
      ++given.n_left_out;
      continue;
    }
    for (const auto& [value, column] : {std::pair(*x, table.x), {*y, table.y}})
      if (!is_inside(within, value)) table.rows.fail(row, column, "a place within a metre");
    Bead& bead = given.field.emplace_back();
    bead.position_um = {*x, *y};
    if (has_flags) bead.flag = table.rows.text(row, "flag");
    if (files::numeral_in(bead.flag) != files::Numeral::none) bead.flag = flag_of(RowMark::zero_if_measured, bead.flag);
    for (const MarkColumn& column : table.marks)
      if (bead.flag.empty()) bead.flag = flag_of(column.mark, table.rows.text(row, column.name));
    const auto ux = um_in(table, row, table.ux, table.displacement_um);
    const auto uy = um_in(table, row, table.uy, table.displacement_um);
    const auto sigma = given.has_sigma ? um_in(table, row, table.sigma, table.sigma_um) : 0;
    if (ux && uy && sigma) {
      bead.displacement_um = {*ux, *uy};
      bead.sigma_um = *sigma;
      if (*sigma < 0) table.rows.fail(row, table.sigma, "a number >= 0");
    } else {
      bead.flag = "not a number";
    }
  }
  move_to_corner(given, table);
  if (table.is_y_up) mirror(given.field, table, height_um);
  flag_duplicates(given.field, name);
  return given;
}

void notice_mirrored(const GivenTable& table, std::vector<Finding>& findings) {
  if (table.is_y_up_stated) return;
  findings.push_back(
      *noticed(Symptom::assumed_input, 1,
               {.at = "y falls from row to row and is read as pointing up. If it points down, set track.y_axis = down.",
                .severity = Severity::caution}));
}

/// Rows where their program has no displacement. They get none.
void flag_masked(GivenField& given) {
  DisplacementField& field = given.field;
  constexpr std::size_t kFewest = 10;
  const Extent extent = extent_of(field, &Bead::position_um);
  const double farthest_um = norm(extent.high_um - extent.low_um);
  auto [n_masked, values] = numerics::flag_masked(field);
  std::size_t n_beyond = 0;
  for (Bead& bead : field) {
    const double length_um = norm(bead.displacement_um);
    if (!bead.flag.empty()) {
      if (length_um > kFarthest_um) bead.displacement_um = {};
    } else if (length_um > kFarthest_um || (field.size() >= kFewest && farthest_um > 0 && length_um > farthest_um)) {
      bead.flag = "masked";
      bead.displacement_um = {};
      ++n_masked, ++n_beyond;
    }
  }
  if (n_masked == 0) return;
  given.findings.push_back(
      *noticed(Symptom::vectors_masked, static_cast<double>(n_masked) / static_cast<double>(field.size()),
               {.at = values.empty() ? "they are longer than the field is wide"
                                     : "they have the displacement " + listed(values) + " um to the last digit" +
                                           (n_beyond > 0 ? ", or one longer than the field is wide" : "")}));
}

/// @throws InputError where the columns hold the places of the other picture: they rise with the places
void expect_no_places(const DisplacementField& field, const std::string& file) {
  constexpr double kFewest = 20, kStretch = 0.5;  // no gel with a cell on it stretches by half
  double n = 0, x = 0, y = 0, ux = 0, uy = 0, xx = 0, yy = 0, xux = 0, yuy = 0;
  for (const Bead& bead : field) {
    if (!bead.flag.empty()) continue;
    const Vec2 p = bead.position_um, u = bead.displacement_um;
    n += 1, x += p.x, y += p.y, ux += u.x, uy += u.y, xx += p.x * p.x, yy += p.y * p.y, xux += p.x * u.x,
        yuy += p.y * u.y;
  }
  if (n >= kFewest && n * xux - x * ux > kStretch * (n * xx - x * x) && n * yuy - y * uy > kStretch * (n * yy - y * y))
    throw InputError(file, "displacements", "numbers that rise with the places, as the places of the other picture do",
                     "subtract the places of the relaxed picture from those of the stressed one");
}

/// @throws InputError where the columns hold lengths and angles: none below 0, and a full turn
void expect_no_angles(const DisplacementField& field, double unit_um, const std::string& file) {
  constexpr std::size_t kFewest = 20;
  constexpr double kEnd = 0.98;  // of a turn
  double lowest = 0, low = 0, high = 0;
  for (const Bead& bead : field) {
    if (!bead.flag.empty()) continue;
    lowest = std::min(lowest, bead.displacement_um.x / unit_um);
    low = std::min(low, bead.displacement_um.y / unit_um), high = std::max(high, bead.displacement_um.y / unit_um);
  }
  const auto is_turn = [&](double from, double to) {
    const double slack = (1 - kEnd) * (to - from);
    return low >= from && low <= from + slack && high <= to && high >= to - slack;
  };
  const double pi = std::acos(-1.0);
  if (field.size() >= kFewest && lowest == 0 && (is_turn(-180, 180) || is_turn(0, 360) || is_turn(-pi, pi)))
    throw InputError(file, "displacements along x and y", "numbers that look like a length and an angle",
                     "make two columns of them: ux = length x cos(angle) and uy = length x sin(angle)");
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

GivenField read_given_field(const std::filesystem::path& file, const TrackParameters& parameters,
                            const std::optional<images::ImageField>& picture) {
  const GivenTable table = read_given_table(file, parameters, picture);
  std::optional<double> height_um;
  if (picture && parameters.pixel_size_um) height_um = *parameters.pixel_size_um * picture->height;
  GivenField given = read_rows(table, height_um, file.string());
  DisplacementField& field = given.field;
  notice_mirrored(table, given.findings);
  expect_no_angles(field, table.displacement_um, file.string());
  flag_masked(given);
  expect_no_places(field, file.string());
  std::vector<double> lengths;
  for (const Bead& bead : field) {
    if (bead.flag.empty()) lengths.push_back(norm(bead.displacement_um));
  }
  if (lengths.empty()) throw InputError(file.string(), "displacements", "none that is a number", "check the columns");
  const std::vector<Misfit> misfits = misfits_of(field);
  // what a field's curvature between the neighbours may do without being wrong
  const double floor_um = 0.05 * numerics::quantile(lengths, 0.99);
  const double sigma_um = given.has_sigma ? 0 : scatter_um(misfits);
  for (std::size_t k = 0; k < field.size(); ++k) {
    Bead& bead = field[k];
    if (!given.has_sigma) bead.sigma_um = sigma_um;
    const double allowed = parameters.outlier_threshold * std::hypot(misfits[k].spread, bead.sigma_um) + floor_um;
    if (bead.flag.empty() && misfits[k].distance > allowed) bead.flag = "neighbours disagree";
  }
  return given;
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
