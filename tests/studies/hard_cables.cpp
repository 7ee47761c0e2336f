/// hard_cables [sheet.svg]: solves the hard cases of the cable network, prints a table of what came out (Markdown) and
/// draws them on one sheet: at rest in grey, contracted in black (slack), red (taut), blue dots (collapsed) and orange
/// (fibres), with the forces on the adhesions as arrows.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "network/cables/cables.h"
#include "tests/support/hard_cables.h"

namespace {

using namespace mbtfm;
using test::HardCables;

struct Solved {
  HardCables scene;
  cables::Equilibrium equilibrium;
  std::vector<Vec2> reactions_nN;
  Eigen::VectorXd forces_nN;
};

Solved solve(const HardCables& scene) {
  const cables::CableNetwork cables(scene.network, scene.parameters);
  Solved s{scene, {}, {}, {}};
  s.equilibrium = cables.equilibrium(s.scene.tensions_nN);
  s.reactions_nN = cables.reactions_nN(s.scene.tensions_nN, s.equilibrium);
  s.forces_nN = cables.adhesion_forces_nN(s.scene.tensions_nN, s.equilibrium);
  return s;
}

std::string row(const Solved& s) {
  const auto count = [&](CableState state) { return std::ranges::count(s.equilibrium.link_states, state); };
  Vec2 net;
  double torque = 0, total = 0, lever_um = 0;
  for (std::size_t v = 0; v < s.reactions_nN.size(); ++v) {
    const Vec2 x = s.equilibrium.positions_um[v], f = s.reactions_nN[v];
    net += f;
    torque += cross(x, f);
    total += norm(f);
    lever_um = std::max(lever_um, norm(x));
  }
  const double largest_tension = *std::ranges::max_element(s.scene.tensions_nN);
  const double unit = largest_tension > 0 ? largest_tension : s.scene.parameters.axial_stiffness_nN;
  char text[400];
  std::snprintf(text, sizeof text, "| %s | %d | %.0e | %.3g | %.0e | %.0e | %td / %td / %td |", s.scene.title.c_str(),
                s.equilibrium.report.iterations, s.equilibrium.report.last_change / unit, total, norm(net) / unit,
                std::abs(torque) / (unit * lever_um), count(CableState::slack), count(CableState::taut),
                count(CableState::collapsed));
  return text;
}

constexpr double kPanel = 220, kCaption = 34, kMargin = 14;

/// Lines from a to b of the links that `wants` asks for, as one path.
template <class Wants>
void draw_links(std::ostream& out, const Network& net, const std::vector<Vec2>& at, const char* style, Wants wants) {
  out << "<path " << style << " d=\"";
  for (std::size_t k = 0; k < net.links.size(); ++k) {
    if (!wants(k)) continue;
    const Vec2 a = at[net.links[k].vertex_a], b = at[net.links[k].vertex_b];
    out << 'M' << a.x << ' ' << a.y << 'L' << b.x << ' ' << b.y;
  }
  out << "\"/>\n";
}

/// Positions in the panel: the cell at rest fills it.
std::vector<Vec2> in_panel(const std::vector<Vec2>& positions_um, const Network& net) {
  Vec2 low = net.vertices_um[0], high = low;
  for (const Vec2 x : net.vertices_um) {
    low = {std::min(low.x, x.x), std::min(low.y, x.y)};
    high = {std::max(high.x, x.x), std::max(high.y, x.y)};
  }
  const Vec2 centre = 0.5 * (low + high);
  const double scale = (kPanel - 2 * kMargin) / std::max(high.x - low.x, high.y - low.y);
  std::vector<Vec2> result;
  for (const Vec2 x : positions_um) result.push_back(Vec2{kPanel / 2, kPanel / 2 + kCaption} + scale * (x - centre));
  return result;
}

void draw(std::ostream& out, const Solved& s) {
  const Network& net = s.scene.network;
  const std::vector<Vec2> before = in_panel(net.vertices_um, net), after = in_panel(s.equilibrium.positions_um, net);
  const auto& states = s.equilibrium.link_states;
  const auto of_network = [&](CableState state) {
    return [&, state](std::size_t k) { return net.links[k].fibre_id == 0 && states[k] == state; };
  };
  out << "<text x=\"" << kPanel / 2 << "\" y=\"14\" text-anchor=\"middle\" font-size=\"13\">" << s.scene.title
      << "</text>\n<text x=\"" << kPanel / 2 << "\" y=\"29\" text-anchor=\"middle\" font-size=\"11\" fill=\"#666\">"
      << s.equilibrium.report.iterations << " steps</text>\n";
  draw_links(out, net, before, "stroke=\"#ddd\" stroke-width=\"0.6\"", [](std::size_t) { return true; });
  draw_links(out, net, after, "stroke=\"#333\" stroke-width=\"0.6\"", of_network(CableState::slack));
  draw_links(out, net, after, "stroke=\"#c22\" stroke-width=\"0.9\"", of_network(CableState::taut));
  draw_links(out, net, after, "stroke=\"#e80\" stroke-width=\"2.2\"",
             [&](std::size_t k) { return net.links[k].fibre_id != 0; });
  for (std::size_t k = 0; k < states.size(); ++k)
    if (states[k] == CableState::collapsed) {
      const Vec2 x = after[net.links[k].vertex_a];
      out << "<circle cx=\"" << x.x << "\" cy=\"" << x.y << "\" r=\"2\" fill=\"#06c\"/>\n";
    }
  double largest = 0;
  for (const Vec2 f : s.reactions_nN) largest = std::max(largest, norm(f));
  for (std::size_t v = 0; v < after.size(); ++v) {
    if (net.adhesion_id[v] == 0) continue;
    out << "<circle cx=\"" << after[v].x << "\" cy=\"" << after[v].y << "\" r=\"2.6\" fill=\"#2a2\"/>\n";
    if (largest < 1e-9) continue;  // rounding of a network without tension
    const Vec2 tip = after[v] + (30 / largest) * s.reactions_nN[v];
    out << "<path stroke=\"#2a2\" stroke-width=\"1.6\" d=\"M" << after[v].x << ' ' << after[v].y << 'L' << tip.x << ' '
        << tip.y << "\"/>\n";
  }
}

void draw_sheet(const std::string& file, const std::vector<Solved>& all) {
  const int columns = 5, rows = (static_cast<int>(all.size()) + columns - 1) / columns;
  std::ofstream out(file);
  out.precision(4);
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" fill=\"none\" viewBox=\"0 0 "
      << columns * kPanel << ' ' << rows * (kPanel + kCaption)
      << "\"><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/><g fill=\"#000\">\n";
  for (std::size_t i = 0; i < all.size(); ++i) {
    out << "<g transform=\"translate(" << static_cast<int>(i) % columns * kPanel << ' '
        << static_cast<int>(i) / columns * (kPanel + kCaption) << ")\">\n";
    draw(out, all[i]);
    out << "</g>\n";
  }
  out << "</g></svg>\n";
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Solved> all;
  std::puts("| case | steps | residual | total force (nN) | net force | net torque | slack / taut / collapsed |");
  std::puts("|---|---|---|---|---|---|---|");
  for (const HardCables& scene : test::hard_cables()) {
    all.push_back(solve(scene));
    std::puts(row(all.back()).c_str());
  }
  if (argc > 1) draw_sheet(argv[1], all);
}
