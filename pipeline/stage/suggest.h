/// What was probably meant by a misspelt word, and how it is called where it is to be written.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/stage/parameters_fwd.h"

namespace CLI {
class App;
}

namespace mbtfm::stage {

/// "did you mean 'layer'?" of the known words that were probably meant: those which begin so, of which a third is
/// misspelt, or which have most parts of it (adhesion_min_area: adhesion_smallest_um2); or what other programs call by
/// that word (E, --cores). Empty: none is like it.
std::string did_you_mean(const std::vector<std::string>& known, std::string_view word);

/// What to say after an error of the command line: the flags or commands that its unknown words look like; empty: none.
std::string suggestion(const CLI::App& app, const std::string& error);

/// A text for whoever writes cell.toml and no flags: "--loss huber" becomes "loss = "huber" in [fit]", and what a text
/// offers besides cell.toml goes. Flags of a command that the text names stay.
/// @param images  flags of files, and the keys of [images] that `mbtfm run` takes them from
std::string in_keys(const ParameterList& list, const std::map<std::string, std::string>& images,
                    const std::string& text);

}  // namespace mbtfm::stage
