/// Files of a reconstruction in space.
#pragma once

#include <string>

#include "mbtfm/spatial/problem.h"
#include "pipeline/contract/path.h"

namespace mbtfm::spatial {

struct Balance;
struct PartForce;
struct SpatialReconstruction;

/// A table with a row for each vertex, and the surface with the same.
void write_tractions(const Path& csv, const Path& vtp, const Problem& problem,
                     const SpatialReconstruction& reconstruction);
void write_part_forces(const Path& file, const std::vector<PartForce>& forces);
/// Their part of docs/columns.md.
std::string pages_of_tables();

/// The criterion that chose lambda, or "given".
const char* how_lambda(const SpatialReconstruction& reconstruction);
Figures summary_of(const Problem& problem, const SpatialReconstruction& reconstruction, const Balance& balance);

}  // namespace mbtfm::spatial
