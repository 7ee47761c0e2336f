#include "mbtfm/sheets/bead_fit.h"

#include <algorithm>
#include <cmath>

#include "continuum/sheet/mesh_size.h"
#include "mbtfm/sheets/field_fit.h"
#include "mbtfm/sheets/variation.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/placement.h"
#include "pipeline/files/sheet_files.h"
#include "substrate/compliance.h"

namespace mbtfm::sheets {

namespace {

/// The sheet of a question on triangles, and what of it is fitted.
struct Unknowns {
  SheetShape shape;
  std::vector<Part> parts;
  std::vector<std::string> names;
  std::optional<ContractionLattice> lattice;
  VectorXd mean;  ///< of the lattice's functions
};

std::vector<double> share_of(const Part& part, const sheet::Elements& elements, const sheet::Region& region) {
  return contraction_at_points(elements, region, {1, {}, part.share});
}

Unknowns unknowns_of(const Question& q, std::shared_ptr<const sheet::Elements> elements) {
  const sheet::Region& region = q.scene.region;
  Unknowns u;
  u.shape = {.elements = std::move(elements),
             .contractions = {},
             .poisson_ratio = q.scene.material.poisson_ratio,
             .n_rims = static_cast<int>(region.rims.size()),
             .has_line = q.has_line,
             .bundles = {},
             .bond = q.bond,
             .adhesion_nN_per_um3 = q.scene.adhesion_nN_per_um3};
  const sheet::Elements& on = *u.shape.elements;
  u.shape.bundles = within(on, q.bundles);
  for (const Part& part : q.parts) {
    std::vector<double> share = share_of(part, on, region);
    if (std::ranges::all_of(share, [](double s) { return s == 0; })) continue;
    u.parts.push_back(part);
    u.names.push_back(part.name);
    u.shape.contractions.push_back(std::move(share));
  }
  if (q.field_points) {
    u.lattice.emplace(on, *q.field_points);
    u.shape.contractions = u.lattice->shares_on(on);
    u.mean = means_over(on, *u.lattice);
  }
  if (u.shape.contractions.empty())
    u.shape.contractions.push_back(contraction_at_points(on, region, {1, q.scene.contraction.edge_band_um, {}}));
  return u;
}

/// The sheet that a fit has found.
sheet::Scene scene_of(const Question& q, const Unknowns& u, const SheetFit& fit) {
  const Index n_parts = std::ssize(u.shape.contractions), n_bundles = std::ssize(q.bundles);
  sheet::Scene made = q.scene;
  const double nu = made.material.poisson_ratio;
  made.material.youngs_modulus_kPa = fit.stiffnesses.sheet_nN_per_um * (1 - nu * nu) / q.scene.material.thickness_um;
  made.adhesion_nN_per_um3 = fit.stiffnesses.adhesion_nN_per_um3;
  made.contraction.nN_per_um = fit.loads.head(n_parts).maxCoeff();
  if (u.lattice || !u.parts.empty()) made.contraction.edge_band_um = std::nullopt;
  if (u.lattice)
    made.contraction.at = [lattice = *u.lattice, loads = fit.loads, n_parts](Vec2 place) {
      return lattice.shares_at(place).dot(loads.head(n_parts));
    };
  if (!u.parts.empty())
    made.contraction.at = [parts = u.parts, loads = fit.loads](Vec2 place) {
      double sum = 0;
      for (std::size_t k = 0; k < parts.size(); ++k) sum += loads(static_cast<Index>(k)) * parts[k].share(place);
      return sum;
    };
  made.line_tension_nN = q.has_line ? fit.loads(n_parts) : 0;
  for (Index k = 0; k < n_bundles; ++k)
    made.bundles.push_back({u.shape.bundles[k], fit.loads(fit.loads.size() - n_bundles + k)});
  return made;
}

/// Everything that stays while data change.
class Fitter {
 public:
  Fitter(const Question& q, const Unknowns& u, const Gel& gel, const substrate::Substrate& model, int threads)
      : q_(q),
        u_(u),
        model_(model),
        threads_(threads),
        ground_(*u.shape.elements, model, adhering_triangles(*u.shape.elements, q.scene.adhesive_um), threads),
        table_(u.shape, ground_, gel, narrow_um(q.scene.region), threads) {}

  tensions::LinearData data(const DisplacementField& beads) const {
    return data_of(beads, table_, ground_, model_, threads_,
                   q_.has_motion ? tensions::affine_motions(beads) : MatrixXd());
  }
  struct Found {
    SheetFit fit;
    std::optional<FieldFit> field;
  };
  Found fit(tensions::LinearData of) const {
    if (!u_.lattice) return {fit_sheet(std::move(of), table_, q_.loss, q_.stiffness_nN_per_um, u_.names), std::nullopt};
    FieldFit field = fit_field(std::move(of), table_, q_.loss, q_.stiffness_nN_per_um, *u_.lattice, u_.mean);
    SheetFit sheet = field.sheet;
    return {std::move(sheet), std::move(field)};
  }
  const sheet::OnGel& ground() const { return ground_; }
  const StiffnessTable& table() const { return table_; }

 private:
  const Question& q_;
  const Unknowns& u_;
  const substrate::Substrate& model_;
  int threads_;
  sheet::OnGel ground_;
  StiffnessTable table_;
};

VectorXd differences(const std::vector<FittedEstimate>& others, const std::vector<FittedEstimate>& from) {
  VectorXd d(std::ssize(from));
  for (std::size_t k = 0; k < from.size(); ++k) d(static_cast<Index>(k)) = others[k].value - from[k].value;
  return d;
}

/// Errors of a fit, added to its estimates as they are found.
class Errors {
 public:
  explicit Errors(Fitter::Found& found) : found_(found) {}
  /// @returns standard errors by estimate
  VectorXd add(std::optional<double> SheetErrorParts::*part, const MatrixXd& changes_um) {
    if (found_.field) add_error(*found_.field, part, changes_um);
    return add_error(found_.fit, part, changes_um);
  }
  /// Of the estimates alone: of a contraction that varies, its mean.
  void add_sizes(std::optional<double> SheetErrorParts::*part, const VectorXd& sizes) {
    add_error(found_.fit.estimates, part, sizes);
    if (found_.field) found_.field->sheet.estimates = found_.fit.estimates;
  }

 private:
  Fitter::Found& found_;
};

/// At rest, unless it is asked for: on coarse triangles the odds of the other state mistake their error for it
/// (notes/sheets.md).
tensions::BeadsOfState state_of(const Question& q, const Fitter& fitter, const DisplacementField& beads) {
  const Switch setting = q.under_load == Switch::on ? Switch::on : Switch::off;
  return tensions::take_state(
      beads, fitter.data(beads), [&](const DisplacementField& there) { return fitter.data(there); },
      narrow_um(q.scene.region), q.tolerance, setting);
}

constexpr double kFiner = 0.7, kFinest = 0.5;  // of the triangles' size
constexpr double kNear = 0.125;                // of the half width: what a model lacks varies over some of that

}  // namespace

FinerMeshes::FinerMeshes(const sheet::Scene& scene, const substrate::Substrate& gel, int threads)
    : gel_(gel), finer_(scene, kFiner, gel, threads), finest_(scene, kFinest, gel, threads) {}

MeshChange FinerMeshes::change(const sheet::Scene& scene, const sheet::Solution& solution,
                               const std::vector<Vec2>& points_um) const {
  const VectorXd here = sheet::as_vector(displacements_um(gel_, solution, points_um)),
                 finer = finer_.displacements_um(scene, points_um), finest = finest_.displacements_um(scene, points_um);
  MatrixXd left(here.size(), 3);
  left << finer - here, finest - finer, finest - here;
  return {.um = finest - here,
          .left_um = left / std::sqrt(3.0),
          .size = with_edge(scene.size, kFinest * scene.size.at_curves_um)};
}

tensions::LinearData corrected(tensions::LinearData data, const MeshChange& change) {
  substrate::SharedResponse response = data.response;
  const VectorXd measured_um = data.displacement_um;
  return about_forces(std::move(data), std::move(response), measured_um, change.um);
}

BeadFit fit_beads(const Question& q, const DisplacementField& beads, const Gel& gel, const substrate::Substrate& model,
                  const GelModels& models, int threads, const std::function<void(double, const char*)>& tell) {
  tell(0.1, "solving for the sheet at each stiffness");
  const Unknowns unknowns = unknowns_of(q, elements_of(q.scene));
  const Fitter fitter(q, unknowns, gel, model, threads);
  tell(0.5, "fitting");
  tensions::BeadsOfState state = state_of(q, fitter, beads);
  const std::vector<Vec2> places = points_of(state.beads);
  Fitter::Found found = fitter.fit(state.data);
  const std::vector<FittedEstimate> on_own_mesh = found.fit.estimates;

  tell(0.6, "solving on finer triangles");
  const auto solved = [&](const sheet::Scene& scene) {
    return solve_on(fitter.ground(), unknowns.shape.elements, scene);
  };
  sheet::Scene scene = scene_of(q, unknowns, found.fit);
  const MeshChange by_mesh = FinerMeshes(scene, model, threads).change(scene, solved(scene), places);
  found = fitter.fit(corrected(std::move(state.data), by_mesh));
  Errors errors(found);
  errors.add(&SheetErrorParts::mesh, by_mesh.left_um);

  tell(0.8, "asking for the errors");
  scene = scene_of(q, unknowns, found.fit);
  const sheet::Solution solution = solved(scene);
  MatrixXd stated_um = by_mesh.left_um;
  if (q.outline_error_um > 0) {
    const MatrixXd by_outline_um = changes_by_outline_um(scene, solution, model, places, q.outline_error_um, threads);
    errors.add(&SheetErrorParts::outline, by_outline_um);
    stated_um.conservativeResize(Eigen::NoChange, stated_um.cols() + by_outline_um.cols());
    stated_um.rightCols(by_outline_um.cols()) = by_outline_um;
  }
  std::string varied;
  if (!unknowns.lattice) {
    const MatrixXd by_variation_um = changes_by_variation_um(fitter.ground(), scene, solution, model, places);
    const VectorXd moved = errors.add(&SheetErrorParts::variation, by_variation_um);
    varied = sentence_of_variation(found.fit.estimates, moved);
  }
  const Misfit misfit = misfit_of(found.fit.residuals, kNear * narrow_um(q.scene.region), stated_um);
  errors.add_sizes(&SheetErrorParts::substrate, changes_by_modulus(found.fit.estimates, model.stated_error()));
  if (!model.capabilities().base)
    errors.add(&SheetErrorParts::substrate,
               sheet::as_vector(displacements_um(*models.with_base(gel), solution, places)) -
                   sheet::as_vector(displacements_um(model, solution, places)));
  const auto on_other_gel = [&](const Gel& other) {
    const auto its_model = models.usual(other);
    const Fitter its(q, unknowns, other, *its_model, threads);
    return differences(its.fit(its.data(state.beads)).fit.estimates, on_own_mesh);
  };
  for (const Gel& other : tensions::gels_an_error_away(gel))
    errors.add_sizes(&SheetErrorParts::gel, on_other_gel(other));
  const double modulus_sigma_kPa = gel.youngs_modulus_sigma_kPa.value_or(0);
  const bool has_known_stiffness = q.stiffness_nN_per_um || q.scene.adhesion_nN_per_um3;
  if (modulus_sigma_kPa > 0 && has_known_stiffness) {  // forces are not proportional to the modulus
    Gel stiffer = gel;
    stiffer.youngs_modulus_kPa += modulus_sigma_kPa;
    errors.add_sizes(&SheetErrorParts::gel, on_other_gel(stiffer));
  } else if (modulus_sigma_kPa > 0) {
    errors.add_sizes(&SheetErrorParts::gel,
                     changes_by_modulus(found.fit.estimates, modulus_sigma_kPa / gel.youngs_modulus_kPa));
  }

  scene.size = by_mesh.size;
  if (unknowns.lattice) scene.contraction.nN_per_um = found.fit.estimates.front().value;
  sheet::Solution finest = solve_on_gel(scene, model, threads);
  return {.fit = std::move(found.fit),
          .field = std::move(found.field),
          .lattice = unknowns.lattice,
          .scene = std::move(scene),
          .solution = std::move(finest),
          .varied = std::move(varied),
          .misfit = misfit,
          .beads = std::move(state.beads),
          .under_load = std::move(state.effect),
          .n_parts = fitter.table().n_contractions()};
}

namespace {

using files::kResult;

files::Table<SheetModel> model_table() {
  using Row = SheetModel;
  return {.file = "sheet_models.csv",
          .columns = {{"model", &Row::name},
                      {"n_parameters", &Row::n_parameters},
                      {"chi_squared", &Row::chi_squared, kResult},
                      {"relative_l2", &Row::relative_l2, kResult},
                      {"aic", &Row::aic, kResult},
                      {"bic", &Row::bic, kResult}}};
}

files::Table<ContractionAt> contraction_table() {
  using Row = ContractionAt;
  return {.file = "contraction.csv",
          .columns = {{"x_um", files::x_of(&Row::position_um)},
                      {"y_um", files::y_of(&Row::position_um)},
                      {"contraction_nN_per_um", &Row::nN_per_um, kResult},
                      {"sigma_nN_per_um", &Row::sigma_nN_per_um, kResult},
                      {"low_nN_per_um", &Row::low_nN_per_um, kResult},
                      {"high_nN_per_um", &Row::high_nN_per_um, kResult}}};
}

}  // namespace

void write_contractions(const Path& file, const std::vector<ContractionAt>& rows) {
  files::write(file, contraction_table(), rows);
}
void write_estimates(const Path& file, const SheetFit& fit) {
  files::write(file, files::sheet_estimate_table(), {fit.estimates.begin(), fit.estimates.end()});
}
void write_models(const Path& file, const SheetFit& fit) { files::write(file, model_table(), fit.models); }
std::string pages_of_tables() {
  return page_of(files::sheet_estimate_table()) + page_of(contraction_table()) + page_of(model_table());
}

}  // namespace mbtfm::sheets
