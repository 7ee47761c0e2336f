/// Files and report of mbtfm-indent.
#pragma once

#include <string>
#include <vector>

#include "continuum/solids/indent.h"
#include "pipeline/contract/path.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::solids {

/// indent.csv. @param depths_um  of reading: a column each
void write_indentations(const Path& file, const std::vector<Indentation>& solved, const std::vector<double>& depths_um);
/// optima.csv
void write_optima(const Path& file, const std::vector<Optimum>& optima);
/// indent.vtu: the half plane y = 0, x the distance from the axis, z into the gel; squares between the nodes with
/// `displacement_um` by point, `part` (0 gel, 1 cell) and `stress_kPa` (rr, tt, zz, rz, contraction included) by
/// square.
void write_deformed_vtu(const Path& file, const Deformed& deformed);
/// The same of a cell whose contact is no circle: hexahedra between the nodes, x and y as the outline's, stress_kPa xx,
/// yy, zz, xy, yz, xz.
void write_deformed_vtu(const Path& file, const RevolvedBody& deformed);
/// For each depth of reading the map over height and stiffness, and the curves over the height: a picture (SVG).
std::string picture_of(const Setting& setting, const std::vector<Indentation>& solved,
                       const std::vector<Optimum>& optima);
/// Notice cases that are not solved: all of them, or some of a sweep.
/// @throws NotSolved where none is solved
void notice_failures(stage::StageContext& context, const std::vector<Indentation>& solved);
/// Of round cells and of others.
StageReport report_of(const Setting& setting, const std::vector<Indentation>& solved, std::ptrdiff_t n_optima,
                      stage::StageContext& context);
/// For docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::solids
