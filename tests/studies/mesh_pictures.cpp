/// mesh_pictures: the meshes of the hard cells (tests/support/hard_cells.h) on one sheet, as SVG on stdout.
/// docs/images/mesh/make.sh turns it into docs/images/mesh/hard_cells.png.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "network/mesh/mesh.h"
#include "tests/support/hard_cells.h"

namespace {

using namespace mbtfm;

constexpr int kColumns = 4;
constexpr double kPanel = 300;  // pixels
constexpr double kTitle = 18;
constexpr double kScale = kPanel / 15.0;  // pixels per um: cells of 12 um and what sticks out

void draw_polygon(const Polygon& polygon, const char* style) {
  std::printf("<polygon style=\"%s\" points=\"", style);
  for (const Vec2 p : polygon) std::printf("%.1f,%.1f ", kScale * p.x, kScale * p.y);
  std::printf("\"/>\n");
}

void draw_links(const Network& network, bool of_fibres, const char* style) {
  std::printf("<path style=\"%s\" d=\"", style);
  for (const Link& link : network.links) {
    if ((link.fibre_id > 0) != of_fibres) continue;
    const Vec2 a = kScale * network.vertices_um[link.vertex_a];
    const Vec2 b = kScale * network.vertices_um[link.vertex_b];
    std::printf("M%.1f %.1fL%.1f %.1f", a.x, a.y, b.x, b.y);
  }
  std::printf("\"/>\n");
}

void draw(const test::HardCell& hard, const mesh::GeneratedNetwork& generated) {
  const Network& network = generated.network;
  draw_polygon(hard.cell.outline_um, "fill:#f4f1e8;stroke:none");
  for (const Polygon& hole : hard.cell.holes_um) draw_polygon(hole, "fill:#fff;stroke:none");
  for (const Adhesion& a : hard.cell.adhesions) draw_polygon(ellipse_corners(a, 48), "fill:#f3b7a4;stroke:none");
  draw_links(network, false, "fill:none;stroke:#555;stroke-width:0.7");
  draw_links(network, true, "fill:none;stroke:#1464b4;stroke-width:2.2");
  for (std::size_t v = 0; v < network.vertices_um.size(); ++v) {
    if (network.adhesion_id[v] == 0) continue;
    const Vec2 p = kScale * network.vertices_um[v];
    std::printf("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\" fill=\"#c22\"/>\n", p.x, p.y);
  }
}

}  // namespace

int main() {
  const std::vector<test::HardCell> cells = test::hard_cells();
  const int rows = (static_cast<int>(cells.size()) + kColumns - 1) / kColumns;
  std::printf(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      kColumns * kPanel, rows * (kPanel + kTitle));
  for (int i = 0; i < static_cast<int>(cells.size()); ++i) {
    mesh::NetworkParameters p;
    p.adhesion_anchor = mesh::AdhesionAnchor::rim;
    p.free_fibre_ends = mesh::FreeFibreEnds::width;
    p.link_reach = mesh::LinkReach::neighbours;  // links are the triangulation's edges
    const mesh::GeneratedNetwork generated = mesh::generate_network(cells[i].cell, p);
    std::string title = cells[i].name;
    std::replace(title.begin(), title.end(), '_', ' ');
    std::printf(
        "<g transform=\"translate(%g %g)\"><text x=\"8\" y=\"14\">%s</text>\n<g transform=\"translate(%g %g)\">\n",
        (i % kColumns) * kPanel, (i / kColumns) * (kPanel + kTitle), title.c_str(), 1.2 * kScale,
        kTitle + 1.2 * kScale);
    draw(cells[i], generated);
    std::printf("</g></g>\n");
    std::fprintf(stderr, "%s: %zu vertices, quality mean %.3f worst %.3f, away from lines %.3f %.3f, even %.3f, %s\n",
                 title.c_str(), generated.network.vertices_um.size(), generated.mean_quality, generated.worst_quality,
                 generated.mean_free_quality, generated.worst_free_quality, generated.even_share,
                 generated.report.reason.c_str());
  }
  std::printf("</svg>\n");
}
