#include "pipeline/runner/told.h"

#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/files/json.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::runner {

using nlohmann::ordered_json;

namespace {

constexpr const char* kFirstTime = "not run yet";  // as status_of says: no news

std::string result_of(const StageTold& told) {
  if (!told.was_run) return name_of(told.status.state) + (": " + told.status.why);
  std::ostringstream text;
  if (!told.converged) text << "NOT CONVERGED: ";
  if (told.report) text << told.report->summary << ' ';
  text << '(' << std::fixed << std::setprecision(1) << told.seconds << " s";
  return text.str();
}

std::string effects_on(const std::vector<Effect>& effects) {
  std::string names;
  for (const Effect& effect : effects)
    if (effect.is_on && effect.setting == Switch::automatic)
      names += (names.empty() ? "" : ", ") + std::string(name_of(effect.kind));
  return names;
}

std::string line(const ordered_json& event) { return files::json_text(event) + "\n"; }

}  // namespace

std::string text_of(const StageTold& told, Detail detail) {
  std::ostringstream text;
  text << std::left << std::setw(9) << told.stage << result_of(told);
  if (told.was_run) {
    if (detail == Detail::all) text << std::fixed << std::setprecision(0) << ", " << told.peak_memory_MB << " MB";
    if (detail == Detail::all || told.status.why != kFirstTime) text << "; " << told.status.why;
    text << ')';
  }
  if (!told.report) return text.str();
  for (const Finding& finding : told.report->findings) {
    const std::string line = "\n  " + line_of(finding);
    text << (is_open(finding) ? stage::warning(line) : line);
  }
  if (detail == Detail::all)
    for (const Effect& effect : told.report->effects) text << "\n  " << stage::line_of(effect);
  else if (const std::string names = effects_on(told.report->effects); !names.empty())
    text << "\n  on as your data call for it: " << names;
  return text.str();
}

std::string events_of(const StageTold& told) {
  ordered_json event = {{"event", "stage"},
                        {"stage", told.stage},
                        {"state", name_of(told.status.state)},
                        {"why", told.status.why},
                        {"converged", told.converged}};
  if (told.was_run) {
    event["seconds"] = told.seconds;
    event["peak_memory_MB"] = told.peak_memory_MB;
  }
  if (!told.report) return line(event);
  event["summary"] = told.report->summary;
  event["figures"] = files::json_of(told.report->figures);
  return line(event) + files::events_of(told.stage, *told.report);
}

std::string event_of_look(const ImageLook& look) {
  return line({{"event", "look"},
               {"cell", look.cell},
               {"fine", look.error.empty() && look.cautions.empty()},
               {"facts", look.facts},
               {"cautions", look.cautions},
               {"error", look.error},
               {"hint", look.hint}});
}

std::string event_of_error(const std::string& message, int exit_code) {
  return line({{"event", "error"}, {"message", message}, {"exit_code", exit_code}});
}

}  // namespace mbtfm::runner
