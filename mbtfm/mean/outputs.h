/// Files of mbtfm-mean.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/mean/average.h"
#include "pipeline/contract/figures.h"
#include "pipeline/contract/path.h"

namespace mbtfm::mean {

/// What became of a cell.
struct CellRow {
  std::string cell;
  bool is_kept = true;
  std::string reason = {};  ///< why not
  Way way = {};
  std::optional<double> second_misfit_um = {};  ///< of the best way that is no other view of the same
  bool is_ambiguous = false;
  int n_beads = 0;
  double lambda_um_per_kPa = 0;
};

/// registration.csv
void write_registration(const Path& file, const std::vector<CellRow>& cells);
/// mean.csv and mean.vtp. @param model_kPa  by node, blurred as the cells are; empty: none was given
void write_mean(const Path& table, const Path& points, const std::vector<NodeMean>& nodes,
                const std::vector<Vec2>& model_kPa);
/// blur.csv
void write_blur(const Path& file, const std::vector<WaveShare>& shares);
/// How far the mean is blurred.
struct Blur {
  std::vector<WaveShare> shares;
  double fttc_um = 0, registration_um = 0;
};
/// mean.json
Figures figures_of(const std::vector<CellRow>& rows, const std::vector<NodeMean>& nodes, const std::string& symmetry,
                   const std::optional<Ratio>& ratio, const Blur& blur, double size);
/// The mean traction, the outlines laid onto each other, and the traction along the edge: a picture (SVG).
struct Scene {
  Polygon reference_um;
  std::vector<Polygon> outlines_um;  ///< of the cells, moved
  std::vector<NodeMean> nodes;
  double spacing_um = 0;
  double band_um = 0;
};
std::string picture_of(const Scene& scene);
/// For docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::mean
