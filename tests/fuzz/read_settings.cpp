/// cell.toml, as a stage and as the runner read it.
#include <optional>

#include "pipeline/contract/range.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/record.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/stage/parameters.h"
#include "tests/fuzz/target.h"

namespace mbtfm::fuzz::settings_readers {
namespace {

std::vector<std::string> samples() {
  return {
      "pixel_size_um = 0.1\n\n[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49 # soft\nthickness_um = 60\n",
      "[gel]\nyoungs_modulus_kPa = 8\n[segment]\nwidth_um = 1.5e-1\nlimit_um = inf\nn_rounds = 1_000\nn_more = 0x10\n"
      "seed = 18\nis_drawn = true\nmethod = \"fast\"\nname = '''a\nb'''\n",
      "gel.youngs_modulus_kPa = 8\ngel . \"poisson_ratio\" = 0.3\n[images]\npaxillin = \"p*.tif\"\nactin = "
      "\"\\u00b5.tif\"\n"
      "[effects]\nmodel_error = \"on\"\n[fit]\nlist = [1, [2.5, \"x\"], {a = 1, b.c = 2}]\nday = 1979-05-27T07:32:00Z\n"
      "[[stats.many]]\na = 1\n[[stats.many]]\n"};
}

/// One parameter of each kind.
struct AnyParameters {
  double width_um = 1;
  std::optional<double> limit_um;
  int n_rounds = 1;
  std::optional<int> n_more;
  std::uint64_t seed = 1;
  bool is_drawn = false;
  mbtfm::Switch method = mbtfm::Switch::on;
  std::string name;
};

void declare(mbtfm::stage::ParameterList& list, AnyParameters& p) {
  using mbtfm::Range;
  list.table("segment");
  list.add("width_um", p.width_um, Range::positive(), "a width (um)");
  list.add("limit_um", p.limit_um, Range::any(), "a limit (um)");
  list.add("n_rounds", p.n_rounds, Range::between(1, 1000), "a count");
  list.add("n_more", p.n_more, Range::any(), "another count");
  list.add("seed", p.seed, "a seed");
  list.add("is_drawn", p.is_drawn, "a choice of two");
  list.add("method", p.method, "a choice of some");
  list.add("name", p.name, "a text");
}

void read(std::string_view bytes) {
  const auto file = fuzz::put("cell.toml", bytes);
  fuzz::answer([&] {
    Gel gel;
    AnyParameters parameters;
    stage::ParameterList list;
    declare(list, gel);
    declare(list, parameters);
    stage::read_toml(list, file);
  });
  fuzz::answer([&] {
    runner::read_settings(file, runner::all_stages(), {{.table = "gel", .key = "thickness_um", .value = "50"}});
  });
  fuzz::answer([&] { runner::read_run_settings(fuzz::folder()); });
  fuzz::answer([&] { runner::unset_in(file, {{.table = "gel", .key = "thickness_um", .value = "50"}}); });
  fuzz::answer([&] { runner::read_image_names(fuzz::folder()); });
}

const bool is_added = add({"settings", 10000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::settings_readers
