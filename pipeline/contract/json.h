/// Figures and effects as JSON. Inside pipeline/ only.
#pragma once

#include <nlohmann/json.hpp>

#include "pipeline/contract/json_record.h"
#include "pipeline/contract/report.h"

namespace mbtfm {

nlohmann::ordered_json json_of(const Value& value);
nlohmann::ordered_json json_of(const Figures& figures);
nlohmann::ordered_json json_of(const Effect& effect);
/// @throws InputError where it is none
Effect effect_of(const JsonRecord& record);

}  // namespace mbtfm
