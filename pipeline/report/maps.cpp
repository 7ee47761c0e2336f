#include "pipeline/report/maps.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/report/svg.h"

namespace mbtfm::report {
namespace {

constexpr const char* kOutlineStyle = "fill:none;stroke:#888;stroke-width:1;stroke-dasharray:5 3";
// Around the cell: the displacement reaches beyond it.
constexpr double kMargin_um = 5;
// The longest arrows but for the top 1 %, in px of the drawing: long enough to compare, short enough to tell apart.
constexpr double kLongArrow_px = 44;
// Arrows across the map: one every 16 px.
constexpr int kArrowsAcross = 31;

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

MapDrawing new_map(const CellResults& results) {
  std::vector<Vec2> points = results.cell.outline_um;
  for (const Adhesion& adhesion : results.cell.adhesions) points.push_back(adhesion.position_um);
  MapDrawing map(box_of(points, kMargin_um));
  map.polygon(results.cell.outline_um, kOutlineStyle);
  return map;
}

bool is_inside(const Box& box, Vec2 p) {
  return p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y;
}

/// Vectors at points, to be drawn as arrows.
struct VectorField {
  std::vector<Vec2> positions_um, vectors;
};

/// Sorted into square cells: indices by cell, for the points inside the box.
std::map<std::pair<int, int>, std::vector<int>> bins_of(const VectorField& field, const Box& box) {
  const double side_um = (box.high.x - box.low.x) / kArrowsAcross;
  std::map<std::pair<int, int>, std::vector<int>> bins;
  for (int i = 0; i < static_cast<int>(field.positions_um.size()); ++i) {
    const Vec2 p = field.positions_um[i];
    if (!is_inside(box, p)) continue;
    bins[{static_cast<int>((p.y - box.low.y) / side_um), static_cast<int>((p.x - box.low.x) / side_um)}].push_back(i);
  }
  return bins;
}

/// One of the points of each square.
VectorField thinned(const VectorField& field, const Box& box) {
  VectorField few;
  for (const auto& [place, members] : bins_of(field, box)) {
    few.positions_um.push_back(field.positions_um[members.front()]);
    few.vectors.push_back(field.vectors[members.front()]);
  }
  return few;
}

/// The mean over each square.
VectorField averaged(const VectorField& field, const Box& box) {
  VectorField means;
  for (const auto& [place, members] : bins_of(field, box)) {
    Vec2 position, vector;
    for (const int i : members) {
      position += field.positions_um[i];
      vector += field.vectors[i];
    }
    means.positions_um.push_back((1.0 / static_cast<double>(members.size())) * position);
    means.vectors.push_back((1.0 / static_cast<double>(members.size())) * vector);
  }
  return means;
}

std::vector<double> magnitudes(const std::vector<Vec2>& vectors) {
  std::vector<double> list;
  for (const Vec2 v : vectors) list.push_back(norm(v));
  return list;
}

/// Draw a field with its arrow legend and colour bar.
void draw_arrows(MapDrawing& map, const VectorField& field, const std::string& what, const std::string& unit) {
  const std::vector<double> lengths = magnitudes(field.vectors);
  const double top = percentile(lengths, 0.99);
  if (!(top > 0)) return;
  const double px_per_unit = kLongArrow_px / top;
  const ColourScale scale{.low = 0, .high = top, .label = what + " (" + unit + ")"};
  map.begin_group("fill:none;stroke-width:1.3");
  for (std::size_t i = 0; i < field.vectors.size(); ++i) {
    map.arrow(field.positions_um[i], px_per_unit * field.vectors[i], scale.colour(lengths[i]));
  }
  map.end_group();
  const double legend = round_below(top);
  map.arrow_legend(px_per_unit * legend, readable(legend) + " " + unit);
  map.colour_bar(scale);
}

Box map_box(const CellResults& results) {
  std::vector<Vec2> points = results.cell.outline_um;
  for (const Adhesion& adhesion : results.cell.adhesions) points.push_back(adhesion.position_um);
  return box_of(points, kMargin_um);
}

void draw_adhesions(MapDrawing& map, const CellResults& results, const std::string& style) {
  for (const Adhesion& adhesion : results.cell.adhesions) map.polygon(ellipse_corners(adhesion), style);
}

}  // namespace

Figure adhesion_map(const CellResults& results) {
  MapDrawing map = new_map(results);
  const auto by_id = adhesions_by_id(results.cell);
  std::vector<double> tractions, forces;
  for (const AdhesionForce& force : results.forces) {
    tractions.push_back(norm(force.force_nN) / by_id.at(force.adhesion_id)->area_um2);
    forces.push_back(norm(force.force_nN));
  }
  const ColourScale scale{.low = 0, .high = percentile(tractions, 0.98), .label = "traction (kPa)"};
  const double top_force = percentile(forces, 0.99);
  const double px_per_nN = top_force > 0 ? kLongArrow_px / top_force : 0;
  for (std::size_t i = 0; i < results.forces.size(); ++i) {
    const AdhesionForce& force = results.forces[i];
    const Adhesion& adhesion = *by_id.at(force.adhesion_id);
    map.polygon(ellipse_corners(adhesion), "stroke:#333;stroke-width:0.5;fill:" + scale.colour(tractions[i]),
                fmt::format("adhesion {}: {} nN, {} kPa on {} µm²", adhesion.adhesion_id, readable(forces[i]),
                            readable(tractions[i]), readable(adhesion.area_um2)));
  }
  map.begin_group("fill:none;stroke-width:1.3");
  for (const AdhesionForce& force : results.forces) {
    map.arrow(by_id.at(force.adhesion_id)->position_um, px_per_nN * force.force_nN, "#111");
  }
  map.end_group();
  if (top_force > 0) {
    const double legend = round_below(top_force);
    map.arrow_legend(px_per_nN * legend, readable(legend) + " nN");
  }
  if (scale.high > 0) map.colour_bar(scale);
  return {"Forces on the substrate", map.str("adhesions with their forces"),
          "Each adhesion’s ellipse is coloured by its mean traction; the arrow is the force of the cell on the "
          "substrate. Dashed: the cell’s outline. The colours end at the 98th percentile."};
}

Figure displacement_map(const CellResults& results) {
  VectorField field;
  for (const Bead& bead : results.displacement) {
    if (!bead.flag.empty()) continue;
    field.positions_um.push_back(bead.position_um);
    field.vectors.push_back(bead.displacement_um);
  }
  const Box box = map_box(results);
  const VectorField few = thinned(field, box);
  MapDrawing map = new_map(results);
  draw_arrows(map, few, "displacement", "µm");
  return {"Measured displacement", map.str("displacement of the beads"),
          fmt::format("{} of {} beads, one in each small square; the arrow begins at the bead’s relaxed position.",
                      few.vectors.size(), field.vectors.size())};
}

Figure residual_map(const CellResults& results) {
  const VectorField field{results.residual->positions_um, results.residual->residual_um};
  MapDrawing map = new_map(results);
  draw_adhesions(map, results, "fill:#ddd;stroke:none");
  draw_arrows(map, averaged(field, map_box(results)), "residual", "µm");
  return {"What the model leaves", map.str("residual displacement"),
          "Measured minus fitted displacement, averaged over the beads of each small square so that their noise "
          "fades. Arrows that point the same way over a region are the model’s error. Mind the arrow’s scale."};
}

Figure network_map(const CellResults& results, NetworkForm form) {
  const bool is_original = form == NetworkForm::original;
  const Network& network = is_original ? results.network : results.contracted.network;
  MapDrawing map = new_map(results);
  draw_adhesions(map, results, "fill:#cfe3f3;stroke:#7aa6c8;stroke-width:0.5");

  using Pieces = std::vector<std::pair<Vec2, Vec2>>;
  Pieces web;
  std::map<int, Pieces> fibres;
  std::map<int, std::vector<double>> carried_nN;
  for (std::size_t k = 0; k < network.links.size(); ++k) {
    const Link& link = network.links[k];
    const std::pair piece{network.vertices_um[link.vertex_a], network.vertices_um[link.vertex_b]};
    (link.fibre_id == 0 ? web : fibres[link.fibre_id]).push_back(piece);
    if (!is_original) carried_nN[link.fibre_id].push_back(results.contracted.link_force_nN[k]);
  }
  ColourScale scale{.low = 0, .high = 0, .label = is_original ? "fitted tension (nN)" : "force carried (nN)"};
  for (const auto& [id, tension] : results.tensions) {
    if (id != 0) scale.high = std::max(scale.high, tension.tension_nN);
  }
  map.pieces(web, "stroke:#bbb;stroke-width:0.5");
  for (const auto& [id, pieces] : fibres) {
    const auto tension = results.tensions.find(id);
    const std::string text = tension == results.tensions.end()
                                 ? fmt::format("fibre {}: not fitted", id)
                                 : fmt::format("fibre {}: {} nN", id, readable(tension->second.tension_nN));
    map.pieces(pieces, "stroke:#fff;stroke-width:5;stroke-linecap:round", text);
    if (is_original) {
      const std::string colour =
          tension == results.tensions.end() ? std::string("#555") : scale.colour(tension->second.tension_nN);
      map.pieces(pieces, "stroke-width:3;stroke-linecap:round;stroke:" + colour, text);
      continue;
    }
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      map.pieces({pieces[k]}, "stroke-width:3;stroke-linecap:round;stroke:" + scale.colour(carried_nN[id][k]),
                 fmt::format("{}; this link carries {} nN", text, readable(carried_nN[id][k])));
    }
  }
  if (scale.high > 0) map.colour_bar(scale);
  if (is_original) {
    return {"Network as spanned", map.str("network before contraction"),
            fmt::format("{} vertices, {} links (grey: actin network); stress fibres coloured by their fitted tension. "
                        "Blue: adhesions, which hold the vertices inside them.",
                        network.vertices_um.size(), network.links.size())};
  }
  return {"Network in equilibrium", map.str("contracted network"),
          "The same network where its tensions have drawn it; each link of a fibre is coloured by the force that it "
          "carries."};
}

}  // namespace mbtfm::report
