/// The independent reference networks of tests/data/reference/network: each held vertex is an adhesion of its own.
#pragma once

#include "pipeline/contract/network.h"
#include "pipeline/files/csv.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct ReferenceNetwork {
  Network network;
  std::vector<double> tensions_nN;  ///< by group
};

/// @param name  case_21 or case_22
inline ReferenceNetwork reference_network(const std::string& name) {
  const std::filesystem::path folder = test::source_folder() / "tests/data/reference/network" / name;
  const files::CsvTable vertices(folder / "vertices.csv"), links(folder / "links.csv"),
      tensions(folder / "tensions.csv");
  ReferenceNetwork reference;
  for (int v = 0; v < vertices.n_rows(); ++v) {
    reference.network.vertices_um.push_back({vertices.number(v, "x_um"), vertices.number(v, "y_um")});
    reference.network.adhesion_id.push_back(vertices.integer(v, "fixed", 0) == 1 ? v + 1 : 0);
  }
  for (int k = 0; k < links.n_rows(); ++k)
    reference.network.links.push_back({.vertex_a = links.integer(k, "vertex_a", 0),
                                       .vertex_b = links.integer(k, "vertex_b", 0),
                                       .fibre_id = links.integer(k, "group", 0),
                                       .rest_length_um = links.number(k, "rest_length_um")});
  for (int g = 0; g < tensions.n_rows(); ++g) reference.tensions_nN.push_back(tensions.number(g, "tension_nN"));
  return reference;
}

}  // namespace mbtfm::test
