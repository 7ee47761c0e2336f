#include "substrate/choice/large_strain.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "substrate/choice/factory.h"
#include "substrate/effects.h"
#include "substrate/loads.h"
#include "substrate/material.h"

namespace mbtfm::choice {
namespace {

std::unique_ptr<substrate::Substrate> neo_hookean(const Gel& gel, double elements_across, int threads) {
  substrate::SubstrateParameters p;
  p.model = substrate::ModelKind::curved;
  p.material = MaterialLaw::neo_hooke;
  p.effects.large_strain = Switch::on;
  p.displacement_tolerance = 0;  // the first mesh
  p.elements_across_adhesion = elements_across;
  p.growth = 8;
  p.margin_thicknesses = 1;  // far away strains are small
  return make_substrate(gel, p, threads);
}

double traction_kPa(const substrate::Ellipse& e, double force_nN) {
  return force_nN / (std::numbers::pi * e.semi_major_um * e.semi_minor_um);
}

/// Magnitude of the force on an ellipse.
double force_on(Index j, const VectorXd& forces_nN) { return forces_nN.segment<2>(2 * j).norm(); }

/// Those that matter: what one strains the gel by makes a displacement as its force times its traction.
std::vector<Index> straining(const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN) {
  constexpr double kLeftOut = 1e-2;  // of the sum of squares: a tenth of the change, which is some per cent
  std::vector<std::pair<double, Index>> squares;
  double left = 0;
  for (Index j = 0; j < std::ssize(ellipses); ++j) {
    const double force = force_on(j, forces_nN);
    squares.emplace_back(std::pow(force * traction_kPa(ellipses[j], force), 2), j);
    left += squares.back().first;
  }
  std::ranges::sort(squares, std::greater());
  const double most = kLeftOut * left;
  std::vector<Index> taken;
  for (const auto& [square, j] : squares) {
    if (left <= most) break;
    taken.push_back(j);
    left -= square;
  }
  std::ranges::sort(taken);
  return taken;
}

std::vector<substrate::Ellipse> chosen(const std::vector<substrate::Ellipse>& all, const std::vector<Index>& taken) {
  std::vector<substrate::Ellipse> some;
  for (const Index j : taken) some.push_back(all[j]);
  return some;
}

}  // namespace

LargeStrain::LargeStrain(const Gel& gel, const std::vector<substrate::Ellipse>& ellipses,
                         const std::vector<Vec2>& points_um, const VectorXd& near_nN, int threads,
                         double elements_across)
    : taken_(straining(ellipses, near_nN)),
      elements_(neo_hookean(gel, elements_across, threads)),
      response_(elements_->response({chosen(ellipses, taken_)}, {points_um})) {}

substrate::Tangent LargeStrain::about(const VectorXd& forces_nN) const {
  VectorXd forces(response_->cols());
  for (std::size_t k = 0; k < taken_.size(); ++k)
    forces.segment<2>(2 * static_cast<Index>(k)) = forces_nN.segment<2>(2 * taken_[k]);
  const auto rest = response_->about(VectorXd::Zero(forces.size())).response;
  const substrate::Tangent there = response_->about(forces);
  return {.displacement_um = there.displacement_um - rest->displace(forces),
          .response =
              substrate::lazy_response({.rows = response_->rows(),
                                        .cols = forces_nN.size(),
                                        .matrix = [taken = taken_, n = forces_nN.size(), there = there.response, rest] {
                                          const MatrixXd a = there->matrix(), b = rest->matrix();
                                          MatrixXd change = MatrixXd::Zero(a.rows(), n);
                                          for (std::size_t k = 0; k < taken.size(); ++k) {
                                            const auto from = 2 * static_cast<Index>(k);
                                            change.middleCols<2>(2 * taken[k]) =
                                                a.middleCols<2>(from) - b.middleCols<2>(from);
                                          }
                                          return change;
                                        }})};
}

double mean_traction_kPa(const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN) {
  double squares = 0, weight = 0;
  for (std::size_t j = 0; j < ellipses.size(); ++j) {
    const double force = force_on(static_cast<Index>(j), forces_nN);
    squares += std::pow(force * traction_kPa(ellipses[j], force), 2);
    weight += force * force;
  }
  return weight > 0 ? std::sqrt(squares / weight) : 0;
}

double left_out_in_gel(const Gel& gel, double traction) { return 0.055 * traction / substrate::shear_modulus_kPa(gel); }
double left_out_at_beads(const Gel& gel, double traction) {
  return 0.015 * traction / substrate::shear_modulus_kPa(gel);
}

Effect decide_large_strain(const substrate::SubstrateParameters& p, double left_out) {
  substrate::check_data(p);
  Effect effect = stage::decided(EffectKind::large_strain, p.effects.large_strain, left_out, p.effects.effect_tolerance,
                                 "under these tractions small-strain theory is off by some");
  const bool has_model =
      p.model == substrate::ModelKind::automatic || std::ranges::any_of(models(), [&](const substrate::Model& model) {
        return model.kind == p.model && model.can.large_strain;
      });
  if (effect.is_on && p.material == MaterialLaw::neo_hooke && !has_model) {
    throw UsageError("substrate.material = neo-hooke: the forces call for large strains, which the model '" +
                     std::string(name_of(p.model)) +
                     "' has not: take the model curved or auto, or switch effects.large_strain off");
  }
  if (p.material == MaterialLaw::linear) {
    if (effect.is_on) effect.why += "; but the material is linear: take substrate.material = neo-hooke";
    effect.is_on = false;
  }
  return effect;
}

}  // namespace mbtfm::choice
