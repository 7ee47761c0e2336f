#include "pipeline/stage/suggest.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <regex>
#include <sstream>

#include "pipeline/contract/listed.h"
#include "pipeline/stage/manual.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stage {

namespace {

/// Letters that are changed, left out, added or exchanged with the next one; capitals are as good as small ones.
int edit_distance(std::string_view a, std::string_view b) {
  const auto same = [&](std::size_t i, std::size_t j) {
    return std::tolower(static_cast<unsigned char>(a[i])) == std::tolower(static_cast<unsigned char>(b[j]));
  };
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = static_cast<int>(i + j);
        continue;
      }
      d[i][j] = std::min({d[i - 1][j - 1] + !same(i - 1, j - 1), d[i - 1][j] + 1, d[i][j - 1] + 1});
      if (i > 1 && j > 1 && same(i - 1, j - 2) && same(i - 2, j - 1)) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

void add_words(const DeclaredCommand& command, std::vector<std::string>& words) {
  for (const DeclaredOption& option : command.options)
    if (!option.flag.empty()) words.push_back(option.flag);
}

/// A flag with a dash that a text program made of "--", and blanks around "="; empty: neither.
std::string slip_in(const std::string& words) {
  std::istringstream all(words);
  for (std::string word; all >> word;) {
    if (word.size() == 1 && word[0] == '=') return "; write no blanks around =";
    std::string flag = word;
    for (const char* dash : {"\u2013", "\u2014", "\u2212"})
      if (flag.starts_with(dash)) flag.erase(0, std::string_view(dash).size());
    if (flag.size() < word.size())
      return "; '" + word + "' begins with a long dash: type --" +
             flag.substr(std::min(flag.find_first_not_of('-'), flag.size()));
  }
  return "";
}

}  // namespace

std::string nearest(const std::vector<std::string>& known, std::string_view word) {
  const auto closest = std::ranges::min_element(
      known, [&](const auto& a, const auto& b) { return edit_distance(a, word) < edit_distance(b, word); });
  return closest == known.end() ? std::string() : *closest;
}

bool is_alike(const std::string& known, std::string_view word) {
  const std::size_t n_letters = known.size() - std::min(known.find_first_not_of('-'), known.size());
  return 2 * edit_distance(known, word) < static_cast<int>(n_letters);
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
  const std::string unknown = error.substr(std::min(error.size(), error.find(": ") + 1));
  if (const std::string typed = slip_in(unknown); !typed.empty()) return typed;
  std::istringstream words(unknown);
  const bool has_command = std::ranges::any_of(commands, [&](const auto& name) { return app.got_subcommand(name); });
  std::string meant;
  for (std::string word; words >> word;) {
    word = word.substr(0, word.find('='));
    const bool is_flag = word.starts_with("-");
    std::string known = nearest(is_flag ? flags : commands, word);
    // as other programs call them; "-j4" has its value in it
    constexpr std::array<std::array<std::string_view, 2>, 4> kElsewhere = {
        {{"--force", "--redo"}, {"--overwrite", "--redo"}, {"-j", "--jobs"}, {"-o", "--out"}}};
    for (const auto& [theirs, ours] : kElsewhere)
      if (word.substr(0, word.find_first_of("0123456789")) == theirs && std::ranges::find(flags, ours) != flags.end())
        known = word = ours;
    if (known.empty() || !is_alike(known, word)) continue;
    meant += (meant.empty() ? "; " : " ") + did_you_mean(known);
  }
  if (!meant.empty() || commands.empty()) return meant;
  if (!has_command) return "; the commands are " + listed(commands);
  if (unknown.find("-config") != unknown.npos) return "; cell.toml is read from the folder that is given";
  if (error.find(" -") != error.npos) {
    const bool takes_keys = std::ranges::find(flags, "--set") != flags.end();
    return takes_keys ? "; what cell.toml has is set by --set TABLE.KEY=VALUE, as --set gel.youngs_modulus_kPa=4" : "";
  }
  return "; one folder at a time: mbtfm batch FOLDER runs all cells below it";
}

std::string in_keys(const ParameterList& list, const std::map<std::string, std::string>& images,
                    const std::string& text) {
  static const std::regex beside(R"((cell\.toml),? or (?:as )?--[\w.-]+(?: '[^']*'| [\d.]+)?(?: --[\w.]+ [\d.]+)*)"),
      flag(R"(--([A-Za-z_][\w.-]*\w)(?: (\d[\d.]*\d|\w+))?)");
  constexpr std::size_t kLongest = 10'000;  // beyond, std::regex may run out of stack; no sentence is as long
  if (text.size() > kLongest) return text;
  const std::string given = std::regex_replace(text, beside, "$1");
  std::string worded;
  auto rest = given.cbegin();
  for (std::sregex_iterator at(given.begin(), given.end(), flag), end; at != end; ++at) {
    const std::string before(given.cbegin(), (*at)[0].first), name = (*at)[1], value = (*at)[2];
    const std::size_t command = before.rfind("mbtfm"), clause = before.find_last_of(":;,(");
    if (command != before.npos && (clause == before.npos || clause < command)) continue;
    std::string key, table;
    bool is_value = false;
    if (const auto image = images.find(name); image != images.end()) {
      key = image->second;
      table = "images";
    }
    for (const Parameter& p : list.all()) {
      if (p.flag != name) continue;
      const auto* choice = std::get_if<Choice>(&p.member);
      const bool is_word = choice != nullptr && std::ranges::find(choice->words, value) != choice->words.end();
      is_value = is_word || (!value.empty() && value.find_first_not_of("0123456789.") == value.npos);
      key = p.name + (is_word ? " = \"" + value + '"' : is_value ? " = " + value : "");
      table = p.table;
    }
    if (key.empty()) continue;
    worded += std::string(rest, (*at)[0].first) + key + " in " + (table.empty() ? "cell.toml" : "[" + table + "]");
    rest = is_value ? (*at)[0].second : (*at)[1].second;
  }
  return worded + std::string(rest, given.cend());
}

}  // namespace mbtfm::stage
