/// plane_tractions [first seed] [last seed] [threads] [method] [risk | evidence]: maps of two discs that pull at each
/// other (tests/support/ dipole_scene.h), by method and footprint: peak, moment and total force over the true ones,
/// Sabass' score over that of the best lambda, processor seconds; means over the seeds.
#include <cstdio>
#include <ctime>
#include <string>

#include "tests/support/dipole_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::tractions;

struct Row {
  double peak = 0, moment = 0, moment_near = 0, moment_adhesions = 0, total = 0, score = 0, best = 0, seconds = 0;
};

Polygon square_outline(double side_um, double margin_um) {
  const double a = margin_um, b = side_um - margin_um;
  return {{a, a}, {b, a}, {b, b}, {a, b}};
}

Row measure(const test::DipoleOptions& o, TractionMethod method, LambdaCriterion lambda_by, unsigned seed,
            int threads) {
  const test::DipoleScene scene = test::dipole_scene(o, seed);
  TractionParameters parameters;
  parameters.method = method;
  parameters.gel_model = GelModel::half_space;
  parameters.element_um = 2;
  parameters.lambda_by = lambda_by;
  TractionInputs inputs = scene.inputs;
  if (method != TractionMethod::adhesion_forces) inputs.adhesions.clear();
  TractionInputs near = inputs;
  near.outline_um = square_outline(o.field_um, 0.5 * (o.field_um - o.distance_um) - o.radius_um - 3);
  if (method == TractionMethod::bem) inputs.outline_um = near.outline_um;
  Row row;
  const std::clock_t begin = std::clock();
  const Reconstruction r = reconstruct(inputs, parameters, threads);
  row.seconds = double(std::clock() - begin) / CLOCKS_PER_SEC;
  const TractionSums all = sums_of(r, inputs, 1.5), sums_near = sums_of(r, near, 0);
  const test::SabassScore score = test::sabass_score(scene, r.patches);
  row.peak = score.peak;
  row.score = score.total();
  row.moment = all.contractile_moment_nN_um() / scene.moment_nN_um;
  row.moment_near = sums_near.contractile_moment_nN_um() / scene.moment_nN_um;
  TractionInputs grown = scene.inputs;
  row.moment_adhesions = sums_of(r, grown, 1.5).contractile_moment_nN_um() / scene.moment_nN_um;
  row.total = all.total_force_nN / (2 * scene.force_nN);
  row.best = row.score;
  if (method == TractionMethod::fttc) {
    for (double factor = 1.0 / 8; factor < 9; factor *= 1.3) {
      parameters.lambda_um_per_kPa = factor * *r.lambda;
      const Reconstruction other = reconstruct(inputs, parameters, threads);
      row.best = std::min(row.best, test::sabass_score(scene, other.patches).total());
    }
  }
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  const unsigned first = argc > 1 ? std::stoi(argv[1]) : 1, last = argc > 2 ? std::stoi(argv[2]) : 3;
  const int threads = argc > 3 ? std::stoi(argv[3]) : 1;
  const std::string only = argc > 4 ? argv[4] : "";
  const LambdaCriterion lambda_by =
      argc > 5 && argv[5] == std::string("evidence") ? LambdaCriterion::evidence : LambdaCriterion::risk;
  test::DipoleOptions options;
  std::printf("method radius_um peak moment moment_near moment_adhesions total score over_best seconds\n");
  for (const TractionMethod method :
       {TractionMethod::fttc, TractionMethod::sparse, TractionMethod::bem, TractionMethod::adhesion_forces}) {
    if (!only.empty() && name_of(method) != only) continue;
    for (const double radius_um : {0.27, 0.5, 1.0, 2.0, 5.0}) {
      options.radius_um = radius_um;
      Row mean;
      const double n = last - first + 1;
      for (unsigned seed = first; seed <= last; ++seed) {
        const Row row = measure(options, method, lambda_by, seed, threads);
        mean.peak += row.peak / n;
        mean.moment += row.moment / n;
        mean.moment_near += row.moment_near / n;
        mean.moment_adhesions += row.moment_adhesions / n;
        mean.total += row.total / n;
        mean.score += row.score / n;
        mean.best += row.score / row.best / n;
        mean.seconds += row.seconds / n;
      }
      std::printf("%-15s %4.2f  %5.2f  %5.3f %5.3f %5.3f  %5.2f  %5.3f %5.2f  %5.1f\n",
                  std::string(name_of(method)).c_str(), radius_um, mean.peak, mean.moment, mean.moment_near,
                  mean.moment_adhesions, mean.total, mean.score, mean.best, mean.seconds);
      std::fflush(stdout);
    }
  }
}
