/// The files of a small made-up cell, for tests of their readers.
#pragma once

#include "pipeline/contract/network.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline Cell small_cell() {
  const auto adhesion = [](int id, Vec2 place_um) {
    return Adhesion{.adhesion_id = id,
                    .position_um = place_um,
                    .area_um2 = 0.5,
                    .major_axis_um = 1.2,
                    .minor_axis_um = 0.53,
                    .angle_rad = 0.1 * id,
                    .eccentricity = 0.9,
                    .mean_intensity = 812.5};
  };
  Cell cell;
  cell.adhesions = {adhesion(1, {10, 10}), adhesion(2, {20.25, 12}), adhesion(7, {15, 1.0 / 3 + 20})};
  cell.fibres = {{.fibre_id = 1,
                  .type = FibreType::ventral,
                  .width_um = 0.6,
                  .start_adhesion_id = 1,
                  .end_adhesion_id = 2,
                  .mean_intensity = 950,
                  .confidence = 1,
                  .points_um = {{10, 10}, {15, 11.5}, {20.25, 12}},
                  .type_confidence = 0.9,
                  .type_reason = "start held, end held; \"both\""},
                 {.fibre_id = 4,
                  .type = FibreType::arc,
                  .width_um = 0.8,
                  .mean_intensity = 40,
                  .confidence = 0.5,
                  .points_um = {{12, 14}, {14, 16}},
                  .type_confidence = 1,
                  .type_reason = ""}};
  cell.outline_um = {{5, 5}, {25, 5}, {25, 25}, {5, 25}};
  cell.holes_um = {{{16, 6}, {17, 6}, {16.5, 7}}};
  return cell;
}

/// Of enough vertices that its arrays fill many blocks of 64 bytes.
inline Network small_network() {
  Network network;
  constexpr int kVertices = 41;
  for (int v = 0; v < kVertices; ++v) {
    network.vertices_um.push_back({v / 3.0, 50 - v * v / 7.0});
    network.adhesion_id.push_back(v % 5 == 0 ? 1 + v / 5 : 0);
    if (v == 0) continue;
    network.links.push_back({.vertex_a = v - 1, .vertex_b = v, .fibre_id = v % 3, .rest_length_um = 1 + v / 9.0});
  }
  return network;
}

/// kCellFiles
inline void write_cell(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const Cell cell = small_cell();
  files::write_adhesions(folder / "adhesions.csv", cell.adhesions);
  files::write_fibres(folder / "fibres.csv", folder / "fibre_points.csv", cell.fibres);
  files::write_outline(folder / "outline.csv", cell.outline_um, cell.holes_um);
}

/// The other tables. @returns their paths
inline std::vector<std::filesystem::path> write_tables(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  DisplacementField field;
  for (int i = 0; i < 20; ++i)
    field.push_back({.position_um = {1.5 * i, 30.0 - i * i / 13.0},
                     .displacement_um = {0.1 * i, -1e-7 * i},
                     .sigma_um = 0.02,
                     .flag = i == 3 ? "neighbours disagree" : ""});
  files::write_displacement(folder / "displacement.csv", field);
  files::write_tensions(folder / "tensions.csv",
                        {{.fibre_id = 0, .tension_nN = 0.06, .low_nN = 0.03, .high_nN = 0.09},
                         {.fibre_id = 1, .tension_nN = 4.2, .identifiable = false}},
                        small_cell().fibres);
  files::write_adhesion_forces(
      folder / "adhesion_forces.csv",
      {{.adhesion_id = 1, .force_nN = {-2.9, 0.1}, .sigma_nN = 0.3, .connected = true, .moment_nN_um = 0.02},
       {.adhesion_id = 7, .force_nN = {2.9, -0.1}, .connected = false}},
      small_cell().adhesions);
  files::write_displacement_in_space(
      folder / "displacement_3d.csv",
      {{{1, 2, 3.25}, {0.1, -0.2, 1.0 / 3}, 0.01, 0.03, ""}, {{4, 5, 6}, {}, 0, 0, "defocused"}});
  files::CsvText heights({"x_um", "y_um", "z_um"});
  for (int k = 0; k < 20; ++k) {
    for (const double value : {1.5 * (k % 5), 2.0 * (k / 5), 0.25 * k - 1}) heights.add(value);
    heights.end_row();
  }
  files::write_text(folder / "heights.csv", heights.str());
  return {folder / "displacement.csv", folder / "tensions.csv", folder / "adhesion_forces.csv",
          folder / "displacement_3d.csv", folder / "heights.csv"};
}

}  // namespace mbtfm::test
