#include "segment/beads/given_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/foreign_table.h"
#include "pipeline/files/names.h"
#include "pipeline/files/table_text.h"
#include "segment/beads/table_columns.h"

namespace mbtfm::beads {
namespace {

using files::CsvTable;
using files::ForeignTable;
using files::lower_case;
/// Names as people say them, in the order of TableForm.
constexpr std::array kPrograms = {"",      "",        "OpenPIV",   "PIVlab", "the PIV plugin of ImageJ",
                                  "DaVis", "Tecplot", "TrackMate", "pyTFM"};

bool has_columns(const ForeignTable& table, const std::set<std::string>& keys) {
  return std::ranges::any_of(table.above, [&](const CsvTable::Row& row) {
    std::set<std::string> found;
    for (const std::string& name : row.fields) found.insert(parts_of(without_marks(name)).key);
    return std::ranges::includes(found, keys);
  });
}

bool has_names_of_ours(const ForeignTable& table, const TrackParameters& p) {
  return std::ranges::any_of(table.above, [&](const CsvTable::Row& row) {
    return std::ranges::all_of(asked_for(p), [&](const Asked& asked) {
      return asked.name == asked.own && std::ranges::find(row.fields, asked.own) != row.fields.end();
    });
  });
}

/// By the head of the file.
TableForm form_of(const ForeignTable& table, const TrackParameters& parameters) {
  if (parameters.table != TableForm::automatic) return parameters.table;
  const std::string text = text_above(table);
  if (lower_case(text).find("=block") != text.npos)
    throw InputError(table.name, "a row for each vector", "blocks of one variable each",
                     "export it as points (F=POINT)");
  if (has_names_of_ours(table, parameters)) return TableForm::plain;
  if (text.find("DaVis") != text.npos) return TableForm::davis;
  if (!variables_of(table).empty()) return TableForm::tecplot;
  if (text.find("PIVlab") != text.npos || text.find("conversion factor xy") != text.npos ||
      has_columns(table, {"vectortype"}))
    return TableForm::pivlab;
  if (has_columns(table, {"ux1", "uy1", "mag1"})) return TableForm::imagej_piv;
  if (has_columns(table, {"label", "trackid"})) return TableForm::trackmate;
  if (has_columns(table, {"x", "y", "u", "v", "mask"}) || has_columns(table, {"x", "y", "u", "v", "flags"}))
    return TableForm::openpiv;
  constexpr std::array kWidthsOfImagej = {4, 5, 16};
  const auto n = static_cast<int>(table.rows.front().fields.size());
  if (table.above.empty() && table.separator == ' ' && std::ranges::find(kWidthsOfImagej, n) != kWidthsOfImagej.end() &&
      std::ranges::all_of(table.rows, [](const CsvTable::Row& row) {
        return files::numeral_in(row.fields[0]) == files::Numeral::whole &&
               files::numeral_in(row.fields[1]) == files::Numeral::whole;
      }))
    return TableForm::imagej_piv;
  return TableForm::plain;
}

/// "conversion factor xy (px -> m): 2e-07": metres by pixel, and m/s by pixel a frame.
struct PivlabFactors {
  double m_per_px = 1, m_per_s_per_px = 1;
  bool are_there = false;
};

std::optional<double> number_after(const std::string& text, const std::string& words) {
  const std::size_t found = text.find(words);
  if (found == text.npos) return std::nullopt;
  const std::size_t begin = text.find_first_not_of(": ", found + words.size());
  double value = 0;
  if (begin == text.npos || std::from_chars(text.data() + begin, text.data() + text.size(), value).ec != std::errc())
    return std::nullopt;
  return value;
}

PivlabFactors factors_of(const ForeignTable& table) {
  const std::string text = text_above(table);
  const auto xy = number_after(text, "(px -> m)"), uv = number_after(text, "(px/frame -> m/s)");
  if (!xy || !uv) return {};
  if (!(*xy > 0) || !(*uv > 0)) {
    throw InputError(table.name, "conversion factors > 0 in the lines above the header",
                     shortest(*xy) + " and " + shortest(*uv),
                     "let x point right in PIVlab's calibration, and export it again");
  }
  return {.m_per_px = *xy, .m_per_s_per_px = *uv, .are_there = true};
}

/// The units in DaVis's first line, place first: ... "position" "mm" "position" "mm" "velocity" "m/s".
std::vector<Unit> units_of_davis(const ForeignTable& table) {
  std::vector<Unit> units;
  for (const std::string& text : table.lines_above) {
    if (text.find("DaVis") == text.npos) continue;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      if (const auto unit = unit_named(text.substr(at, end - at))) units.push_back(*unit);
      at = end + 1;
    }
  }
  return units;
}

double pixel_um(const TrackParameters& parameters) {
  if (parameters.pixel_size_um) return *parameters.pixel_size_um;
  throw UsageError("lengths in px need pixel_size_um: give it in cell.toml or as --pixel_size_um");
}

/// A length of a column's unit. @throws InputError where nobody states it; UsageError where the pixel's size lacks
double um_of(const std::string& file, const std::string& column, const std::optional<Unit>& unit,
             const TrackParameters& parameters) {
  if (unit) return unit->um > 0 ? unit->um : pixel_um(parameters);
  throw InputError(file, "a unit of the column '" + column + "'",
                   column.find_first_of("[(") == column.npos ? "none in its name" : "one that is not known",
                   how_to_set("length_unit", "px") +
                       " if it is in pixels; um, mm or m are the others; convert the column if it is in none of them");
}

/// Seconds by which the column's numbers are multiplied; 1 for displacements.
double seconds_of(const std::string& file, const std::string& column, const std::optional<Unit>& stated,
                  const std::optional<double>& seconds) {
  const bool is_velocity = stated && stated->per_s > 0;
  if (stated && !is_velocity && seconds)
    throw InputError(file, "a velocity in the column '" + column + "'", "a displacement",
                     "leave track.seconds_between out");
  if (!is_velocity) return seconds.value_or(1);
  if (seconds) return stated->per_s * *seconds;
  throw InputError(file, "a displacement in the column '" + column + "'", "a velocity",
                   "set the time (s) between the images as in that program: track.seconds_between = 1 in cell.toml, or "
                   "--seconds_between 1");
}

/// The units of places and displacements: of the header, else of the parameter, else of the program.
void take_units(GivenTable& given, const std::string& file, const Found& found, const TrackParameters& parameters) {
  const auto& [x, y, ux, uy] = found.columns;
  const std::optional<Unit>&of_places = found.units[x], &of_displacements = found.units[ux];
  if (found.units[y] != of_places || found.units[uy] != of_displacements)
    throw InputError(file, "one unit along x and y", listed(found.header));
  std::optional<Unit> otherwise;
  if (parameters.length_unit != LengthUnit::automatic) otherwise = unit_named(name_of(parameters.length_unit));
  if (otherwise && of_places && of_displacements &&
      (of_places->um != otherwise->um || of_displacements->um != otherwise->um)) {
    throw InputError(
        file, "lengths in " + std::string(name_of(parameters.length_unit)) + ", as track.length_unit has it",
        "the columns " + given.x + " and " + given.ux, "leave track.length_unit out: the table states its units");
  }
  const bool is_of_pixels = given.form == TableForm::openpiv || given.form == TableForm::imagej_piv ||
                            given.form == TableForm::pivlab || given.form == TableForm::pytfm;
  if (!otherwise && is_of_pixels) otherwise = Unit{};
  const std::optional<Unit> place = of_places ? of_places : otherwise;
  given.place_um = um_of(file, given.x, place, parameters);
  given.displacement_um = um_of(file, given.ux, of_displacements ? of_displacements : otherwise, parameters) *
                          seconds_of(file, given.ux, of_displacements, parameters.seconds_between);
  // a place is the centre of a pixel: PIVlab counts them from 1, others from 0
  if (place->um == 0)
    given.first = given.form == TableForm::pivlab ? -0.5 : 0.5;
  else if (given.form == TableForm::trackmate)
    given.first = 0.5 * parameters.pixel_size_um.value_or(0) / given.place_um;
}

/// Of a field that PIVlab calibrated, as the factors above the header have it.
void take_factors(GivenTable& given, const std::string& file, const PivlabFactors& factors,
                  const TrackParameters& parameters) {
  constexpr double kSame = 0.01;
  const double own_um = 1e6 * factors.m_per_px;
  if (std::abs(parameters.pixel_size_um.value_or(own_um) / own_um - 1) > kSame) {
    throw InputError(file, "the pixel size that is set, " + shortest(*parameters.pixel_size_um) + " um",
                     shortest(own_um) + " um in the line above the header",
                     "set pixel_size_um = " + shortest(own_um) + ", or calibrate PIVlab's field again");
  }
  given.place_um = 1e6;
  given.displacement_um = own_um / factors.m_per_s_per_px;
  given.first = -0.5 * factors.m_per_px;
}

/// "Mean" and "SD" beneath a column of numbers, as ImageJ has them: no vectors. @throws InputError
void expect_no_summary(const ForeignTable& table, std::size_t n_columns_before) {
  for (std::size_t i = 0; i < n_columns_before; ++i) {
    const bool is_numbered = files::numeral_in(table.rows.front().fields[i]) == files::Numeral::whole;
    const std::string& last = table.rows.back().fields[i];
    if (is_numbered && files::numeral_in(last) == files::Numeral::none && !files::is_missing(last))
      throw InputError(table.name + ":" + std::to_string(table.rows.back().line), "a vector",
                       "'" + last + "' in the place of its number", "take the rows out that sum up the others");
  }
}

/// In which order the rows of a lattice have their y.
enum class RowOrder { none, rising, falling };

/// Of single beads, none: any of them may come first.
RowOrder order_of(const std::vector<CsvTable::Row>& rows, std::size_t column) {
  std::set<std::string> all;
  double before = 0;
  RowOrder order = RowOrder::none;
  for (const CsvTable::Row& row : rows) {
    const std::string& cell = row.fields[column];
    double y = 0;
    if (std::from_chars(cell.data(), cell.data() + cell.size(), y).ec != std::errc()) continue;
    if (!all.empty() && order == RowOrder::none && y != before)
      order = y < before ? RowOrder::falling : RowOrder::rising;
    before = y;
    all.insert(cell);
    if (2 * all.size() > rows.size()) return RowOrder::none;
  }
  return order;
}

}  // namespace

std::string flag_of(RowMark mark, const std::string& cell) {
  constexpr const char* kMasked = "masked";
  constexpr const char* kFilled = "filled in";
  const std::string word = lower_case(cell);
  double code = word == "true" || word == "yes" || word == "ok" || word == "good" || word == "valid" ? 1 : 0;
  if (files::numeral_in(cell) != files::Numeral::none) std::from_chars(cell.data(), cell.data() + cell.size(), code);
  switch (mark) {
    case RowMark::zero_if_measured:
      return code == 0 ? "" : kMasked;
    case RowMark::zero_if_masked:
      return code == 0 ? kMasked : "";
    case RowMark::one_if_measured:
      return code == 1 ? "" : code == 0 ? kMasked : kFilled;
    case RowMark::positive_if_measured:
      return code > 0 ? "" : kMasked;
    case RowMark::code_of_imagej:
      return code == 999 ? kFilled : code == -1 ? kMasked : "";
  }
  return "";
}

GivenTable read_given_table(const std::filesystem::path& file, const TrackParameters& parameters,
                            const std::optional<images::ImageField>& picture) {
  const bool is_numpy = parameters.table == TableForm::pytfm || file.extension() == ".npy";
  const std::string name = file.string();
  ForeignTable table =
      is_numpy ? read_pytfm(file, picture) : files::read_numbers(files::read_table_text(file), name, kComponents);
  take_numbered_header(table);
  const TableForm form = is_numpy ? TableForm::pytfm : form_of(table, parameters);
  const int n_left_out = form == TableForm::trackmate ? make_vectors_of_spots(table, parameters) : 0;
  const PivlabFactors factors = factors_of(table);
  const std::vector<Unit> davis = form == TableForm::davis ? units_of_davis(table) : std::vector<Unit>();
  const bool is_ours = has_names_of_ours(table, parameters);
  TrackParameters known = parameters;
  known.table = form;
  Found found = header_of(table, known);
  const auto& [x, y, ux, uy] = found.columns;
  // each name once: what has none, or another's, is called by its number
  Header names = found.header;
  std::set<std::string> taken;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i].empty() || !taken.insert(names[i]).second) names[i] = "no. " + std::to_string(i + 1);
  if (form == TableForm::davis && davis.size() >= 3) {
    for (const std::size_t i : {x, y})
      if (!found.units[i]) found.units[i] = davis[0];
    for (const std::size_t i : {ux, uy})
      if (!found.units[i]) found.units[i] = davis[2];
  }
  GivenTable given{
      .form = form, .rows = CsvTable(names, {}, name), .x = names[x], .y = names[y], .ux = names[ux], .uy = names[uy]};
  given.n_left_out = n_left_out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (without_marks(names[i]) == parameters.sigma_column) given.sigma = names[i];
    const auto mark = known_marks().find(parts_of(without_marks(names[i])).key);
    if (mark != known_marks().end()) given.marks.push_back({names[i], mark->second});
  }
  constexpr std::size_t kCodeOfImagej = 15;
  if (form == TableForm::imagej_piv && names.size() > kCodeOfImagej) {
    names[kCodeOfImagej] = "code";  // "flag" means another thing elsewhere
    given.marks.push_back({names[kCodeOfImagej], RowMark::code_of_imagej});
  }
  if (factors.are_there && !(factors.m_per_px == 1 && factors.m_per_s_per_px == 1))
    take_factors(given, name, factors, parameters);
  else
    take_units(given, name, found, parameters);
  if (factors.are_there && given.first == 0.5) given.first = -0.5;  // Tecplot's form, written by PIVlab
  given.sigma_um = given.displacement_um;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == given.sigma && found.units[i]) given.sigma_um = um_of(name, names[i], found.units[i], parameters);
  given.is_ours = is_ours;
  const bool is_asked = parameters.y_axis == VerticalAxis::up;
  const RowOrder order = is_ours && !is_asked ? RowOrder::none : order_of(table.rows, y);
  given.is_lattice = order != RowOrder::none;
  const bool is_falling = parameters.y_axis == VerticalAxis::automatic && !is_ours && order == RowOrder::falling;
  given.is_y_up = is_asked || is_falling;
  given.is_y_up_stated = !is_falling || form == TableForm::openpiv;
  if (form != TableForm::plain || !is_ours) {
    const std::string program = kPrograms[static_cast<std::size_t>(form)];
    given.how = (program.empty() ? "" : " as " + program + " writes them") + " (columns " +
                listed(std::vector<std::string>{given.x, given.y, given.ux, given.uy}) +
                (given.place_um == parameters.pixel_size_um ? "; px" : "") + (given.is_y_up ? "; y points up" : "") +
                ")";
  }
  expect_no_summary(table, *std::ranges::min_element(found.columns));
  given.rows = CsvTable(std::move(names), std::move(table.rows), name);
  return given;
}

}  // namespace mbtfm::beads
