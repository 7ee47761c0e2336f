#include "pipeline/stage/events.h"

#include <nlohmann/json.hpp>

#include "pipeline/files/json.h"

namespace mbtfm::stage {

std::string events_of(const std::string& stage, const StageReport& report) {
  std::string lines;
  const auto add = [&](const char* kind, const nlohmann::ordered_json& content) {
    nlohmann::ordered_json event = {{"event", kind}, {"stage", stage}};
    event.update(content);
    lines += files::json_text(event) + "\n";
  };
  for (const Finding& finding : report.findings) add("finding", files::json_of(finding));
  for (const Effect& effect : report.effects) add("effect", files::json_of(effect));
  return lines;
}

}  // namespace mbtfm::stage
