/// mbtfm-add-fibres: the fibres of a segmentation and those that the beads call for, as ImageJ selections to run with.
#include <set>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/files/tables.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/rois/roi.h"

namespace mbtfm::rois {
namespace {

/// Of the ellipse `adhesion 12`, `anchor 12` or `candidate 12`, as lines count: from the centre of the first pixel.
Vec2 centre_of_adhesion(const std::vector<Roi>& rois, int adhesion_id, const std::string& file) {
  constexpr double kCentre_px = 0.5;
  const std::string id = " " + std::to_string(adhesion_id), name = "adhesion" + id;
  const std::set<std::string> names = {name, "anchor" + id, "candidate" + id};
  for (const Roi& roi : rois)
    if (names.contains(roi.name) && roi.points_px.size() == 2)
      return 0.5 * (roi.points_px[0] + roi.points_px[1]) - Vec2{kCentre_px, kCentre_px};
  throw InputError(file, "an ellipse called '" + name + "'", "none",
                   "RoiSet.zip and missing_fibres.csv must be of the same run: mbtfm run CELL");
}

StageReport add_fibres(stage::StageContext& context) {
  const auto rois_file = context.input("rois"), missing_file = context.input("missing");
  const std::vector<Roi> rois = read_rois(rois_file);
  std::vector<Roi> fibres;
  for (const Roi& roi : rois)
    if (is_line(roi.shape)) fibres.push_back(roi);
  const auto n_segmented = static_cast<std::int64_t>(fibres.size());
  const std::vector<MissingFibre> missing = files::read(missing_file, files::missing_fibre_table());
  for (std::size_t k = 0; k < missing.size(); ++k) {
    Roi fibre;
    fibre.shape = RoiShape::polyline;
    fibre.name = "added " + std::to_string(k + 1);
    for (const int id : {missing[k].start_adhesion_id, missing[k].end_adhesion_id})
      fibre.points_px.push_back(centre_of_adhesion(rois, id, rois_file.string()));
    fibres.push_back(fibre);
  }
  write_roi_set(context.output("out"), fibres);
  StageReport report;
  report.summary = std::to_string(n_segmented) + " segmented fibres and " + std::to_string(missing.size()) +
                   " that the beads call for; beside cell.toml, as fibres.zip, they are what mbtfm run takes";
  report.figures = {{"n_segmented", n_segmented}, {"n_added", std::int64_t(missing.size())}};
  return report;
}

}  // namespace
}  // namespace mbtfm::rois

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using namespace mbtfm::rois;
  return mbtfm::stage::run_stage(
      {.name = "add-fibres",
       .files = {{"rois", FileArgument::Kind::input},
                 {"missing", FileArgument::Kind::input},
                 {"out", FileArgument::Kind::output}}},
      argc, argv, [](auto&) {}, add_fibres);
}
