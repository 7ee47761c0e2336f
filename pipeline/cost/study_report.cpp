/// A study as a table, a picture and a page.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/charts/box.h"
#include "pipeline/charts/chart.h"
#include "pipeline/cost/study.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/text.h"
#include "pipeline/report/texts.h"

namespace mbtfm::cost {
namespace {

constexpr double kFrame_px = 340;  // the height of each: room for the names of the rungs
// A default is good where no other choice is better by more than this.
constexpr double kNear = 0.2;

bool is_measured(const Measurement& m) { return m.n_runs > 0 && m.failure.empty() && m.error > 0; }

std::string name_of(const Rung& rung) { return rung.value.empty() ? rung.knob : rung.knob + " = " + rung.value; }

std::string stages_of(const Study& study) {
  if (!has_fibres(study.kind)) return "the stage traction";
  return study.has_images ? "all stages" : "network and fit";
}

/// What the error is of.
const char* what_of(const Study& study) { return has_fibres(study.kind) ? "tensions" : "tractions"; }

struct CostRow {
  CellKind kind = {};
  Measurement measured;
  bool is_on_front = false;
};

/// None where it was not measured.
const Measurement* measured(const CostRow& row) { return is_measured(row.measured) ? &row.measured : nullptr; }
const Measurement* measured_tensions(const CostRow& row) { return has_fibres(row.kind) ? measured(row) : nullptr; }
const Measurement* measured_tractions(const CostRow& row) { return !has_fibres(row.kind) ? measured(row) : nullptr; }

files::Table<CostRow> cost_table() {
  using Row = CostRow;
  using files::kResult;
  using files::member;
  return {.file = "cost/cost.csv",
          .columns = {{"knob", member(&Row::measured, &Measurement::rung, &Rung::knob)},
                      {"value", member(&Row::measured, &Measurement::rung, &Rung::value)},
                      {"seconds", member(measured, &Measurement::seconds), kResult},
                      {"cpu_seconds", member(measured, &Measurement::cpu_seconds), kResult},
                      {"peak_memory_MB", member(measured, &Measurement::peak_memory_MB), kResult},
                      {"n_runs", member(measured, &Measurement::n_runs)},
                      {"tension_error", member(measured_tensions, &Measurement::error), kResult},
                      {"force_error", member(measured, &Measurement::force_error), kResult},
                      {"stated_tension_error", member(measured_tensions, &Measurement::stated_error), kResult},
                      {"n_fibres", member(measured_tensions, &Measurement::n_fibres)},
                      {"is_on_front", &Row::is_on_front},
                      {"failure",
                       [](const Row& row) { return row.measured.n_runs == 0 ? "no time left" : row.measured.failure; }},
                      {"traction_error", member(measured_tractions, &Measurement::error), kResult},
                      {"stated_traction_error", member(measured_tractions, &Measurement::stated_error), kResult}}};
}

void write_csv(const fs::path& file, const Study& study) {
  const std::vector<int> front = front_of(study.measurements);
  std::vector<CostRow> rows;
  for (const Measurement& m : study.measurements) {
    const bool is_on_front = std::find(front.begin(), front.end(), static_cast<int>(rows.size())) != front.end();
    rows.push_back({study.kind, m, is_on_front});
  }
  files::write(file, cost_table(), rows);
}

std::vector<Vec2> points_of(const std::vector<Measurement>& measurements, const std::vector<int>& indices) {
  std::vector<Vec2> points;
  for (const int i : indices) {
    const Measurement& m = measurements[i];
    points.push_back({m.cpu_seconds, m.error});
  }
  return points;
}

// Of the charts' 14 px text, and of the dots, with a rim.
constexpr double kLetter_px = 8, kLine_px = 16, kDot_px = 7, kKeyLine_px = 18;

double width_of(const std::string& text) { return kLetter_px * static_cast<double>(text.size()); }

struct NamedDot {
  Vec2 at;  ///< in the units of the axes
  std::string name;
};

/// Write each name beside its dot, the first ones first, where it covers neither a dot nor a name nor the key in the
/// upper right corner; where there is no room it is left out: the table has it, too.
/// @param x, y  logarithmic axes of the chart
void add_names(charts::Chart& chart, const charts::Axis& x, const charts::Axis& y, const std::vector<NamedDot>& dots,
               const std::vector<std::string>& key) {
  const Vec2 frame{charts::Chart::kFrameWidth_px, kFrame_px};
  const auto in_frame = [&](Vec2 at) {
    return Vec2{frame.x * charts::share(x, at.x), frame.y * (1 - charts::share(y, at.y))};
  };
  const auto value_at = [](const charts::Axis& axis, double at) {
    return axis.low * std::pow(axis.high / axis.low, at);
  };
  std::vector<charts::Box> taken;  // pixels of the frame, y downwards
  for (const NamedDot& dot : dots) taken.push_back(charts::box_around(in_frame(dot.at), 2 * kDot_px, 2 * kDot_px));
  for (std::size_t i = 0; i < key.size(); ++i) {
    const double top = 8 + kKeyLine_px * static_cast<double>(i);
    taken.push_back({{frame.x - 10 - width_of(key[i]), top}, {frame.x, top + kKeyLine_px}});
  }
  for (const NamedDot& dot : dots) {
    const double width = width_of(dot.name), aside = 0.5 * width + kDot_px, beyond = 0.5 * kLine_px + kDot_px;
    for (const Vec2 shift : {Vec2{0, -beyond}, Vec2{0, beyond}, Vec2{aside, 0}, Vec2{-aside, 0}, Vec2{aside, -beyond},
                             Vec2{-aside, -beyond}, Vec2{aside, beyond}, Vec2{-aside, beyond}}) {
      const Vec2 centre = in_frame(dot.at) + shift;
      const charts::Box box = charts::box_around(centre, width, kLine_px);
      const bool is_inside = box.low.x >= 0 && box.low.y >= 0 && box.high.x <= frame.x && box.high.y <= frame.y;
      if (!is_inside || std::ranges::any_of(taken, [&](const charts::Box& b) { return overlap(box, b); })) continue;
      chart.label({value_at(x, centre.x / frame.x), value_at(y, 1 - centre.y / frame.y)}, dot.name);
      taken.push_back(box);
      break;
    }
  }
}

/// The knobs of one group, and in every group's frame the same front and default.
charts::Chart chart_of(const std::string& group, const Study& study, const charts::Axis& x, const charts::Axis& y) {
  charts::Chart chart(group, x, y);
  chart.curve(points_of(study.measurements, front_of(study.measurements)), "stroke:#9aa0a6;stroke-width:5;opacity:0.5");
  std::map<std::string, std::vector<int>> knobs;
  for (std::size_t i = 1; i < study.measurements.size(); ++i) {
    const Measurement& m = study.measurements[i];
    if (is_measured(m) && group_of(m.rung.knob, study.kind) == group) knobs[m.rung.knob].push_back(static_cast<int>(i));
  }
  chart.frame_height(kFrame_px);
  std::size_t k = 0;
  std::vector<NamedDot> dots;
  std::vector<std::string> key;
  for (const auto& [knob, indices] : knobs) {
    const std::string colour = charts::kColours[k++ % std::size(charts::kColours)];
    for (const int i : indices) {
      const Measurement& m = study.measurements[i];
      chart.dot({m.cpu_seconds, m.error}, 5, "fill:" + colour + ";stroke:#fff",
                fmt::format("{}: {:.2g} s, error {:.3g}", name_of(m.rung), m.cpu_seconds, m.error));
      dots.push_back({{m.cpu_seconds, m.error}, m.rung.value});
    }
    chart.key(knob, colour);
    key.push_back(knob);
  }
  add_names(chart, x, y, dots, key);
  const Measurement& own = study.measurements.front();
  if (is_measured(own))
    chart.dot({own.cpu_seconds, own.error}, 8, "fill:none;stroke:#000;stroke-width:2.5", "the cell's own settings");
  return chart;
}

void draw(const fs::path& file, const Study& study, const std::string& cell_name) {
  std::vector<double> seconds, errors;
  for (const Measurement& m : study.measurements) {
    if (!is_measured(m)) continue;
    seconds.push_back(m.cpu_seconds);
    errors.push_back(m.error);
  }
  const charts::Axis x =
      charts::axis_over("processor time of " + stages_of(study) + " (s)", seconds, charts::Scale::logarithmic);
  const charts::Axis y = charts::axis_over(std::string("error of the ") + what_of(study) + ", relative", errors,
                                           charts::Scale::logarithmic);
  std::vector<charts::Chart> list;
  for (const std::string& group : groups_of(study.kind)) list.push_back(chart_of(group, study, x, y));
  files::write_text(file, charts::svg_file(list, 2,
                                           {cell_name + ": |t − reference| / |reference| over the " +
                                                (has_fibres(study.kind) ? "fibres" : "surface") +
                                                "; reference: " + study.reference + ".",
                                            report::sentence("cost.front")}));
}

/// The quickest rung of a knob that errs no more than `error`.
const Measurement* quickest(const std::vector<Measurement>& measurements, const std::string& knob, double error) {
  const Measurement* best = nullptr;
  for (const Measurement& m : measurements) {
    if (!is_measured(m) || m.rung.knob != knob || m.error > error) continue;
    if (!best || m.cpu_seconds < best->cpu_seconds) best = &m;
  }
  return best;
}

std::vector<std::string> knobs_of(const std::vector<Measurement>& measurements) {
  std::vector<std::string> knobs;
  for (std::size_t i = 1; i < measurements.size(); ++i) {
    const std::string& knob = measurements[i].rung.knob;
    if (std::find(knobs.begin(), knobs.end(), knob) == knobs.end()) knobs.push_back(knob);
  }
  return knobs;
}

/// "To halve the error from here": by knob, what it takes, or how far the knob gets.
std::string table_of_halving(const std::vector<Measurement>& all) {
  const Measurement& own = all.front();
  std::string text = "| knob | half the error costs | the least error it reaches | at |\n|---|---|---|---|\n";
  for (const std::string& knob : knobs_of(all)) {
    const Measurement* least = nullptr;
    for (const Measurement& m : all)
      if (is_measured(m) && m.rung.knob == knob && (!least || m.error < least->error)) least = &m;
    if (!least) continue;
    const Measurement* half = quickest(all, knob, 0.5 * own.error);
    text += fmt::format("| `{}` | {} | × {:.2f} | {}, time × {:.2g} |\n", knob,
                        half ? fmt::format("time × {:.2g} ({})", half->cpu_seconds / own.cpu_seconds, half->rung.value)
                             : std::string("not reached"),
                        least->error / own.error, least->rung.value, least->cpu_seconds / own.cpu_seconds);
  }
  return text;
}

std::string verdict(const std::vector<Measurement>& all) {
  const double distance = distance_to_front(all, 0);
  if (distance <= 0) return "The cell's own settings lie on the front.";
  return fmt::format("The cell's own settings lie {:.0f} % off the front: {}.", 100 * distance,
                     distance <= kNear ? "near enough" : "another choice is better by more than 20 %");
}

std::string page(const Study& study, const std::string& cell_name) {
  const std::vector<Measurement>& all = study.measurements;
  const bool of_fibres = has_fibres(study.kind);
  std::string text = fmt::format("## {}\n\n![error over time](cost.svg)\n\n", cell_name);
  if (!is_measured(all.front())) return text + "The run with the cell's own settings failed.\n";
  text += verdict(all) +
          fmt::format(" They err by {:.3g} against {} over {} and take {:.2g} s of processor time of {}.\n\n",
                      all.front().error, study.reference,
                      of_fibres ? std::to_string(all.front().n_fibres) + " fibres" : std::string("the surface"),
                      all.front().cpu_seconds, stages_of(study));
  text += table_of_halving(all) + "\n";
  text += "Passed: the stages one after the other, whatever else the machine had to do.\n\n";
  text += fmt::format(
      "| choice | error of {} | stated | error of total force |{} processor (s) | passed (s) | memory (MB) |\n",
      what_of(study), of_fibres ? " fibres |" : "");
  text += of_fibres ? "|---|---|---|---|---|---|---|---|\n" : "|---|---|---|---|---|---|---|\n";
  const std::vector<int> front = front_of(all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Measurement& m = all[i];
    if (!is_measured(m)) {
      text += fmt::format("| {} | {} | | | | |{}\n", name_of(m.rung), m.n_runs == 0 ? "no time left" : m.failure,
                          of_fibres ? " | |" : " |");
      continue;
    }
    const bool is_on_front = std::find(front.begin(), front.end(), static_cast<int>(i)) != front.end();
    text += fmt::format("| {}{} | {:.3g} | {:.3g} | {:.2g} % |{} {:.2g} | {:.2g} | {:.0f} |\n", name_of(m.rung),
                        is_on_front ? " (front)" : "", m.error, m.stated_error, 100 * m.force_error,
                        of_fibres ? fmt::format(" {} |", m.n_fibres) : std::string(), m.cpu_seconds, m.seconds,
                        m.peak_memory_MB);
  }
  return text;
}

}  // namespace

std::vector<int> front_of(const std::vector<Measurement>& measurements) {
  std::vector<int> order;
  for (std::size_t i = 0; i < measurements.size(); ++i)
    if (is_measured(measurements[i])) order.push_back(static_cast<int>(i));
  const auto at = [&](int i) -> const Measurement& { return measurements[i]; };
  std::ranges::stable_sort(order, [&](int a, int b) { return at(a).cpu_seconds < at(b).cpu_seconds; });
  std::vector<int> front;
  for (const int i : order)
    if (front.empty() || at(i).error < at(front.back()).error) front.push_back(i);
  return front;
}

double distance_to_front(const std::vector<Measurement>& measurements, int index) {
  const Measurement& own = measurements[index];
  double distance = 0;
  for (const Measurement& m : measurements) {
    if (!is_measured(m)) continue;
    if (m.cpu_seconds <= own.cpu_seconds) distance = std::max(distance, 1 - m.error / own.error);
    if (m.error <= own.error) distance = std::max(distance, 1 - m.cpu_seconds / own.cpu_seconds);
  }
  return distance;
}

void write_study(const fs::path& folder, const Study& study, const std::string& cell_name) {
  fs::create_directories(folder);
  write_csv(folder / "cost.csv", study);
  draw(folder / "cost.svg", study, cell_name);
  files::write_text(folder / "cost.md", page(study, cell_name));
}

std::string pages_of_tables() { return page_of(cost_table()); }

}  // namespace mbtfm::cost
