/// The criteria that choose lambda, side by side, as one file.
#include <algorithm>
#include <cmath>

#include "mbtfm/tractions/traction.h"
#include "pipeline/charts/chart.h"
#include "pipeline/files/text.h"

namespace mbtfm::tractions {

namespace {

using charts::Chart, charts::readable, charts::Scale;

constexpr const char *kCurve = "stroke:#0072B2;stroke-width:2", *kPoint = "fill:#0072B2", *kBestColour = "#D55E00",
                     *kBest = "fill:#D55E00", *kChosen = "stroke:#333;stroke-width:1.6;stroke-dasharray:6 4",
                     *kChosenRing = "fill:none;stroke:#333;stroke-width:2";

double same(double x) { return x; }
double log_of(double x) { return std::log(std::max(x, 1e-300)); }
double exp_of(double x) { return std::exp(x); }

/// A fine quantity at one lambda.
double at_lambda(const Refinement& fine, const std::vector<double>& values, double lambda) {
  const double n = static_cast<double>(values.size()) - 1;
  const double at = n * std::log(lambda / fine.lambdas.front()) / std::log(fine.lambdas.back() / fine.lambdas.front());
  return values[static_cast<std::size_t>(std::clamp(std::round(at), 0.0, n))];
}

struct Units {
  std::string lambda;  ///< for people
  double length_um_per_lambda = 1;
  std::string both(double value) const {
    return "ℓ = " + charts::readable(value * length_um_per_lambda) + " µm, λ = " + charts::readable(value) + " " +
           lambda;
  }
};

/// A criterion by lambda, at the scan's points and between.
struct Criterion {
  std::string title, says;
  charts::Axis y;
  std::vector<double> values, fine;
  double best = 0;
};

charts::Chart over_lambda(const LambdaScan& scan, const Refinement& fine, const Units& units, const Criterion& c,
                          double chosen) {
  std::vector<double> lengths;
  std::vector<Vec2> curve;
  for (const ScanPoint& p : scan.points) lengths.push_back(p.lambda * units.length_um_per_lambda);
  for (std::size_t i = 0; i < c.fine.size(); ++i) {
    curve.push_back({fine.lambdas[i] * units.length_um_per_lambda, c.fine[i]});
  }
  charts::Chart chart(c.title, charts::axis_over("ℓ = λE (µm)", lengths, charts::Scale::logarithmic), c.y);
  chart.second_x_axis("λ (" + units.lambda + ")", 1 / units.length_um_per_lambda);
  chart.upright(chosen * units.length_um_per_lambda, kChosen);
  chart.curve(curve, kCurve);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    chart.dot({lengths[i], c.values[i]}, 3, kPoint, units.both(scan.points[i].lambda));
  }
  chart.dot({c.best * units.length_um_per_lambda, at_lambda(fine, c.fine, c.best)}, 6, kBest, units.both(c.best));
  chart.subtitle(c.says + ": " + units.both(c.best), kBestColour);
  return chart;
}

charts::Chart l_curve(const LambdaScan& scan, const Refinement& fine, const Units& units, double chosen) {
  std::vector<double> misfits, norms;
  for (const ScanPoint& p : scan.points) {
    misfits.push_back(std::sqrt(std::max(p.misfit, 0.0)));
    norms.push_back(std::sqrt(p.norm));
  }
  charts::Chart chart("L-curve", charts::axis_over("misfit |u − Gt|", misfits, charts::Scale::logarithmic),
                      charts::axis_over("size of the tractions |t|", norms, charts::Scale::logarithmic));
  const std::vector<double> fine_misfits = fine.of(misfits, log_of, exp_of),
                            fine_norms = fine.of(norms, log_of, exp_of);
  std::vector<Vec2> curve;
  for (std::size_t i = 0; i < fine_norms.size(); ++i) curve.push_back({fine_misfits[i], fine_norms[i]});
  const auto at = [&](double lambda) {
    return Vec2{at_lambda(fine, fine_misfits, lambda), at_lambda(fine, fine_norms, lambda)};
  };
  chart.curve(curve, kCurve);
  for (std::size_t i = 0; i < norms.size(); ++i) {
    chart.dot({misfits[i], norms[i]}, 3, kPoint, units.both(scan.points[i].lambda));
  }
  chart.dot(at(chosen), 9, kChosenRing, units.both(chosen));
  if (scan.by_l_curve) chart.dot(at(*scan.by_l_curve), 6, kBest, units.both(*scan.by_l_curve));
  chart.subtitle(scan.by_l_curve ? "corner: " + units.both(*scan.by_l_curve) : "it has no corner", kBestColour);
  return chart;
}

/// Around its least value: where much noise is let in it grows by powers of ten.
charts::Axis risk_axis(const RiskScale& scale) {
  return {"expected Σ|t − true|² + constant", scale.least - 0.15 * scale.depth, scale.least + 2 * scale.depth,
          charts::Scale::linear};
}

}  // namespace

void write_lambda_picture(const Path& file, const Reconstruction& r, const std::string& chosen_by) {
  const LambdaScan& scan = *r.scan;
  const Units units{.lambda = r.lambda_unit == LambdaUnit::um_per_nN ? "µm/nN" : "µm/kPa",
                    .length_um_per_lambda = *r.length_um / *r.lambda};
  const Refinement fine(scan.points);
  const RiskScale scale(scan.risk);
  const auto chart = [&](const Criterion& c) { return over_lambda(scan, fine, units, c, *r.lambda); };
  const std::vector<charts::Chart> all = {
      chart({.title = "Generalised cross-validation",
             .says = "least",
             .y = charts::axis_over("GCV", scan.gcv, charts::Scale::logarithmic),
             .values = scan.gcv,
             .fine = fine.of(scan.gcv, log_of, exp_of),
             .best = scan.by_gcv}),
      l_curve(scan, fine, units, *r.lambda),
      chart({.title = "Bayesian evidence",
             .says = "largest",
             .y = charts::axis_over("log evidence − largest", scan.evidence, charts::Scale::linear),
             .values = scan.evidence,
             .fine = fine.of(scan.evidence, same, same),
             .best = scan.by_evidence}),
      chart({.title = "Risk",
             .says = "least",
             .y = risk_axis(scale),
             .values = scan.risk,
             .fine = fine.of(
                 scan.risk, [&](double x) { return scale.to(x); }, [&](double x) { return scale.from(x); }),
             .best = scan.by_risk})};
  files::write_text(file, charts::svg_file(all, 2,
                                           {"Chosen, " + chosen_by + ": " + units.both(*r.lambda) +
                                            " (dashed; on the L-curve the ring)"}));
}

}  // namespace mbtfm::tractions
