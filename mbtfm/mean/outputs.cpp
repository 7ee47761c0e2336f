#include "mbtfm/mean/outputs.h"

#include <numbers>

#include "pipeline/files/columns.h"
#include "pipeline/files/vtk_files.h"

namespace mbtfm::mean {
namespace {

using files::kResult;
using files::member;

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

files::Table<CellRow> table_of_cells() {
  return {.file = "registration.csv",
          .columns = {{"cell", &CellRow::cell},
                      {"kept", &CellRow::is_kept},
                      {"reason", &CellRow::reason},
                      {"x_um", files::x_of(&CellRow::way, &Way::motion, &Motion::from_um)},
                      {"y_um", files::y_of(&CellRow::way, &Way::motion, &Motion::from_um)},
                      {"reference_x_um", files::x_of(&CellRow::way, &Way::motion, &Motion::to_um)},
                      {"reference_y_um", files::y_of(&CellRow::way, &Way::motion, &Motion::to_um)},
                      {"angle_deg", [](const CellRow& c) { return degrees(c.way.motion.angle_rad); }},
                      {"mirrored", member(&CellRow::way, &Way::motion, &Motion::is_mirrored)},
                      {"misfit_um", member(&CellRow::way, &Way::misfit_um), kResult},
                      {"second_misfit_um", &CellRow::second_misfit_um, kResult},
                      {"ambiguous", &CellRow::is_ambiguous},
                      {"shift_error_um", member(&CellRow::way, &Way::shift_error_um), kResult},
                      {"angle_error_deg", [](const CellRow& c) { return degrees(c.way.angle_error_rad); }, kResult},
                      {"n_beads", &CellRow::n_beads},
                      {"lambda_um_per_kPa", &CellRow::lambda_um_per_kPa, kResult}}};
}

struct MeanRow {
  NodeMean node;
  std::optional<Vec2> model_kPa;
};

files::Table<MeanRow> table_of_mean() {
  using Row = MeanRow;
  const auto mean = [](auto vector, auto part) { return member(&Row::node, &NodeMean::mean, vector, part); };
  const auto sigma = [](auto vector, auto part) { return member(&Row::node, &NodeMean::sigma, vector, part); };
  const auto u = &Sample::displacement_um, t = &Sample::traction_kPa;
  return {.file = "mean.csv",
          .columns = {{"x_um", files::x_of(&Row::node, &NodeMean::position_um)},
                      {"y_um", files::y_of(&Row::node, &NodeMean::position_um)},
                      {"ux_um", mean(u, &Vec2::x)},
                      {"uy_um", mean(u, &Vec2::y)},
                      {"ux_sigma_um", sigma(u, &Vec2::x)},
                      {"uy_sigma_um", sigma(u, &Vec2::y)},
                      {"tx_kPa", mean(t, &Vec2::x)},
                      {"ty_kPa", mean(t, &Vec2::y)},
                      {"tx_sigma_kPa", sigma(t, &Vec2::x)},
                      {"ty_sigma_kPa", sigma(t, &Vec2::y)},
                      {"n_cells", member(&Row::node, &NodeMean::n_cells)},
                      {"inside", member(&Row::node, &NodeMean::is_inside)},
                      {"model_tx_kPa", member(&Row::model_kPa, &Vec2::x)},
                      {"model_ty_kPa", member(&Row::model_kPa, &Vec2::y)}}};
}

files::Table<WaveShare> table_of_waves() {
  return {.file = "blur.csv",
          .columns = {{"wavelength_um", &WaveShare::wavelength_um, kResult},
                      {"fttc_along", &WaveShare::along, kResult},
                      {"fttc_across", &WaveShare::across, kResult},
                      {"registration", &WaveShare::registration, kResult}}};
}

}  // namespace

void write_registration(const Path& file, const std::vector<CellRow>& cells) {
  files::write(file, table_of_cells(), cells);
}

void write_blur(const Path& file, const std::vector<WaveShare>& shares) {
  files::write(file, table_of_waves(), shares);
}

void write_mean(const Path& table, const Path& points, const std::vector<NodeMean>& nodes,
                const std::vector<Vec2>& model_kPa) {
  std::vector<MeanRow> rows;
  for (std::size_t k = 0; k < nodes.size(); ++k)
    rows.push_back({nodes[k], model_kPa.empty() ? std::nullopt : std::optional(model_kPa[k])});
  files::write(table, table_of_mean(), rows);
  const auto of_mean = [](Vec2 Sample::*value) { return [value](const NodeMean& node) { return node.mean.*value; }; };
  const auto of_sigma = [](Vec2 Sample::*value) {
    return [value](const NodeMean& node) { return node.sigma.value_or(Sample{}).*value; };
  };
  std::vector<Vec2> places;
  for (const NodeMean& node : nodes) places.push_back(node.position_um);
  files::write_points_vtp(points, places,
                          {files::array_of("displacement_um", nodes, of_mean(&Sample::displacement_um)),
                           files::array_of("traction_kPa", nodes, of_mean(&Sample::traction_kPa)),
                           files::array_of("displacement_sigma_um", nodes, of_sigma(&Sample::displacement_um)),
                           files::array_of("traction_sigma_kPa", nodes, of_sigma(&Sample::traction_kPa)),
                           files::array_of("n_cells", nodes, &NodeMean::n_cells)});
}

std::string pages_of_tables() {
  return files::page_of(table_of_mean()) + files::page_of(table_of_cells()) + files::page_of(table_of_waves());
}

Figures figures_of(const std::vector<CellRow>& rows, const std::vector<NodeMean>& nodes, const std::string& symmetry,
                   const std::optional<Ratio>& ratio, const Blur& blur, double size) {
  std::int64_t n_kept = 0, n_ambiguous = 0;
  double misfit = 0, angle = 0;
  for (const CellRow& row : rows) {
    if (!row.is_kept) continue;
    n_kept += 1;
    n_ambiguous += row.is_ambiguous ? 1 : 0;
    misfit += row.way.misfit_um * row.way.misfit_um;
    angle += row.way.angle_error_rad * row.way.angle_error_rad;
  }
  double largest = 0;
  for (const NodeMean& node : nodes) largest = std::max(largest, norm(node.mean.traction_kPa));
  Figures figures = {{"n_cells", n_kept},
                     {"n_left_out", static_cast<std::int64_t>(rows.size()) - n_kept},
                     {"n_ambiguous", n_ambiguous},
                     {"symmetry", symmetry},
                     {"n_nodes", static_cast<std::int64_t>(nodes.size())},
                     {"reference_radius_um", size},
                     {"misfit_um", std::sqrt(misfit / static_cast<double>(n_kept))},
                     {"angle_error_deg", 180 / std::numbers::pi * std::sqrt(angle / static_cast<double>(n_kept))},
                     {"largest_mean_traction_kPa", largest},
                     {"blur_fttc_um", blur.fttc_um},
                     {"blur_registration_um", blur.registration_um}};
  if (!ratio) return figures;
  figures.emplace_back("tip_kPa", ratio->tip_kPa);
  figures.emplace_back("edge_kPa", ratio->edge_kPa);
  figures.emplace_back("tip_over_edge", ratio->ratio);
  figures.emplace_back("tip_over_edge_low", ratio->low);
  figures.emplace_back("tip_over_edge_high", ratio->high);
  return figures;
}

}  // namespace mbtfm::mean
