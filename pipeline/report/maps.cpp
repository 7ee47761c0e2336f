#include "pipeline/report/maps.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/polyline.h"
#include "pipeline/report/arrows.h"

namespace mbtfm::report {
namespace {

constexpr int kEllipseCorners = 16;  // an ellipse is a few px long

constexpr const char* kOutlineStyle = "fill:none;stroke:#888;stroke-width:1;stroke-dasharray:5 3";
// Around the cell: the displacement reaches beyond it.
constexpr double kMargin_um = 5;
Box map_box(const CellResults& results) {
  std::vector<Vec2> points = results.cell.outline_um;
  for (const Adhesion& adhesion : results.cell.adhesions) points.push_back(adhesion.position_um);
  return box_of(points, kMargin_um);
}

MapDrawing new_map(const CellResults& results) {
  MapDrawing map(map_box(results));
  map.polygon(results.cell.outline_um, kOutlineStyle);
  return map;
}

void draw_adhesions(MapDrawing& map, const CellResults& results, const std::string& style) {
  for (const Adhesion& adhesion : results.cell.adhesions)
    map.polygon(ellipse_corners(adhesion, kEllipseCorners), style);
}

using Pieces = std::vector<std::pair<Vec2, Vec2>>;

/// A network's links sorted by what they belong to.
struct SortedLinks {
  Pieces web;
  std::map<int, Pieces> fibres;
  std::map<int, std::vector<double>> carried_nN;  ///< by the links of each fibre; empty where there are no forces
};

SortedLinks sorted_links(const Network& network, const std::vector<double>& link_force_nN) {
  SortedLinks sorted;
  for (std::size_t k = 0; k < network.links.size(); ++k) {
    const Link& link = network.links[k];
    const std::pair piece{network.vertices_um[link.vertex_a], network.vertices_um[link.vertex_b]};
    (link.fibre_id == 0 ? sorted.web : sorted.fibres[link.fibre_id]).push_back(piece);
    if (!link_force_nN.empty()) sorted.carried_nN[link.fibre_id].push_back(link_force_nN[k]);
  }
  return sorted;
}

/// What one reads where the mouse rests on a fibre.
std::string fibre_text(const CellResults& results, int fibre_id) {
  const auto tension = results.tensions.find(fibre_id);
  return tension == results.tensions.end()
             ? fmt::format("fibre {}: not fitted", fibre_id)
             : fmt::format("fibre {}: {} nN", fibre_id, readable(tension->second.tension_nN));
}

void draw_fibre_ids(MapDrawing& map, const CellResults& results) {
  const double clear_um = 15 / map.px_per_um();  // about a label's width
  for (const Fibre& fibre : results.cell.fibres) {
    map.label(label_places_um(fibre, results.cell.fibres, clear_um).front(), std::to_string(fibre.fibre_id));
  }
}

ColourScale tension_scale(const CellResults& results, NetworkForm form) {
  ColourScale scale{
      .low = 0, .high = 0, .label = form == NetworkForm::original ? "fitted tension (nN)" : "force carried (nN)"};
  for (const auto& [id, tension] : results.tensions) {
    if (id != 0) scale.high = std::max(scale.high, tension.tension_nN);
  }
  scale.high = round_end(scale.high);
  return scale;
}

void draw_web(MapDrawing& map, const CellResults& results, const Pieces& web) {
  draw_adhesions(map, results, "fill:#cfe3f3;stroke:#7aa6c8;stroke-width:0.5");
  map.pieces(web, "stroke:#bbb;stroke-width:0.5");
}

constexpr const char* kHalo = "stroke:#fff;stroke-width:5;stroke-linecap:round";
constexpr const char* kThick = "stroke-width:3;stroke-linecap:round;stroke:";

Figure original_network(const CellResults& results) {
  MapDrawing map = new_map(results);
  const ColourScale scale = tension_scale(results, NetworkForm::original);
  const SortedLinks links = sorted_links(results.network, {});
  draw_web(map, results, links.web);
  for (const auto& [id, pieces] : links.fibres) {
    const auto tension = results.tensions.find(id);
    const std::string text = fibre_text(results, id);
    map.pieces(pieces, kHalo, text);
    map.pieces(pieces, kThick + (tension == results.tensions.end() ? "#555" : scale.colour(tension->second.tension_nN)),
               text);
  }
  draw_fibre_ids(map, results);
  if (scale.high > 0) map.colour_bar(scale);
  return {"Where the fibres are", map.str("network before contraction"),
          fmt::format("Stress fibres with their numbers, coloured by their fitted tension, in the network of the first "
                      "mesh before it contracts: {} vertices, {} links (grey: actin network). Blue: adhesions, which "
                      "hold the vertices inside them.",
                      results.network.vertices_um.size(), results.network.links.size())};
}

Figure contracted_network(const CellResults& results) {
  MapDrawing map = new_map(results);
  const ColourScale scale = tension_scale(results, NetworkForm::contracted);
  const SortedLinks links = sorted_links(results.contracted.network, results.contracted.link_force_nN);
  draw_web(map, results, links.web);
  for (const auto& [id, pieces] : links.fibres) {
    const std::string text = fibre_text(results, id);
    const std::vector<double>& carried_nN = links.carried_nN.at(id);
    map.pieces(pieces, kHalo, text);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      map.pieces({pieces[k]}, kThick + scale.colour(carried_nN[k]),
                 fmt::format("{}; this link carries {} nN", text, readable(carried_nN[k])));
    }
  }
  if (scale.high > 0) map.colour_bar(scale);
  return {"Network in equilibrium", map.str("contracted network"),
          "The same network where its tensions have drawn it; each link of a fibre is coloured by the force that it "
          "carries."};
}

}  // namespace

Figure adhesion_map(const CellResults& results) {
  MapDrawing map = new_map(results);
  const auto by_id = adhesions_by_id(results.cell);
  std::vector<double> tractions;
  std::vector<Vec2> forces;
  for (const AdhesionForce& force : results.forces) {
    tractions.push_back(norm(force.force_nN) / by_id.at(force.adhesion_id)->area_um2);
    forces.push_back(force.force_nN);
  }
  const ColourScale colours{.low = 0, .high = round_end(percentile(tractions, 0.98)), .label = "traction (kPa)"};
  const ArrowScale scale = arrow_scale(forces);
  for (std::size_t i = 0; i < results.forces.size(); ++i) {
    const Adhesion& adhesion = *by_id.at(results.forces[i].adhesion_id);
    map.polygon(ellipse_corners(adhesion, kEllipseCorners),
                "stroke:#333;stroke-width:0.5;fill:" + colours.colour(tractions[i]),
                fmt::format("adhesion {}: {} nN, {} kPa on {} µm²", adhesion.adhesion_id, readable(norm(forces[i])),
                            readable(tractions[i]), readable(adhesion.area_um2)));
  }
  map.begin_group("fill:none;stroke-width:1.5");
  for (const AdhesionForce& force : results.forces) {
    map.arrow(by_id.at(force.adhesion_id)->position_um, scale.px_per_unit * force.force_nN, "#111");
  }
  map.end_group();
  if (scale.top > 0) {
    const double legend = round_below(scale.top);
    map.arrow_legend(scale.px_per_unit * legend, readable(legend) + " nN");
  }
  if (colours.high > 0) map.colour_bar(colours);
  return {"Forces on the substrate", map.str("adhesions with their forces"),
          "Each adhesion’s ellipse is coloured by its mean traction; the arrow is the force of the cell on the "
          "substrate. Dashed: the cell’s outline. The few highest tractions share the colour at the bar’s end."};
}

std::vector<Figure> displacement_maps(const CellResults& results) {
  VectorField measured, fitted, residual;
  for (const Bead& bead : results.displacement) {
    if (!bead.flag.empty()) continue;
    measured.positions_um.push_back(bead.position_um);
    measured.vectors.push_back(bead.displacement_um);
  }
  const Box box = map_box(results);
  const double side_um = averaging_side_um(measured, box);
  const AveragedField means = averaged(measured, box, side_um);
  const ArrowScale scale = arrow_scale(means.means.vectors);
  const auto drawn = [&](const VectorField& field, const std::string& title, const std::string& what) {
    MapDrawing map = new_map(results);
    draw_adhesions(map, results, "fill:#ddd;stroke:none");
    draw_arrows(map, field, scale, what, "µm");
    return map.str(title);
  };
  std::vector<Figure> figures = {
      {"Measured displacement", drawn(means.means, "displacement of the beads", "displacement"),
       fmt::format(
           "Each arrow is the mean of the beads in a square of {:.1f} µm, {:.0f} on average, so that their noise "
           "fades; it begins where they lie on the relaxed gel. The fit uses every bead by itself.",
           side_um, means.mean_members)}};
  if (!results.residual) return figures;
  residual = {results.residual->positions_um, results.residual->residual_um};
  fitted = measured;
  for (std::size_t i = 0; i < fitted.vectors.size(); ++i) fitted.vectors[i] = fitted.vectors[i] - residual.vectors[i];
  figures.push_back({"Fitted displacement",
                     drawn(averaged(fitted, box, side_um).means, "fitted displacement", "displacement"),
                     "What the model says at the same beads, averaged in the same squares and drawn to the same "
                     "scale."});
  figures.push_back({"Measured minus fitted",
                     drawn(averaged(residual, box, side_um).means, "residual displacement", "difference"),
                     "Same squares, same scale. Bead noise points anywhere; arrows that point the same way over a "
                     "region are the model’s error."});
  return figures;
}

Figure network_map(const CellResults& results, NetworkForm form) {
  return form == NetworkForm::original ? original_network(results) : contracted_network(results);
}

}  // namespace mbtfm::report
