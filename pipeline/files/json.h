/// Figures, effects and findings as JSON. Inside pipeline/ only.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "pipeline/contract/stage_report.h"
#include "pipeline/files/json_record.h"

namespace mbtfm::files {

nlohmann::ordered_json json_of(const Value& value);
/// None: null.
nlohmann::ordered_json json_of(const std::optional<double>& value);
nlohmann::ordered_json json_of(const Figures& figures);
nlohmann::ordered_json json_of(const Effect& effect);
nlohmann::ordered_json json_of(const Finding& finding);
/// @throws InputError where it is none
Effect effect_of(const JsonRecord& record);
Finding finding_of(const JsonRecord& record);
/// The member `findings` of a record; none where it has none, as records of older versions.
std::vector<Finding> findings_of(const JsonRecord& record);

/// As text, in lines where indent >= 0. JSON is UTF-8: texts that are not, as names of files may be, show their
/// bytes (names.h), keys too.
std::string json_text(const nlohmann::ordered_json& json, int indent = -1);

/// What a stage found as JSON objects, one a line: its findings, then its effects (docs/formats/json.md, "Events").
std::string events_of(const std::string& stage, const StageReport& report);

}  // namespace mbtfm::files
