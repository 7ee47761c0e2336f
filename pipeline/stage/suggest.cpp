#include "pipeline/stage/suggest.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <climits>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "pipeline/contract/listed.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stage {

extern const std::string_view kElsewhere;  // elsewhere.txt

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

void add_flags(const CLI::App& app, std::vector<std::string>& flags) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
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

/// Without the dashes of a flag, in small letters.
std::string lower(std::string_view word) {
  std::string small(word.substr(std::min(word.find_first_not_of('-'), word.size())));
  std::ranges::transform(small, small.begin(), [](unsigned char c) { return std::tolower(c); });
  return small;
}

/// How many parts, between lines or dashes, both have; a unit is none, and "fibers" is "fibre".
int n_common_parts(std::string_view a, std::string_view b) {
  constexpr std::size_t kShortest = 4;  // letters
  const auto parts_of = [](std::string text) {
    std::ranges::replace(text, '-', '_');
    std::istringstream stream(text);
    std::set<std::string> parts;
    for (std::string part; std::getline(stream, part, '_');) {
      if (part.starts_with("fiber")) part = "fibre";
      if (part.size() > kShortest && part.ends_with('s')) part.pop_back();
      if (part.size() >= kShortest) parts.insert(part);
    }
    return parts;
  };
  const std::set<std::string> of_a = parts_of(lower(a)), of_b = parts_of(lower(b));
  return static_cast<int>(std::ranges::count_if(of_a, [&](const auto& part) { return of_b.contains(part); }));
}

std::string quoted(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "'" : &word == &words.back() ? " or '" : ", '") + word + "'";
  return text;
}

enum class Ours { words, words_and_sentences };  // sentences are of flags and commands

std::string named_elsewhere(const std::vector<std::string>& known, std::string_view word, Ours as) {
  std::istringstream lines{std::string(kElsewhere)};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end = line.find(": ");
    if (line.starts_with('#') || (" " + line.substr(0, end) + " ").find(" " + lower(word) + " ") == line.npos) continue;
    const std::string ours = line.substr(end + 2);
    if (ours.find(' ') != ours.npos && as == Ours::words_and_sentences) return ours;
    const auto same = std::ranges::find_if(known, [&](const auto& k) { return lower(k) == lower(ours); });
    if (same != known.end()) return "did you mean " + quoted({*same}) + "?";
  }
  return "";
}

}  // namespace

std::string did_you_mean(const std::vector<std::string>& known, std::string_view word) {
  constexpr std::size_t kShortest = 3, kMost = 16;  // letters of a beginning, words that are offered
  if (std::string named = named_elsewhere(known, word, Ours::words); !named.empty()) return named;
  const std::string typed = lower(word);
  std::vector<std::string> meant;
  const auto add = [&](const auto& is_meant) {
    if (meant.empty()) std::ranges::copy_if(known, std::back_inserter(meant), is_meant);
  };
  const auto closest = std::ranges::min_element(known, {}, [&](const auto& k) { return edit_distance(k, word); });
  const auto add_closest = [&](int share, int most) {  // how many letters may be wrong: fewer than a share, and so many
    add([&](const std::string& k) {
      const int n_wrong = edit_distance(k, word), n_letters = static_cast<int>(lower(k).size());
      return &k == &*closest && n_wrong <= most && share * n_wrong < n_letters + (share > 2);
    });
  };
  add([&](const std::string& k) { return lower(k) == typed; });
  add([&](const std::string& k) { return typed.size() >= kShortest && lower(k).starts_with(typed); });
  add_closest(3, 2);
  int most = 1;
  for (const std::string& k : known) most = std::max(most, n_common_parts(k, word));
  add([&](const std::string& k) { return n_common_parts(k, word) == most; });
  add_closest(2, INT_MAX);
  add([&](const std::string& k) { return lower(k).size() >= kShortest && typed.starts_with(lower(k)); });
  return meant.empty() || meant.size() > kMost ? "" : "did you mean " + quoted(meant) + "?";
}

std::string suggestion(const CLI::App& app, const std::string& error) {
  if (!error.starts_with("The following argument")) return {};  // was, or were, not expected: CLI::ExtrasError
  std::vector<std::string> flags, commands;
  add_flags(app, flags);
  const CLI::App* given = nullptr;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(command->get_name());
    if (!command->parsed()) continue;
    add_flags(*command, flags);
    given = command;
  }
  const std::string unknown = error.substr(std::min(error.size(), error.find(": ") + 1));
  if (const std::string typed = slip_in(unknown); !typed.empty()) return typed;
  std::istringstream words(unknown);
  std::string meant;
  for (std::string word; words >> word;) {
    word = word.substr(0, word.find('='));
    const bool is_flag = word.starts_with("-");
    if (!is_flag && given != nullptr) continue;
    if (is_flag && !word.starts_with("--")) word = word.substr(0, word.find_first_of("0123456789"));  // -j4
    if (const std::size_t point = word.find('.'); is_flag && point != word.npos) word.replace(0, point + 1, "--");
    const std::vector<std::string>& known = is_flag ? flags : commands;
    std::string likely = named_elsewhere(known, word, Ours::words_and_sentences);
    if (likely.empty()) likely = did_you_mean(known, word);
    if (!likely.empty()) meant += (meant.empty() ? "; " : " ") + likely;
  }
  if (!meant.empty() || commands.empty()) return meant;
  if (given == nullptr) return "; the commands are " + listed(commands);
  if (error.find(" -") != error.npos)
    return std::ranges::find(flags, "--set") == flags.end()
               ? "; what is known of a cell is written in its cell.toml"
               : "; what cell.toml has is set by --set TABLE.KEY=VALUE, as --set gel.youngs_modulus_kPa=4";
  return std::string("; one folder at a time: mbtfm batch FOLDER runs all cells below it") +
         (given->get_option_no_throw("--only") == nullptr ? "" : "; single stages: --only segment,track");
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
