/// A sheet fitted to the beads under it, from its outline to an error budget.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "continuum/sheet/forward.h"
#include "mbtfm/sheets/field_fit.h"
#include "mbtfm/sheets/sheet_fit.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/path.h"

namespace mbtfm::sheets {

/// A part of the sheet: 1 there, 0 elsewhere. All parts add up to the sheet.
struct Part {
  std::string name;
  std::function<double(Vec2)> share;
};

/// What is asked of the beads.
struct Question {
  /// Outline, Poisson's ratio, thickness, mesh, where the sheet adheres, and its contraction's band; the rest is
  /// fitted.
  sheet::Scene scene;
  std::vector<Part> parts = {};          ///< with contractions of their own; those off the sheet are left out
  std::optional<int> field_points = {};  ///< the contraction varies, between so many points
  bool has_line = false;
  std::vector<sheet::Bundle> bundles = {};
  Bond bond = Bond::known;
  std::optional<double> stiffness_nN_per_um = {};  ///< M, if it is known
  tensions::Loss loss = tensions::Loss::squares;
  bool has_motion = true;           ///< the beads may share one
  double outline_error_um = 0;      ///< of its place: outward, along x and along y
  Switch under_load = Switch::off;  ///< auto: off
  double tolerance = 0.01;  ///< of the sheet's half width: where no bead moves further, its places are all the same
};

struct BeadFit {
  SheetFit fit;
  std::optional<FieldFit> field;  ///< if that was asked for; its sheet is `fit`
  std::optional<ContractionLattice> lattice;
  sheet::Scene scene;        ///< with what was found
  sheet::Solution solution;  ///< of it, on the finest triangles
  std::string varied;        ///< what a contraction that varies would change, in a sentence; empty: that is fitted
  Misfit misfit;             ///< against the beads' noise, the mesh's error and the outline's
  DisplacementField beads;   ///< where they were taken
  Effect under_load;
  int n_parts = 1;
};

/// Of a gel, and of gels that are an error away.
struct GelModels {
  using Make = std::function<std::unique_ptr<substrate::Substrate>(const Gel&)>;
  Make usual, with_base;  ///< the latter is asked where the usual one has none
};
/// The answer is the fit's on its own triangles, corrected by finer ones.
/// @param model  the usual one of this gel
/// @param tell  the share that is done, and what is being done
BeadFit fit_beads(
    const Question& question, const DisplacementField& beads, const Gel& gel, const substrate::Substrate& model,
    const GelModels& models, int threads,
    const std::function<void(double, const char*)>& tell = [](double, const char*) {});

/// By how much the displacements (2·beads) of a solution change with triangles of half the size, and what is left then:
/// columns whose squares add up to a standard error's. Meshes differ without order, so that is the root mean square of
/// the differences between three of them: its own, one of 0.7 of the size, and the finest.
struct MeshChange {
  VectorXd um;
  MatrixXd left_um;
  sheet::TriangleSize size;  ///< of the finest triangles
};
/// The finer meshes of an outline, for what is found on it.
class FinerMeshes {
 public:
  /// @param gel  must outlive them
  FinerMeshes(const sheet::Scene& scene, const substrate::Substrate& gel, int threads);
  /// @param solution  of the scene on its own triangles
  MeshChange change(const sheet::Scene& scene, const sheet::Solution& solution,
                    const std::vector<Vec2>& points_um) const;

 private:
  const substrate::Substrate& gel_;
  sheet::FinerMesh finer_, finest_;
};
/// The table's answer and this change together move the beads.
tensions::LinearData corrected(tensions::LinearData data, const MeshChange& change);

// Files of a sheet's fit.

struct ContractionAt;

void write_estimates(const Path& file, const SheetFit& fit);
void write_contractions(const Path& file, const std::vector<ContractionAt>& rows);
void write_models(const Path& file, const SheetFit& fit);
/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::sheets
