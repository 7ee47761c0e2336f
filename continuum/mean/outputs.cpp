#include "continuum/mean/outputs.h"

#include <numbers>

#include "pipeline/files/columns.h"
#include "pipeline/files/vtk_files.h"

namespace mbtfm::mean {
namespace {

using files::kForPeople;

double degrees(double rad) { return rad * 180 / std::numbers::pi; }

const files::Table<CellRow>& table_of_cells() {
  static const files::Table<CellRow> table{
      .file = "registration.csv",
      .row = "each cell",
      .columns = {
          {"cell", "folder of the cell", &CellRow::cell},
          {"kept", "whether it is in the mean", &CellRow::is_kept},
          {"reason", "why it is not", &CellRow::reason},
          {"x_um", "place of its centroid, in its own images", [](const CellRow& c) { return c.way.motion.from_um.x; }},
          {"y_um", "the same along y", [](const CellRow& c) { return c.way.motion.from_um.y; }},
          {"reference_x_um", "where the centroid comes to lie in the frame of the reference",
           [](const CellRow& c) { return c.way.motion.to_um.x; }},
          {"reference_y_um", "the same along y", [](const CellRow& c) { return c.way.motion.to_um.y; }},
          {"angle_deg", "by which it is turned about its centroid, from +x towards +y, after it was mirrored",
           [](const CellRow& c) { return degrees(c.way.motion.angle_rad); }},
          {"mirrored", "whether y was turned into -y first", [](const CellRow& c) { return c.way.motion.is_mirrored; }},
          {"misfit_um",
           "root mean square distance of its outline and the reference, both ways",
           [](const CellRow& c) { return c.way.misfit_um; },
           {.digits = kForPeople}},
          {"second_misfit_um",
           "the same of the best way that is no symmetry of this one",
           &CellRow::second_misfit_um,
           {.digits = kForPeople}},
          {"ambiguous", "whether that fits as well", &CellRow::is_ambiguous},
          {"shift_error_um",
           "standard error of each component of the shift",
           [](const CellRow& c) { return c.way.shift_error_um; },
           {.digits = kForPeople}},
          {"angle_error_deg",
           "standard error of the angle",
           [](const CellRow& c) { return degrees(c.way.angle_error_rad); },
           {.digits = kForPeople}},
          {"n_beads", "beads that were used", &CellRow::n_beads},
          {"lambda_um_per_kPa",
           "regularisation of its tractions",
           &CellRow::lambda_um_per_kPa,
           {.digits = kForPeople}}}};
  return table;
}

struct MeanRow {
  NodeMean node;
  std::optional<Vec2> model_kPa;
};

const files::Table<MeanRow>& table_of_mean() {
  const auto sigma = [](auto component) {
    return [=](const MeanRow& row) -> std::optional<double> {
      if (!row.node.sigma) return std::nullopt;
      return component(*row.node.sigma);
    };
  };
  const auto mean = [](auto component) { return [=](const MeanRow& row) { return component(row.node.mean); }; };
  const auto ux = [](const Sample& s) { return s.displacement_um.x; };
  const auto uy = [](const Sample& s) { return s.displacement_um.y; };
  const auto tx = [](const Sample& s) { return s.traction_kPa.x; };
  const auto ty = [](const Sample& s) { return s.traction_kPa.y; };
  static const files::Table<MeanRow> table{
      .file = "mean.csv",
      .row = "each node of the lattice over the reference that beads of some cell reach",
      .columns = {
          {"x_um", "place in the frame of the reference", [](const MeanRow& r) { return r.node.position_um.x; }},
          {"y_um", "the same along y", [](const MeanRow& r) { return r.node.position_um.y; }},
          {"ux_um", "mean displacement", mean(ux)},
          {"uy_um", "the same along y", mean(uy)},
          {"ux_sigma_um", "its standard error, from the scatter of the cells", sigma(ux)},
          {"uy_sigma_um", "the same along y", sigma(uy)},
          {"tx_kPa", "mean traction", mean(tx)},
          {"ty_kPa", "the same along y", mean(ty)},
          {"tx_sigma_kPa", "its standard error, from the scatter of the cells", sigma(tx)},
          {"ty_sigma_kPa", "the same along y", sigma(ty)},
          {"n_cells", "cells whose beads reach it", [](const MeanRow& r) { return r.node.n_cells; }},
          {"inside", "whether the reference holds it", [](const MeanRow& r) { return r.node.is_inside; }},
          {"model_tx_kPa", "traction of the model, blurred as the cells are; empty if none was given",
           [](const MeanRow& r) { return r.model_kPa ? std::optional(r.model_kPa->x) : std::nullopt; }},
          {"model_ty_kPa", "the same along y",
           [](const MeanRow& r) { return r.model_kPa ? std::optional(r.model_kPa->y) : std::nullopt; }}}};
  return table;
}

const files::Table<WaveShare>& table_of_waves() {
  static const files::Table<WaveShare> table{
      .file = "blur.csv",
      .row = "waves of traction of each length",
      .columns = {{"wavelength_um", "length of the wave", &WaveShare::wavelength_um, {.digits = kForPeople}},
                  {"fttc_along",
                   "share that the regularisation leaves if the traction points along the wave",
                   &WaveShare::along,
                   {.digits = kForPeople}},
                  {"fttc_across", "the same if it points across", &WaveShare::across, {.digits = kForPeople}},
                  {"registration",
                   "share that the errors of registration leave in the mean",
                   &WaveShare::registration,
                   {.digits = kForPeople}}}};
  return table;
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
  std::vector<Vec2> places;
  std::vector<files::PointArray> arrays = {{"displacement_um", {}, {}},
                                           {"traction_kPa", {}, {}},
                                           {"displacement_sigma_um", {}, {}},
                                           {"traction_sigma_kPa", {}, {}},
                                           {"n_cells", {}, {}}};
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const NodeMean& node = nodes[k];
    rows.push_back({node, model_kPa.empty() ? std::nullopt : std::optional(model_kPa[k])});
    places.push_back(node.position_um);
    const Sample sigma = node.sigma.value_or(Sample{});
    arrays[0].vectors.push_back(node.mean.displacement_um);
    arrays[1].vectors.push_back(node.mean.traction_kPa);
    arrays[2].vectors.push_back(sigma.displacement_um);
    arrays[3].vectors.push_back(sigma.traction_kPa);
    arrays[4].scalars.push_back(node.n_cells);
  }
  files::write(table, table_of_mean(), rows);
  files::write_points_vtp(points, places, arrays);
}

std::string pages_of_tables() {
  return files::page_of(table_of_mean()) + files::page_of(table_of_cells()) + files::page_of(table_of_waves());
}

}  // namespace mbtfm::mean
