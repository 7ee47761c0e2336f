/// What was probably meant by a misspelt word.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace mbtfm::stage {

/// The known word that takes the fewest changes of letters; empty where none is known.
std::string nearest(const std::vector<std::string>& known, std::string_view word);
/// Less than half of the known word is misspelt.
bool is_alike(const std::string& known, std::string_view word);
/// "did you mean 'layer'?"
std::string did_you_mean(const std::string& word);

/// What to say after an error of the command line: the flags or commands that its unknown words look like; empty: none.
std::string suggestion(const CLI::App& app, const std::string& error);

}  // namespace mbtfm::stage
