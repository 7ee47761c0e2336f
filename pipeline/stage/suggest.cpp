#include "pipeline/stage/suggest.h"

#include <algorithm>
#include <numeric>
#include <sstream>

#include "pipeline/stage/declared.h"

namespace mbtfm::stage {

namespace {

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = std::exchange(row[0], static_cast<int>(i) + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const int replaced = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

void add_words(const DeclaredCommand& command, std::vector<std::string>& words) {
  for (const DeclaredOption& option : command.options)
    if (!option.flag.empty()) words.push_back(option.flag);
}

}  // namespace

std::string nearest(const std::vector<std::string>& known, std::string_view word) {
  const auto closest = std::ranges::min_element(
      known, [&](const auto& a, const auto& b) { return edit_distance(a, word) < edit_distance(b, word); });
  return closest == known.end() ? std::string() : *closest;
}

bool is_alike(const std::string& known, std::string_view word) {
  return 2 * edit_distance(known, word) < static_cast<int>(known.size());
}

std::string did_you_mean(const std::string& word) { return "did you mean '" + word + "'?"; }

std::string suggestion(const CLI::App& app, const std::string& error) {
  if (!error.starts_with("The following argument")) return {};  // was, or were, not expected: CLI::ExtrasError
  const DeclaredCommand program = declared(app);
  std::vector<std::string> flags, commands;
  add_words(program, flags);
  for (const DeclaredCommand& command : program.subcommands) {
    commands.push_back(command.name);
    if (app.got_subcommand(command.name)) add_words(command, flags);
  }
  std::istringstream words(error.substr(std::min(error.size(), error.find(": ") + 1)));
  std::string meant;
  for (std::string word; words >> word;) {
    word = word.substr(0, word.find('='));
    const std::string known = nearest(word.starts_with("-") ? flags : commands, word);
    if (known.empty() || !is_alike(known, word)) continue;
    meant += (meant.empty() ? "; " : " ") + did_you_mean(known);
  }
  return meant;
}

}  // namespace mbtfm::stage
