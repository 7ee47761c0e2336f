/// substrate_accuracy MODEL [NAME=VALUE …]: error and cost of a model's compliance matrix against the layer, for 170
/// adhesions and 10 000 beads. NAME is a parameter of [gel] or [substrate], or one of `adhesions`, `beads`, `threads`,
/// `repeat`. One line (CSV) on stdout: errors as relative L2 of an adhesion's pair of columns, mean over adhesions.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <iostream>

#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"
#include "substrate/choice/factory.h"
#include "substrate/greens/models.h"
#include "tests/support/settings.h"
#include "tests/support/substrate_scene.h"

namespace {

using namespace mbtfm;

struct Study {
  Gel gel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 30};
  substrate::SubstrateParameters substrate;
  int adhesions = 170, beads = 10000, threads = 2, repeat = 1;
};

void declare(stage::ParameterList& list, Study& study) {
  declare(list, study.gel);
  declare(list, study.substrate);
  list.table("study");
  list.add("adhesions", study.adhesions, Range::positive(), "ellipses");
  list.add("beads", study.beads, Range::positive(), "points");
  list.add("threads", study.threads, Range::positive(), "threads");
  list.add("repeat", study.repeat, Range::positive(), "matrices of one gel, one after the other");
}

double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * t.tv_usec; };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double peak_GB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1e-6 * static_cast<double>(usage.ru_maxrss);
}

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

int run(const std::vector<std::string>& arguments) {
  if (arguments.empty())
    throw UsageError("expected MODEL [NAME=VALUE ...], e.g. refined poisson_ratio=0.4 thickness_um=60");
  Study study;
  stage::ParameterList list;
  declare(list, study);
  stage::set_from_text(stage::parameter_named(list, "model"), arguments.at(0));
  test::set_all(list, {arguments.begin() + 1, arguments.end()});
  const auto points = test::scattered_points(study.beads, 45);
  const auto ellipses = test::scattered_ellipses(study.adhesions, 35);
  const auto model = choice::make_substrate(study.gel, study.substrate, study.threads);
  Eigen::MatrixXd matrix;
  for (int k = 0; k < study.repeat; ++k) {
    const double wall = now_s(), cpu = cpu_s();
    matrix = model->compliance_um_per_nN(points, ellipses);
    std::printf("%s,nu %g,h %g,wall %.2f s,cpu %.2f s,peak %.2f GB,", name_of(study.substrate.model),
                study.gel.poisson_ratio, study.gel.thickness_um, now_s() - wall, cpu_s() - cpu, peak_GB());
  }
  substrate::SubstrateParameters exact;
  exact.model = substrate::ModelKind::layer;
  const Eigen::MatrixXd reference = greens::make_greens(study.gel, exact, 2)->compliance_um_per_nN(points, ellipses);
  const test::ColumnErrors error = test::column_errors(matrix, reference, points, ellipses);
  std::printf("all %.3f %%,outside %.3f %%,inside %.3f %%,worst %.3f %%\n", 100 * error.all, 100 * error.outside,
              100 * error.inside, 100 * error.worst_outside);
  for (const auto& [name, value] : model->figures()) {
    std::cout << "  " << name << " ";
    if (const auto* number = std::get_if<double>(&value)) std::cout << *number;
    if (const auto* whole = std::get_if<std::int64_t>(&value)) std::cout << *whole;
    if (const auto* text = std::get_if<std::string>(&value)) std::cout << *text;
    std::cout << "\n";
  }
  for (const Effect& effect : model->effects()) std::cout << "  " << name_of(effect.kind) << ": " << effect.why << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
