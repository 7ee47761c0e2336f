#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/files/table_text.h"
#include "pipeline/files/tables.h"

namespace mbtfm::files {

namespace {

/// Call check(value) and say which file broke the invariant.
template <class T>
void check_read(const Path& file, const T& value) {
  try {
    check(value);
  } catch (const InvalidData& error) {
    throw InputError(file.string() + ": " + error.element, error.expected, error.found);
  }
}

}  // namespace

std::vector<Adhesion> read_adhesions(const Path& file) {
  std::vector<Adhesion> adhesions = read(file, adhesion_table());
  check_read(file, adhesions);
  return adhesions;
}

void write_adhesions(const Path& file, const std::vector<Adhesion>& adhesions) {
  check(adhesions);
  write(file, adhesion_table(), adhesions);
}

std::vector<Fibre> read_fibres(const Path& fibres_file, const Path& points_file) {
  std::vector<Fibre> fibres = read(fibres_file, fibre_table());
  std::map<int, Fibre*> by_id;
  for (Fibre& fibre : fibres) by_id[fibre.fibre_id] = &fibre;
  CsvTable table(points_file);
  const std::vector<FibrePoint> points = rows_of(table, fibre_point_table());
  for (int row = 0; row < table.n_rows(); ++row) {
    const FibrePoint& point = points[row];
    const auto fibre = by_id.find(point.fibre_id);
    if (fibre == by_id.end()) table.fail(row, "fibre_id", "the label of a fibre of " + fibres_file.string());
    Polyline& line = fibre->second->points_um;
    if (point.point != static_cast<int>(line.size()))
      table.fail(row, "point", std::to_string(line.size()) + ", the fibre's next point");
    line.push_back(point.position_um);
  }
  check_read(points_file, fibres);
  return fibres;
}

void write_fibres(const Path& fibres_file, const Path& points_file, const std::vector<Fibre>& fibres) {
  check(fibres);
  std::vector<FibrePoint> points;
  for (const Fibre& f : fibres) {
    int n = 0;
    for (const Vec2 p : f.points_um) points.push_back({.fibre_id = f.fibre_id, .point = n++, .position_um = p});
  }
  write(fibres_file, fibre_table(), fibres);
  write(points_file, fibre_point_table(), points);
}

std::vector<Vec2> read_points(const Path& file) { return read(file, point_table()); }

namespace {

constexpr const char* kOffLattice = "points that lie on no lattice are read with --points";

/// The lines of a lattice across one axis, evenly apart.
struct Lines {
  double first = 0, step = 1;
  std::size_t n = 0;
};

Lines lines_of(const CsvTable& table, const std::string& column, const Path& file) {
  std::vector<double> at;
  for (int row = 0; row < table.n_rows(); ++row) at.push_back(table.number(row, column));
  std::ranges::sort(at);
  const double same = at.empty() ? 0 : 1e-6 * (at.back() - at.front());
  at.erase(std::unique(at.begin(), at.end(), [&](double a, double b) { return b - a <= same; }), at.end());
  if (at.size() < 4)
    throw InputError(file.string(), "a lattice of at least 4 different " + column, std::to_string(at.size()),
                     kOffLattice);
  return {.first = at.front(), .step = (at.back() - at.front()) / static_cast<double>(at.size() - 1), .n = at.size()};
}

std::size_t line_of(const CsvTable& table, int row, const std::string& column, const Lines& lines) {
  constexpr double kOff = 0.01;  // of a step: numbers of few digits
  const double place = (table.number(row, column) - lines.first) / lines.step;
  if (!(std::abs(place - std::round(place)) <= kOff))
    table.fail(row, column, "a place of an even lattice", kOffLattice);
  return static_cast<std::size_t>(std::lround(place));
}

/// Before memory is taken for them: points along a diagonal have as many vertices as the square of their number.
void require_mostly_there(const CsvTable& table, const Lines& x, const Lines& y, const Path& file) {
  constexpr std::size_t kSparsest = 10;
  if (x.n * y.n <= kSparsest * static_cast<std::size_t>(table.n_rows())) return;
  throw InputError(file.string(),
                   "heights at a tenth at least of the " + std::to_string(x.n) + " x " + std::to_string(y.n) +
                       " vertices of its lattice",
                   std::to_string(table.n_rows()) + " rows", kOffLattice);
}

}  // namespace

HeightMap read_heights(const Path& file) {
  const CsvTable table(file);
  table.require({"x_um", "y_um", "z_um"});
  const Lines x = lines_of(table, "x_um", file), y = lines_of(table, "y_um", file);
  require_mostly_there(table, x, y, file);
  HeightMap map{.origin_um = {x.first, y.first},
                .spacing_um = {x.step, y.step},
                .n_x = static_cast<int>(x.n),
                .n_y = static_cast<int>(y.n)};
  map.z_um.assign(x.n * y.n, std::numeric_limits<double>::quiet_NaN());
  std::vector<char> has_row(map.z_um.size(), 0);
  for (int row = 0; row < table.n_rows(); ++row) {
    const std::size_t at = line_of(table, row, "y_um", y) * x.n + line_of(table, row, "x_um", x);
    if (std::exchange(has_row[at], 1) != 0) table.fail(row, "x_um", "one row for each place of the lattice");
    if (const auto z = table.optional_number(row, "z_um")) map.z_um[at] = *z;
  }
  return map;
}

namespace {

struct Outline {
  std::vector<Polygon> rings_um;
  std::vector<bool> is_cut = {};  ///< by piece of the outer ring; empty: none
};

Outline outline_in(const Path& file) {
  CsvTable table(file);
  const std::vector<OutlinePoint> points = rows_of(table, outline_table());
  Outline outline{.rings_um = std::vector<Polygon>(1)};
  std::vector<Polygon>& rings = outline.rings_um;
  for (int row = 0; row < table.n_rows(); ++row) {
    const OutlinePoint& point = points[row];
    const int current = static_cast<int>(rings.size()) - 1;
    if (point.ring != current && point.ring != current + 1)
      table.fail(row, "ring", std::to_string(current) + " or " + std::to_string(current + 1) + ", rings in order");
    if (point.ring > current) rings.emplace_back();
    rings.back().push_back(point.position_um);
    if (point.ring > 0 && point.is_cut) table.fail(row, "is_cut", "FALSE: the rim of a hole is no cut");
    if (point.ring == 0) outline.is_cut.push_back(point.is_cut);
  }
  for (const Polygon& ring : rings) {
    if (ring.size() >= 3) continue;
    throw InputError(file.string(), "the corners of a closed outline, three at least", std::to_string(ring.size()));
  }
  if (std::ranges::find(outline.is_cut, true) == outline.is_cut.end()) outline.is_cut.clear();
  return outline;
}

}  // namespace

std::vector<Polygon> read_outline(const Path& file) { return outline_in(file).rings_um; }

void write_outline(const Path& file, const Polygon& outer_um, const std::vector<Polygon>& holes_um,
                   const std::vector<bool>& is_cut) {
  MBTFM_ASSERT(is_cut.empty() || is_cut.size() == outer_um.size());
  std::vector<OutlinePoint> points;
  for (std::size_t i = 0; i < outer_um.size(); ++i)
    points.push_back({.position_um = outer_um[i], .ring = 0, .is_cut = !is_cut.empty() && is_cut[i]});
  int ring = 0;
  for (const Polygon& hole : holes_um) {
    ++ring;
    for (const Vec2 p : hole) points.push_back({.position_um = p, .ring = ring});
  }
  Table<OutlinePoint> table = outline_table();
  if (std::ranges::find(is_cut, true) == is_cut.end()) table.columns = table.columns.without({"is_cut"});
  write(file, table, points);
}

Cell read_cell(const Path& folder) {
  if (!std::filesystem::exists(folder / "outline.csv") && std::filesystem::exists(folder / "1_segment/outline.csv"))
    throw InputError(folder.string(), "a folder of mbtfm-segment", "the cell that it is in",
                     "give " + (folder / "1_segment").string());
  Outline outline = outline_in(folder / "outline.csv");
  Cell cell{.adhesions = read_adhesions(folder / "adhesions.csv"),
            .fibres = read_fibres(folder / "fibres.csv", folder / "fibre_points.csv"),
            .outline_um = outline.rings_um.front(),
            .holes_um = {outline.rings_um.begin() + 1, outline.rings_um.end()},
            .is_cut = std::move(outline.is_cut)};
  if (const Path neighbours = folder / kNeighboursFile; std::filesystem::exists(neighbours))
    cell.neighbours_um = read_outline(neighbours);
  check_read(folder, cell);
  return cell;
}

DisplacementField read_displacement(const Path& file) {
  DisplacementField field = read(file, displacement_table());
  constexpr std::size_t kFewest = 10;  // beads that spread over a field
  const Extent extent = extent_of(field, &Bead::position_um);
  const double farthest_um = norm(extent.high_um - extent.low_um);
  const auto beyond = std::ranges::find_if(
      field, [&](const Bead& bead) { return bead.flag.empty() && norm(bead.displacement_um) > farthest_um; });
  if (field.size() >= kFewest && farthest_um > 0 && beyond != field.end()) {
    throw InputError(file.string(), "displacements shorter than the field is wide, " + brief(farthest_um) + " um",
                     brief(norm(beyond->displacement_um)) + " um",
                     "masked vectors of another program: mbtfm-track --displacement '" + file.string() +
                         "' --out 2_track flags them, take 2_track/displacement.csv then");
  }
  return field;
}

void write_displacement(const Path& file, const DisplacementField& field) {
  check(field);
  write(file, displacement_table(), field);
}

std::vector<BeadInSpace> read_displacement_in_space(const Path& file) {
  return read(file, displacement_in_space_table());
}

void write_displacement_in_space(const Path& file, const std::vector<BeadInSpace>& beads) {
  check(beads);
  write(file, displacement_in_space_table(), beads);
}

std::string displacement_of_frame(int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "displacement_%04d.csv", frame);
  return name;
}

Vec2 lattice_spacing_um(const std::vector<Vec2>& points, const Path& file) {
  const auto step = [&](double Vec2::*axis) {
    std::vector<double> values;
    for (const Vec2& p : points) values.push_back(p.*axis);
    std::ranges::sort(values);
    double smallest = 0;
    for (std::size_t k = 1; k < values.size(); ++k) {
      const double gap = values[k] - values[k - 1];
      // columns of a lattice, written with some digits
      if (gap > 1e-6 * (values.back() - values.front()) && (smallest == 0 || gap < smallest)) smallest = gap;
    }
    return smallest;
  };
  const Vec2 spacing = {step(&Vec2::x), step(&Vec2::y)};
  if (spacing.x > 0 && spacing.y > 0) return spacing;
  throw InputError(file.string(), "tractions on a lattice of at least two columns and rows, or a column area_um2",
                   std::to_string(points.size()) + " rows");
}

std::vector<GroundPatch> read_tractions(const Path& file) {
  const CsvTable table = read_columns(read_table_text(file), file.string(), {"x_um", "y_um", "tx_kPa", "ty_kPa"});
  std::vector<Vec2> points;
  for (int row = 0; row < table.n_rows(); ++row)
    points.push_back({table.number(row, "x_um"), table.number(row, "y_um")});
  const bool has_areas = table.has("area_um2");
  const Vec2 spacing = has_areas ? Vec2{} : lattice_spacing_um(points, file);
  std::vector<GroundPatch> patches;
  for (int row = 0; row < table.n_rows(); ++row)
    patches.push_back({points[row],
                       has_areas ? table.number(row, "area_um2", Range::positive()) : spacing.x * spacing.y,
                       {table.number(row, "tx_kPa"), table.number(row, "ty_kPa")},
                       {}});
  return patches;
}

std::vector<Tension> read_tensions(const Path& file) {
  std::vector<Tension> tensions;
  for (const FibreTension& row : read(file, tension_table())) tensions.push_back(row.tension);
  return tensions;
}

void write_tensions(const Path& file, const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres) {
  const std::vector<FibreTension> rows = with_types(tensions, fibres);
  for (const FibreTension& row : rows) MBTFM_ASSERT(row.type || row.tension.fibre_id == 0);
  write(file, tension_table(), rows);
}

std::vector<AdhesionForce> read_adhesion_forces(const Path& file) {
  std::vector<AdhesionForce> forces;
  for (const ForceOnAdhesion& row : read(file, adhesion_force_table())) forces.push_back(row.force);
  return forces;
}

void write_adhesion_forces(const Path& file, const std::vector<AdhesionForce>& forces,
                           const std::vector<Adhesion>& adhesions, const std::vector<NamedArray>& more) {
  Table<ForceOnAdhesion> table = adhesion_force_table();
  std::vector<ForceOnAdhesion> rows = forces_on(adhesions, forces);
  for (std::size_t k = 0; k < more.size(); ++k) {
    MBTFM_ASSERT(more[k].values.size() == forces.size());
    table.columns.push_back({more[k].name, [k](const ForceOnAdhesion& row) { return row.more[k]; }});
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].more.push_back(more[k].values[i]);
  }
  write(file, table, rows);
}

void write_reactions(const Path& file, const std::vector<int>& vertices, const std::vector<Vec2>& forces_nN) {
  MBTFM_ASSERT(vertices.size() == forces_nN.size());
  std::vector<Reaction> rows;
  for (std::size_t i = 0; i < vertices.size(); ++i) rows.push_back({.vertex = vertices[i], .force_nN = forces_nN[i]});
  write(file, reaction_table(), rows);
}

}  // namespace mbtfm::files
