#include <algorithm>
#include <cstdio>
#include <map>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/named_array.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {

namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;  // angles are degrees only where a person reads them

/// Call check(value) and say which file broke the invariant.
template <class T>
void check_read(const Path& file, const T& value) {
  try {
    check(value);
  } catch (const InvalidData& error) {
    throw InputError(file.string() + ": " + error.element, error.expected, error.found);
  }
}

Range share_of_one() { return Range::between(0, 1); }

bool read_flag(const CsvTable& table, int row, const std::string& column) {
  const std::string text = table.text(row, column);
  if (text != "true" && text != "false") table.fail(row, column, "true or false");
  return text == "true";
}

const char* text_of(bool value) { return value ? "true" : "false"; }

}  // namespace

std::vector<Adhesion> read_adhesions(const Path& file) {
  CsvTable table(file);
  table.require({"adhesion_id", "x_um", "y_um", "area_um2", "major_axis_um", "minor_axis_um", "angle_deg",
                 "eccentricity", "mean_intensity"});
  table.label_rows_by("adhesion_id", "adhesion");
  std::vector<Adhesion> adhesions(table.n_rows());
  for (int row = 0; row < table.n_rows(); ++row) {
    adhesions[row] = {.adhesion_id = table.integer(row, "adhesion_id", 1),
                      .position_um = {table.number(row, "x_um"), table.number(row, "y_um")},
                      .area_um2 = table.number(row, "area_um2", Range::positive()),
                      .major_axis_um = table.number(row, "major_axis_um", Range::positive()),
                      .minor_axis_um = table.number(row, "minor_axis_um", Range::positive()),
                      .angle_rad = table.number(row, "angle_deg") * kDegree_rad,
                      .eccentricity = table.number(row, "eccentricity", share_of_one()),
                      .mean_intensity = table.number(row, "mean_intensity")};
    if (table.has("origin")) {
      const auto origin = named<AdhesionOrigin>(table.text(row, "origin"));
      if (!origin) table.fail(row, "origin", "image, drawn, anchor or candidate");
      adhesions[row].origin = *origin;
    }
    if (table.has("edge_distance_um")) adhesions[row].edge_distance_um = table.optional_number(row, "edge_distance_um");
  }
  check_read(file, adhesions);
  return adhesions;
}

void write_adhesions(const Path& file, const std::vector<Adhesion>& adhesions) {
  check(adhesions);
  CsvText csv({"adhesion_id", "x_um", "y_um", "area_um2", "major_axis_um", "minor_axis_um", "angle_deg", "eccentricity",
               "mean_intensity", "origin", "edge_distance_um"});
  for (const Adhesion& a : adhesions) {
    csv.add(a.adhesion_id).add(a.position_um.x).add(a.position_um.y).add(a.area_um2);
    csv.add(a.major_axis_um).add(a.minor_axis_um).add(a.angle_rad / kDegree_rad).add(a.eccentricity);
    csv.add(a.mean_intensity).add(name_of(a.origin)).add(a.edge_distance_um).end_row();
  }
  write_text(file, csv.str());
}

std::vector<Fibre> read_fibres(const Path& fibres_file, const Path& points_file) {
  CsvTable table(fibres_file);
  table.require({"fibre_id", "type", "length_um", "width_um", "start_adhesion_id", "end_adhesion_id", "mean_intensity",
                 "confidence"});
  table.label_rows_by("fibre_id", "fibre");
  std::vector<Fibre> fibres(table.n_rows());
  std::map<int, int> index_of;
  for (int row = 0; row < table.n_rows(); ++row) {
    const auto type = named<FibreType>(table.text(row, "type"));
    if (!type) table.fail(row, "type", "dorsal, arc, ventral or edge");
    fibres[row] = {.fibre_id = table.integer(row, "fibre_id", 1),
                   .type = *type,
                   .width_um = table.number(row, "width_um", Range::positive()),
                   .start_adhesion_id = table.optional_integer(row, "start_adhesion_id", 1),
                   .end_adhesion_id = table.optional_integer(row, "end_adhesion_id", 1),
                   .mean_intensity = table.number(row, "mean_intensity"),
                   .confidence = table.number(row, "confidence", share_of_one()),
                   .points_um = {},
                   .type_reason = {}};
    if (table.has("type_confidence"))
      fibres[row].type_confidence = table.number(row, "type_confidence", share_of_one());
    if (table.has("type_reason")) fibres[row].type_reason = table.text(row, "type_reason");
    index_of[fibres[row].fibre_id] = row;
  }
  CsvTable points(points_file);
  points.require({"fibre_id", "point", "x_um", "y_um"});
  for (int row = 0; row < points.n_rows(); ++row) {
    const auto at = index_of.find(points.integer(row, "fibre_id", 1));
    if (at == index_of.end()) points.fail(row, "fibre_id", "the label of a fibre of " + fibres_file.string());
    Polyline& line = fibres[at->second].points_um;
    const int point = points.integer(row, "point", 0);
    if (point != static_cast<int>(line.size())) {
      points.fail(row, "point", std::to_string(line.size()) + ", the fibre's next point");
    }
    line.push_back({points.number(row, "x_um"), points.number(row, "y_um")});
  }
  check_read(points_file, fibres);
  return fibres;
}

void write_fibres(const Path& fibres_file, const Path& points_file, const std::vector<Fibre>& fibres) {
  check(fibres);
  CsvText csv({"fibre_id", "type", "length_um", "width_um", "start_adhesion_id", "end_adhesion_id", "mean_intensity",
               "confidence", "type_confidence", "type_reason"});
  CsvText points({"fibre_id", "point", "x_um", "y_um"});
  for (const Fibre& f : fibres) {
    csv.add(f.fibre_id).add(name_of(f.type)).add(length_um(f.points_um)).add(f.width_um);
    csv.add(f.start_adhesion_id).add(f.end_adhesion_id).add(f.mean_intensity).add(f.confidence);
    csv.add(f.type_confidence).add(f.type_reason).end_row();
    for (std::size_t i = 0; i < f.points_um.size(); ++i) {
      points.add(f.fibre_id).add(static_cast<int>(i)).add(f.points_um[i].x).add(f.points_um[i].y).end_row();
    }
  }
  write_text(fibres_file, csv.str());
  write_text(points_file, points.str());
}

std::vector<Vec2> read_points(const Path& file) {
  CsvTable table(file);
  std::vector<Vec2> points;
  for (int row = 0; row < table.n_rows(); ++row) {
    points.push_back({table.number(row, "x_um"), table.number(row, "y_um")});
  }
  return points;
}

namespace {

struct Outline {
  std::vector<Polygon> rings_um;
  std::vector<bool> is_cut;  ///< by piece of the outer ring; empty: none
};

Outline outline_in(const Path& file) {
  CsvTable table(file);
  Outline outline{.rings_um = std::vector<Polygon>(1), .is_cut = {}};
  std::vector<Polygon>& rings = outline.rings_um;
  const bool tells_cuts = table.has("is_cut");
  for (int row = 0; row < table.n_rows(); ++row) {
    const int ring = table.has("ring") ? table.integer(row, "ring", 0) : 0;
    const int current = static_cast<int>(rings.size()) - 1;
    if (ring != current && ring != current + 1) {
      table.fail(row, "ring", std::to_string(current) + " or " + std::to_string(current + 1) + ", rings in order");
    }
    if (ring > current) rings.emplace_back();
    rings[ring].push_back({table.number(row, "x_um"), table.number(row, "y_um")});
    if (!tells_cuts) continue;
    const bool is_cut = read_flag(table, row, "is_cut");
    if (ring > 0 && is_cut) table.fail(row, "is_cut", "false: the rim of a hole is no cut");
    if (ring == 0) outline.is_cut.push_back(is_cut);
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
  const bool tells_cuts = std::ranges::find(is_cut, true) != is_cut.end();
  std::vector<std::string> header = {"x_um", "y_um", "ring"};
  if (tells_cuts) header.emplace_back("is_cut");
  CsvText csv(header);
  const auto add = [&](Vec2 p, int ring, bool cut) {
    csv.add(p.x).add(p.y).add(ring);
    if (tells_cuts) csv.add(text_of(cut));
    csv.end_row();
  };
  for (std::size_t i = 0; i < outer_um.size(); ++i) add(outer_um[i], 0, tells_cuts && is_cut[i]);
  for (std::size_t i = 0; i < holes_um.size(); ++i)
    for (const Vec2 p : holes_um[i]) add(p, static_cast<int>(i) + 1, false);
  write_text(file, csv.str());
}

Cell read_cell(const Path& folder) {
  Outline outline = outline_in(folder / "outline.csv");
  Cell cell{.adhesions = read_adhesions(folder / "adhesions.csv"),
            .fibres = read_fibres(folder / "fibres.csv", folder / "fibre_points.csv"),
            .outline_um = outline.rings_um.front(),
            .holes_um = {outline.rings_um.begin() + 1, outline.rings_um.end()},
            .is_cut = std::move(outline.is_cut)};
  check_read(folder, cell);
  return cell;
}

DisplacementField read_displacement(const Path& file) {
  CsvTable table(file);
  table.require({"x_um", "y_um", "ux_um", "uy_um"});
  const bool has_errors = table.has("sigma_um"), has_flags = table.has("flag");
  DisplacementField field(table.n_rows());
  for (int row = 0; row < table.n_rows(); ++row) {
    field[row] = {.position_um = {table.number(row, "x_um"), table.number(row, "y_um")},
                  .displacement_um = {table.number(row, "ux_um"), table.number(row, "uy_um")},
                  .sigma_um = has_errors ? table.number(row, "sigma_um", Range::not_negative()) : 0,
                  .flag = has_flags ? table.text(row, "flag") : std::string()};
  }
  return field;
}

void write_displacement(const Path& file, const DisplacementField& field) {
  check(field);
  CsvText csv({"x_um", "y_um", "ux_um", "uy_um", "sigma_um", "flag"});
  for (const Bead& b : field) {
    csv.add(b.position_um.x).add(b.position_um.y).add(b.displacement_um.x).add(b.displacement_um.y);
    csv.add(b.sigma_um).add(b.flag).end_row();
  }
  write_text(file, csv.str());
}

std::string displacement_of_frame(int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "displacement_%04d.csv", frame);
  return name;
}

std::vector<Tension> read_tensions(const Path& file) {
  CsvTable table(file);
  table.require({"fibre_id", "tension_nN"});
  table.label_rows_by("fibre_id", "fibre");
  std::vector<Tension> tensions(table.n_rows());
  for (int row = 0; row < table.n_rows(); ++row) {
    Tension& t = tensions[row];
    t.fibre_id = table.integer(row, "fibre_id", 0);
    t.tension_nN = table.number(row, "tension_nN", Range::not_negative());
    if (table.has("low_nN")) t.low_nN = table.optional_number(row, "low_nN");
    if (table.has("high_nN")) t.high_nN = table.optional_number(row, "high_nN");
    if (table.has("identifiable")) t.identifiable = read_flag(table, row, "identifiable");
  }
  return tensions;
}

void write_tensions(const Path& file, const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres) {
  std::map<int, std::string_view> type_of = {{0, "network"}};
  for (const Fibre& f : fibres) type_of[f.fibre_id] = name_of(f.type);
  CsvText csv({"fibre_id", "type", "tension_nN", "low_nN", "high_nN", "identifiable"});
  for (const Tension& t : tensions) {
    MBTFM_ASSERT(type_of.contains(t.fibre_id));
    csv.add(t.fibre_id).add(type_of[t.fibre_id]).add(t.tension_nN).add(t.low_nN).add(t.high_nN);
    csv.add(text_of(t.identifiable)).end_row();
  }
  write_text(file, csv.str());
}

std::vector<AdhesionForce> read_adhesion_forces(const Path& file) {
  CsvTable table(file);
  table.require({"adhesion_id", "fx_nN", "fy_nN"});
  table.label_rows_by("adhesion_id", "adhesion");
  std::vector<AdhesionForce> forces(table.n_rows());
  for (int row = 0; row < table.n_rows(); ++row) {
    AdhesionForce& f = forces[row];
    f.adhesion_id = table.integer(row, "adhesion_id", 1);
    f.force_nN = {table.number(row, "fx_nN"), table.number(row, "fy_nN")};
    if (table.has("sigma_nN")) f.sigma_nN = table.optional_number(row, "sigma_nN");
    if (table.has("connected")) f.connected = read_flag(table, row, "connected");
    if (table.has("moment_nN_um")) f.moment_nN_um = table.optional_number(row, "moment_nN_um");
  }
  return forces;
}

void write_adhesion_forces(const Path& file, const std::vector<AdhesionForce>& forces,
                           const std::vector<Adhesion>& adhesions, const std::vector<PointArray>& more) {
  std::map<int, const Adhesion*> adhesion_of;
  for (const Adhesion& a : adhesions) adhesion_of[a.adhesion_id] = &a;
  std::vector<std::string> header = {"adhesion_id", "x_um",         "y_um",     "area_um2",  "fx_nN",       "fy_nN",
                                     "force_nN",    "traction_kPa", "sigma_nN", "connected", "moment_nN_um"};
  for (const PointArray& column : more) {
    MBTFM_ASSERT(column.scalars.size() == forces.size());
    header.push_back(column.name);
  }
  CsvText csv(header);
  for (std::size_t row = 0; row < forces.size(); ++row) {
    const AdhesionForce& f = forces[row];
    MBTFM_ASSERT(adhesion_of.contains(f.adhesion_id));
    const Adhesion& a = *adhesion_of[f.adhesion_id];
    csv.add(f.adhesion_id).add(a.position_um.x).add(a.position_um.y).add(a.area_um2);
    csv.add(f.force_nN.x).add(f.force_nN.y).add(norm(f.force_nN)).add(norm(f.force_nN) / area_stood_for_um2(a));
    csv.add(f.sigma_nN).add(text_of(f.connected)).add(f.moment_nN_um);
    for (const PointArray& column : more) csv.add(column.scalars[row]);
    csv.end_row();
  }
  write_text(file, csv.str());
}

void write_reactions(const Path& file, const std::vector<int>& vertices, const std::vector<Vec2>& forces_nN) {
  MBTFM_ASSERT(vertices.size() == forces_nN.size());
  CsvText csv({"vertex", "fx_nN", "fy_nN"});
  for (std::size_t i = 0; i < vertices.size(); ++i)
    csv.add(vertices[i]).add(forces_nN[i].x).add(forces_nN[i].y).end_row();
  write_text(file, csv.str());
}

}  // namespace mbtfm::files
