#include "pipeline/runner/stage_result.h"

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

std::string outcome_of(const StageResult& result) {
  if (!result.was_run) return name_of(result.status.state) + (": " + result.status.why);
  std::ostringstream text;
  if (!result.converged) text << "NOT CONVERGED: ";
  if (result.report) text << result.report->summary << ' ';
  text << '(' << std::fixed << std::setprecision(1) << result.seconds << " s";
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

std::string text_of(const StageResult& result, Detail detail) {
  std::ostringstream text;
  text << std::left << std::setw(9) << result.stage << outcome_of(result);
  if (result.was_run) {
    if (detail == Detail::all) text << std::fixed << std::setprecision(0) << ", " << result.peak_memory_MB << " MB";
    if (detail == Detail::all || result.status.why != kFirstTime) text << "; " << result.status.why;
    text << ')';
  }
  if (!result.report) return text.str();
  for (const Finding& finding : result.report->findings) {
    const std::string line = "\n  " + line_of(finding);
    text << (is_open(finding) ? stage::warning(line) : line);
  }
  if (detail == Detail::all)
    for (const Effect& effect : result.report->effects) text << "\n  " << stage::line_of(effect);
  else if (const std::string names = effects_on(result.report->effects); !names.empty())
    text << "\n  on as your data call for it: " << names;
  return text.str();
}

std::string events_of(const StageResult& result) {
  ordered_json event = {{"event", "stage"},
                        {"stage", result.stage},
                        {"state", name_of(result.status.state)},
                        {"why", result.status.why},
                        {"converged", result.converged}};
  if (result.was_run) {
    event["seconds"] = result.seconds;
    event["peak_memory_MB"] = result.peak_memory_MB;
  }
  if (!result.report) return line(event);
  event["summary"] = result.report->summary;
  event["figures"] = files::json_of(result.report->figures);
  return line(event) + files::events_of(result.stage, *result.report);
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
