/// cell.toml as it stands, without knowing what a key means.
#pragma once

#define TOML_ENABLE_FORMATTERS 1
#include <toml++/toml.h>
#include <filesystem>
#include <string>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/toml_depth.h"

namespace mbtfm::runner {

/// @throws InputError with file and line where it is no TOML
inline toml::table read_toml(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  expect_shallow_keys(text, file.string());
  try {
    return toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    throw InputError(file.string() + ":" + std::to_string(error.source().begin.line), "a TOML file",
                     std::string(error.description()));
  }
}

}  // namespace mbtfm::runner
