#include "pipeline/report/maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pipeline/charts/box.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/polyline.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/results.h"
#include "pipeline/report/tensions.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

using charts::Chart;

constexpr int kEllipseCorners = 16;  // an ellipse is a few px long

Extent map_box(const CellResults& results) {
  std::vector<Vec2> points = results.cell.outline_um;
  for (const Adhesion& adhesion : results.cell.adhesions) points.push_back(adhesion.position_um);
  const auto [low, high] = extent_of(points);
  constexpr Vec2 margin{5, 5};  // the displacement reaches beyond the cell
  return {low - margin, high + margin};
}

constexpr const char* kCutStyle = "fill:none;stroke:#777;stroke-width:2.6;stroke-dasharray:9 5";

/// The outline, and over it where the image cuts the cell.
void draw_outline(Chart& map, const Cell& cell, const std::string& style) {
  map.polygon(cell.outline_um, style);
  Polyline cut;
  for (const auto& [a, b] : cuts_of(cell)) {
    if (!cut.empty() && !(cut.back() == a)) {
      map.curve(cut, kCutStyle);
      cut.clear();
    }
    if (cut.empty()) cut.push_back(a);
    cut.push_back(b);
  }
  if (!cut.empty()) map.curve(cut, kCutStyle);
}

std::string caption_of_cut(const Cell& cell) { return cuts_of(cell).empty() ? "" : " " + sentence("maps.cut"); }

Chart new_map(const CellResults& results, const std::string& title) {
  Chart map = empty_map(map_box(results), title);
  draw_outline(map, results.cell, "fill:none;stroke:#888;stroke-width:1;stroke-dasharray:5 3");
  return map;
}

enum class Hover { none, whole };  // texts make the page large: not on each map

void draw_adhesions(Chart& map, const CellResults& results, const std::string& style, Hover hover) {
  for (const Adhesion& adhesion : results.cell.adhesions) {
    map.polygon(ellipse_corners(adhesion, kEllipseCorners), style,
                hover == Hover::whole ? hover_of(adhesion, results) : std::string());
  }
}

using Pieces = std::vector<std::pair<Vec2, Vec2>>;

/// A network's links sorted by what they belong to.
struct SortedLinks {
  Pieces web;
  std::map<int, Pieces> fibres = {};
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

/// Of the strongest fibres first, as far as there is room: the mouse finds the others.
void draw_fibre_ids(Chart& map, const CellResults& results) {
  constexpr double kNarrow_px = 230, kWidth_px = 28, kHeight_px = 14;  // of a frame among three; of a label
  const Extent box = map_box(results);
  const double um_per_px = (box.high_um.x - box.low_um.x) / kNarrow_px;
  const auto tension_nN = [&](const Fibre* fibre) {
    const auto found = results.tensions.find(fibre->fibre_id);
    return found == results.tensions.end() ? 0 : found->second.tension_nN;
  };
  std::vector<const Fibre*> order;
  for (const Fibre& fibre : results.cell.fibres) order.push_back(&fibre);
  std::ranges::stable_sort(order, std::greater{}, tension_nN);
  std::vector<charts::Box> taken;
  const auto box_at = [&](Vec2 place) {
    return charts::box_around(place, kWidth_px * um_per_px, kHeight_px * um_per_px);
  };
  const auto is_free = [&](Vec2 place) {
    return std::ranges::none_of(taken, [&](const charts::Box& other) { return overlap(box_at(place), other); });
  };
  for (const Fibre* fibre : order) {
    const auto places = label_places_um(*fibre, results.cell.fibres, 0.5 * kWidth_px * um_per_px);
    const auto free = std::ranges::find_if(places, is_free);
    if (free == places.end()) continue;
    map.label(*free, letter_of(fibre->type) + std::to_string(fibre->fibre_id));
    taken.push_back(box_at(*free));
  }
}

ColourScale tension_scale(const CellResults& results, const char* label) {
  ColourScale scale{.low = 0, .high = 0, .label = label};
  for (const auto& [id, tension] : results.tensions)
    if (id != 0) scale.high = std::max(scale.high, tension.tension_nN);
  scale.high = round_end(scale.high);
  return scale;
}

void draw_web(Chart& map, const CellResults& results, const Pieces& web, Hover hover) {
  map.pieces(web, "stroke:#bbb;stroke-width:0.5");
  draw_adhesions(map, results, "fill:#cfe3f3;stroke:#7aa6c8;stroke-width:0.5", hover);
}

// As wide as a mouse can rest on.
constexpr const char* kHalo = "stroke:#fff;stroke-width:7;stroke-linecap:round";
constexpr const char* kThick = "stroke-width:3;stroke-linecap:round;stroke:";

/// Of the model's tractions.
ColourScale traction_scale(const CellResults& results) {
  const auto by_id = adhesions_by_id(results.cell);
  std::vector<double> tractions_kPa;
  for (const AdhesionForce& force : results.forces)
    tractions_kPa.push_back(norm(force.force_nN) / area_stood_for_um2(*by_id.at(force.adhesion_id)));
  return {.low = 0, .high = round_end(numerics::quantile(tractions_kPa, 0.98)), .label = "traction (kPa)"};
}

/// Adhesions that were seen, and the dashed ones that nobody saw.
std::string adhesion_keys(const Cell& cell) {
  const auto ring = [](const std::string& name) {
    return "<span><span class=\"type\" style=\"border:2px dashed #ff9be6\"></span>" + name + "</span>";
  };
  std::string keys;
  if (has_origin(cell, AdhesionOrigin::image) || has_origin(cell, AdhesionOrigin::drawn) || cell.adhesions.empty())
    keys += "<span><span class=\"type\" style=\"background:#ff9be6\"></span>adhesion</span>";
  if (has_origin(cell, AdhesionOrigin::anchor)) keys += ring("anchor of a drawn fibre, not seen");
  if (has_origin(cell, AdhesionOrigin::candidate)) keys += ring("candidate, not seen");
  return keys;
}

}  // namespace

std::string html_of(const Figure& map) { return figure(map.chart, map.caption, map.legend); }

Figure segmentation_map(const CellResults& results) {
  const bool is_dark = results.images.has_value();
  const std::string of_missing = is_dark ? "#ffe14d" : "#b00020";
  Chart map = empty_map(is_dark ? results.images->place : map_box(results), "Segmentation");
  if (is_dark) {
    map.picture(results.images->place.low_um, results.images->place.high_um,
                data_address(results.images->file, "image/jpeg"));
  }
  draw_outline(map, results.cell, std::string("fill:none;stroke-width:1.3;stroke:") + (is_dark ? "#ddd" : "#888"));
  // nearly invisible fill: the mouse finds the whole ellipse
  for (const Adhesion& adhesion : results.cell.adhesions) {
    map.polygon(ellipse_corners(adhesion, kEllipseCorners),
                std::string("fill:#ff9be6;fill-opacity:0.12;stroke:#ff9be6;stroke-width:1.1") +
                    (is_assumed(adhesion.origin) ? ";stroke-dasharray:3 3" : ""),
                hover_of(adhesion, results));
  }
  std::string types;
  for (const FibreType type : kFibreTypes) {
    if (type >= FibreType::edge && std::ranges::count(results.cell.fibres, type, &Fibre::type) == 0) continue;
    types += fmt::format("<span>{}{} ({})</span>", swatch_of(type, is_dark ? bright_colour_of(type) : colour_of(type)),
                         full_name_of(type), letter_of(type));
  }
  for (const Fibre& fibre : results.cell.fibres) {
    map.curve(fibre.points_um,
              std::string("stroke-width:2.6;stroke:") +
                  (is_dark ? bright_colour_of(fibre.type) : colour_of(fibre.type)) +
                  (fibre.type == FibreType::edge ? dashes_of(fibre.type) : ";stroke-linecap:round"),
              hover_of(fibre, results));
  }
  draw_fibre_ids(map, results);
  const auto by_id = adhesions_by_id(results.cell);
  for (const MissingFibre& f : results.missing_fibres) {
    map.curve({by_id.at(f.start_adhesion_id)->position_um, by_id.at(f.end_adhesion_id)->position_um},
              "stroke-width:2.2;stroke-dasharray:7 5;stroke:" + of_missing,
              fmt::format("called for by the beads, not segmented\nfrom adhesion {} to {}\n{} ± {} nN",
                          f.start_adhesion_id, f.end_adhesion_id, readable(f.tension_nN), readable(sigma_nN(f))));
  }
  for (const MissingAdhesion& a : results.missing_adhesions) {
    const Adhesion circle{.adhesion_id = 0, .position_um = a.position_um, .major_axis_um = 2, .minor_axis_um = 2};
    map.polygon(ellipse_corners(circle, 24),
                "fill:#fff;fill-opacity:0.01;stroke-width:2.2;stroke-dasharray:4 3;stroke:" + of_missing,
                fmt::format("a force that the beads call for, no adhesion found\n{} nN", readable(norm(a.force_nN))));
  }
  const std::string missing =
      results.missing_fibres.empty() && results.missing_adhesions.empty()
          ? ""
          : fmt::format("<span><span class=\"type\" style=\"background:{}\"></span>missing (dashed)</span>",
                        of_missing);
  return {map,
          (is_dark ? sentence("maps.segmentation") : "Adhesions, fibres and outline.") + caption_of_cut(results.cell),
          legend(types + adhesion_keys(results.cell) + missing)};
}

std::vector<Figure> bead_maps(const CellResults& results) {
  const Images& images = results.bead_images.value();
  const std::string address = data_address(images.file, "image/jpeg");
  std::vector<Figure> maps;
  Chart whole = empty_map(images.place, "Beads");
  whole.picture(images.place.low_um, images.place.high_um, address);
  draw_outline(whole, results.cell, "fill:none;stroke-width:1.3;stroke:#ddd");
  const auto strongest =
      std::ranges::max_element(results.forces, {}, [](const AdhesionForce& f) { return norm(f.force_nN); });
  if (strongest != results.forces.end()) {
    const Adhesion& adhesion = *adhesions_by_id(results.cell).at(strongest->adhesion_id);
    constexpr Vec2 half{7.5, 7.5};  // um: a bead of 0.2 um is then five px wide
    const Extent box{adhesion.position_um - half, adhesion.position_um + half};
    Chart inset = empty_map(box, "Beads close up");
    inset.picture(images.place.low_um, images.place.high_um, address);
    inset.blink(box.low_um, box.high_um, "#00ff00", "#ff00ff");
    inset.polygon(ellipse_corners(adhesion, kEllipseCorners), "fill:none;stroke:#fff;stroke-width:1.4",
                  hover_of(adhesion, results));
    whole.bar(box.low_um, box.high_um, "fill:none;stroke:#fff;stroke-width:1.4");
    maps.push_back({inset, sentence("maps.blink", adhesion.adhesion_id), {}});
  }
  int n_flagged = 0;
  for (const Bead& bead : results.displacement) {
    if (bead.flag.empty()) continue;
    ++n_flagged;
    whole.dot(bead.position_um, 3.5, "fill:#fff;fill-opacity:0.01;stroke-width:1.2;stroke:#ffe14d",
              "left out: " + bead.flag);
  }
  maps.push_back({whole,
                  sentence("maps.beads", n_flagged, maps.empty() ? "" : " White square: the map before.",
                           caption_of_cut(results.cell)),
                  {}});
  return maps;
}

Figure adhesion_map(const CellResults& results) {
  Chart map = new_map(results, "Forces on the substrate");
  const auto by_id = adhesions_by_id(results.cell);
  std::vector<Vec2> forces;
  for (const AdhesionForce& force : results.forces) forces.push_back(force.force_nN);
  const ColourScale colours = traction_scale(results);
  const ArrowScale scale = arrow_scale(forces);
  for (const AdhesionForce& force : results.forces) {
    const Adhesion& adhesion = *by_id.at(force.adhesion_id);
    map.polygon(
        ellipse_corners(adhesion, kEllipseCorners),
        "stroke:#333;stroke-width:0.5;fill:" + colours.colour(norm(force.force_nN) / area_stood_for_um2(adhesion)),
        hover_of(adhesion, results));
  }
  for (const AdhesionForce& force : results.forces) {
    map.arrow(by_id.at(force.adhesion_id)->position_um, scale.px_per_unit * force.force_nN,
              "stroke-width:1.4;stroke:#111");
  }
  const std::string of_candidates =
      has_origin(results.cell, AdhesionOrigin::candidate) ? " " + sentence("maps.candidates") : "";
  return {map,
          std::string(std::ranges::all_of(results.cell.adhesions,
                                          [](const Adhesion& a) { return a.origin == AdhesionOrigin::candidate; })
                          ? sentence("maps.candidate-colours")
                          : sentence("maps.adhesion-colours")) +
              " " + sentence("maps.adhesion-forces") + of_candidates + caption_of_cut(results.cell),
          legend(arrow_legend(scale, "nN") + colour_bar(colours))};
}

Figure usual_method_map(const CellResults& results) {
  const UsualMethod& usual = results.usual_method.value();
  const Extent box = map_box(results);
  Chart map = empty_map(box, "What the usual method says");
  double largest_kPa = 0;
  for (const Vec2 t : usual.tractions_kPa) largest_kPa = std::max(largest_kPa, norm(t));
  // its own: smoothed, they are so much smaller that the model's colours show nothing
  const ColourScale colours{.low = 0, .high = round_end(largest_kPa), .label = "traction (kPa)"};
  map.picture(box.low_um, box.high_um,
              picture_of_squares({usual.positions_um, usual.tractions_kPa}, usual.spacing_um, box, colours));
  draw_outline(map, results.cell, "fill:none;stroke-width:1.3;stroke:#fff;stroke-dasharray:5 3");
  draw_adhesions(map, results, "fill:none;stroke:#fff;stroke-width:0.7", Hover::none);
  const std::string lambda = usual.lambda_um_per_kPa ? fmt::format(", λ = {} µm/kPa (criterion: {})",
                                                                   readable(*usual.lambda_um_per_kPa), usual.lambda_by)
                                                     : "";
  return {map,
          sentence("maps.fttc", lambda, usual.spacing_um, readable(largest_kPa), readable(usual.total_force_nN),
                   readable(results.fit.total_force_nN)) +
              caption_of_cut(results.cell),
          legend(colour_bar(colours))};
}

namespace {

/// @param link_force_nN  that each link of a fibre is coloured by; empty: the fibre's fitted tension colours all of it
Chart map_of_network(const CellResults& results, const std::string& title, const Network& network,
                     const std::vector<double>& link_force_nN, const ColourScale& scale) {
  Chart map = new_map(results, title);
  const SortedLinks links = sorted_links(network, link_force_nN);
  draw_web(map, results, links.web, link_force_nN.empty() ? Hover::whole : Hover::none);
  for (const Fibre& fibre : results.cell.fibres) {
    const auto own = links.fibres.find(fibre.fibre_id);
    if (own == links.fibres.end()) continue;
    const auto& [id, pieces] = *own;
    const std::string text = hover_of(fibre, results);
    const auto tension = results.tensions.find(id);
    map.pieces(pieces, kHalo, text);
    if (link_force_nN.empty())
      map.pieces(pieces,
                 kThick + (tension == results.tensions.end() ? "#555" : scale.colour(tension->second.tension_nN)),
                 text);
    for (std::size_t k = 0; k < pieces.size() && !link_force_nN.empty(); ++k) {
      const double carried_nN = links.carried_nN.at(id)[k];
      map.pieces({pieces[k]}, kThick + scale.colour(carried_nN),
                 text + "\nthis link carries " + readable(carried_nN) + " nN");
    }
  }
  return map;
}

}  // namespace

Figure network_map(const CellResults& results) {
  const ColourScale scale = tension_scale(results, "fitted tension (nN)");
  Chart map = map_of_network(results, "Where the fibres are", results.network, {}, scale);
  draw_fibre_ids(map, results);
  return {map,
          sentence("maps.network", results.network.vertices_um.size(), results.network.links.size(),
                   has_origin(results.cell, AdhesionOrigin::candidate) ? "candidates for adhesions" : "adhesions") +
              caption_of_cut(results.cell),
          legend(colour_bar(scale))};
}

Figure contracted_network_map(const CellResults& results) {
  const ColourScale scale = tension_scale(results, "force carried (nN)");
  return {map_of_network(results, "Network in equilibrium", results.contracted.network,
                         results.contracted.link_force_nN, scale),
          sentence("maps.contracted"), legend(colour_bar(scale))};
}

std::vector<Figure> displacement_maps(const CellResults& results) {
  const VectorField measured = displacement_of(results.displacement);
  const Extent box = map_box(results);
  const double side_um = averaging_side_um(measured, box);
  const AveragedField means = averaged(measured, box, side_um);
  const ArrowScale scale = arrow_scale(means.means.vectors);
  const auto drawn = [&](const VectorField& field, const std::string& title, const std::string& what,
                         const std::string& caption) {
    Chart map = new_map(results, title);
    draw_adhesions(map, results, "fill:#ddd", Hover::none);
    const std::string explained = draw_arrows(map, field, scale, what, "µm");
    return Figure{map, caption, explained};
  };
  std::vector<Figure> figures = {drawn(means.means, "Measured displacement", "displacement",
                                       sentence("maps.displacement", side_um, means.mean_members))};
  if (!results.residual) return figures;
  const VectorField& residual = *results.residual;
  VectorField fitted = measured;
  for (std::size_t i = 0; i < fitted.vectors.size(); ++i) fitted.vectors[i] = fitted.vectors[i] - residual.vectors[i];
  figures.push_back(drawn(averaged(fitted, box, side_um).means, "Fitted displacement", "displacement",
                          sentence("maps.displacement-of-model")));
  figures.push_back(drawn(averaged(residual, box, side_um).means, "Measured minus fitted", "difference",
                          sentence("maps.displacement-left")));
  return figures;
}

}  // namespace mbtfm::report
