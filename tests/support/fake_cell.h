/// Cell folders with files of the right form and invented values, to test what reads them without running the stages.
#pragma once

#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// A round cell of radius 20 um with 12 adhesions, two ventral fibres, a dorsal one and an arc.
inline Cell round_cell() {
  Cell cell;
  const Vec2 centre{30, 30};
  const auto on_circle = [&](double radius, double angle) {
    return centre + radius * Vec2{std::cos(angle), std::sin(angle)};
  };
  for (int i = 0; i < 48; ++i) cell.outline_um.push_back(on_circle(20, 2 * std::numbers::pi * i / 48));
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * std::numbers::pi * i / 12;
    cell.adhesions.push_back({.adhesion_id = i + 1,
                              .position_um = on_circle(17, angle),
                              .area_um2 = std::numbers::pi / 4 * 1.2 * 0.5,
                              .major_axis_um = 1.2,
                              .minor_axis_um = 0.5,
                              .angle_rad = angle < std::numbers::pi ? angle : angle - std::numbers::pi,
                              .eccentricity = std::sqrt(1 - 0.25 / 1.44),
                              .mean_intensity = 1});
  }
  const auto add = [&](FibreType type, std::optional<int> start, std::optional<int> end, Polyline points) {
    cell.fibres.push_back({.fibre_id = static_cast<int>(cell.fibres.size()) + 1,
                           .type = type,
                           .width_um = 0.6,
                           .start_adhesion_id = start,
                           .end_adhesion_id = end,
                           .mean_intensity = 1,
                           .confidence = 1,
                           .points_um = std::move(points)});
  };
  const auto at = [&](int adhesion_id) { return cell.adhesions[adhesion_id - 1].position_um; };
  add(FibreType::ventral, 1, 6, {at(1), at(6)});
  add(FibreType::ventral, 3, 10, {at(3), {30, 32}, at(10)});
  add(FibreType::dorsal, 8, {}, {at(8), {28, 24}});
  add(FibreType::arc, {}, {}, {{22, 36}, {28, 40}, {35, 41}});
  return cell;
}

/// Chains along the fibres and a square web between them.
inline Network web_over(const Cell& cell) {
  Network network;
  const auto add_vertex = [&](Vec2 p) {
    int held_by = 0;
    for (const Adhesion& a : cell.adhesions)
      if (norm(a.position_um - p) < 0.5 * a.minor_axis_um) held_by = a.adhesion_id;
    network.vertices_um.push_back(p);
    network.adhesion_id.push_back(held_by);
    return static_cast<int>(network.vertices_um.size()) - 1;
  };
  const auto add_link = [&](int a, int b, int fibre_id) {
    network.links.push_back({.vertex_a = a,
                             .vertex_b = b,
                             .fibre_id = fibre_id,
                             .rest_length_um = norm(network.vertices_um[a] - network.vertices_um[b])});
  };
  for (const Fibre& fibre : cell.fibres) {
    int last = add_vertex(fibre.points_um.front());
    for (std::size_t i = 1; i < fibre.points_um.size(); ++i) {
      const Vec2 from = fibre.points_um[i - 1], to = fibre.points_um[i];
      const int n = std::max(1, static_cast<int>(norm(to - from) / 1.5));
      for (int k = 1; k <= n; ++k) {
        const int next = add_vertex(from + (static_cast<double>(k) / n) * (to - from));
        add_link(last, next, fibre.fibre_id);
        last = next;
      }
    }
  }
  std::map<std::pair<int, int>, int> grid;
  for (int row = 0; row < 80; ++row)
    for (int column = 0; column < 80; ++column) {
      const Vec2 p{1.4 * column + 0.1, 1.4 * row + 0.1};
      if (contains(cell.outline_um, p)) grid[{row, column}] = add_vertex(p);
    }
  for (const auto& [place, vertex] : grid)
    for (const auto& step : {std::pair{0, 1}, {1, 0}, {1, 1}}) {
      const auto next = grid.find({place.first + step.first, place.second + step.second});
      if (next != grid.end()) add_link(vertex, next->second, 0);
    }
  return network;
}

/// cell.toml, 1_segment and 2_track of a cell.
inline void write_given_stages(const fs::path& folder, const Cell& cell) {
  fs::create_directories(folder / "1_segment");
  fs::create_directories(folder / "2_track");
  files::write_text(folder / "cell.toml", "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n");
  files::write_adhesions(folder / "1_segment/adhesions.csv", cell.adhesions);
  files::write_fibres(folder / "1_segment/fibres.csv", folder / "1_segment/fibre_points.csv", cell.fibres);
  files::write_outline(folder / "1_segment/outline.csv", cell.outline_um);
  const std::string name = folder.filename().string();
  std::seed_seq seed(name.begin(), name.end());  // each cell has beads of its own
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(5, 55);
  std::normal_distribution<double> noise(0, 0.01);
  DisplacementField field;
  for (int i = 0; i < 2000; ++i) {
    const Vec2 p{place(random), place(random)};
    const Vec2 inwards = Vec2{30, 30} - p;
    const double size = 0.3 * std::exp(-std::pow(norm(inwards) / 15 - 1, 2));
    field.push_back({.position_um = p,
                     .displacement_um = (size / (norm(inwards) + 1)) * inwards + Vec2{noise(random), noise(random)},
                     .sigma_um = 0.01});
  }
  files::write_displacement(folder / "2_track/displacement.csv", field);
}

/// 3_network and 4_fit with invented tensions; a force towards the cell's centre of gravity on each adhesion, the sum
/// of all forces taken from each in equal parts.
inline void write_invented_fit(const fs::path& folder, unsigned seed = 1) {
  fs::create_directories(folder / "3_network");
  fs::create_directories(folder / "4_fit");
  const Cell cell = files::read_cell(folder / "1_segment");
  const Network network = web_over(cell);
  files::write_network(folder / "3_network/network.vtu", network);

  std::mt19937 random(seed);
  std::lognormal_distribution<double> strength(0.5, 0.7);
  std::vector<Tension> tensions = {{.fibre_id = 0, .tension_nN = 0.06, .low_nN = 0.055, .high_nN = 0.065}};
  for (const Fibre& fibre : cell.fibres) {
    const double t = strength(random);
    tensions.push_back({.fibre_id = fibre.fibre_id,
                        .tension_nN = t,
                        .low_nN = std::max(0.0, t - 0.4),
                        .high_nN = t + 0.4,
                        .identifiable = fibre.fibre_id % 7 != 0});
  }
  files::write_tensions(folder / "4_fit/tensions.csv", tensions, cell.fibres);

  Vec2 centre, net;
  for (const Adhesion& a : cell.adhesions) centre += (1.0 / static_cast<double>(cell.adhesions.size())) * a.position_um;
  std::vector<AdhesionForce> forces;
  for (const Adhesion& a : cell.adhesions) {
    const Vec2 arm = centre - a.position_um;
    forces.push_back({.adhesion_id = a.adhesion_id,
                      .force_nN = (0.5 * strength(random) / (norm(arm) + 1)) * arm,
                      .sigma_nN = 0.1,
                      .connected = a.adhesion_id % 2 == 1});
    net += forces.back().force_nN;
  }
  FitSummary summary{.relative_l2 = 0.16,
                     .expected_relative_l2 = 0.12,
                     .noise_um = 0.01,
                     .network_force_nN = 5,
                     .network_surface_tension_nN_per_um = 0.07,
                     .n_meshes = 4,
                     .iterations = 9,
                     .converged = true};
  for (AdhesionForce& force : forces) {
    force.force_nN = force.force_nN - (1.0 / static_cast<double>(forces.size())) * net;
    summary.total_force_nN += norm(force.force_nN);
  }
  summary.fibre_force_nN = summary.total_force_nN - summary.network_force_nN;
  files::write_adhesion_forces(folder / "4_fit/adhesion_forces.csv", forces, cell.adhesions);
  files::write_fit_summary(folder / "4_fit/fit.json", summary);

  std::vector<Vec2> drawn = network.vertices_um;
  for (std::size_t v = 0; v < drawn.size(); ++v)
    if (network.adhesion_id[v] == 0) drawn[v] += 0.05 * (centre - drawn[v]);
  std::vector<double> carried;
  for (const Link& link : network.links)
    carried.push_back(link.fibre_id == 0 ? 0.06 : tensions[link.fibre_id].tension_nN);
  files::write_contracted_network(folder / "4_fit/contracted.vtu", network, drawn, carried,
                                  std::vector<CableState>(network.links.size(), CableState::slack));

  DisplacementField fitted = files::read_displacement(folder / "2_track/displacement.csv");
  for (Bead& bead : fitted) bead.displacement_um = 0.9 * bead.displacement_um;
  files::write_displacement(folder / "4_fit/fitted_displacement.csv", fitted);
}

}  // namespace mbtfm::test
