/// Budgets that only fall: what a newcomer has to read, and what a compiler has to. A budget is raised only by a commit
/// of its own that says by how much and why. A new capability is a reason, a second implementation is none. When a
/// figure has fallen by more than a fiftieth, lower its budget.
#include <regex>

#include "pipeline/contract/findings.h"
#include "pipeline/files/text.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

constexpr int kLinesOfProduct = 105358;
constexpr int kLinesOfTests = 45616;
constexpr int kLongSources = 6;                                                   // .cpp of the product above 400 lines
constexpr int kLongestSource = 496;                                               // lines
constexpr int kOwnHeadersMedian = 17, kOwnHeadersP90 = 42, kOwnHeadersMost = 90;  // that a source of the product gets
constexpr int kSeeFindings = 35;  // sources of product and tests that a new kind of finding compiles again
constexpr int kKindsOfFindings = 55;
constexpr int kParameterRows = 278;  // of build/docs/parameters.md
constexpr int kWordsOfDocs = 52240;

const std::vector<std::string> kProduct = {"pipeline", "segment",   "network", "substrate",
                                           "mbtfm",    "continuum", "samples"};

/// The tree: the text of each file by its name from the root.
std::map<std::string, std::string> files_below(const std::vector<std::string>& folders,
                                               const std::set<std::string>& extensions) {
  std::map<std::string, std::string> found;
  const fs::path root = test::source_folder();
  for (const std::string& folder : folders)
    for (const auto& entry : fs::recursive_directory_iterator(root / folder))
      if (extensions.contains(entry.path().extension()))
        found[fs::relative(entry.path(), root).generic_string()] = files::read_text(entry.path());
  return found;
}

int n_lines(const std::string& text) { return static_cast<int>(std::count(text.begin(), text.end(), '\n')); }

int n_lines(const std::map<std::string, std::string>& sources) {
  int n = 0;
  for (const auto& [name, text] : sources) n += n_lines(text);
  return n;
}

using Includes = std::map<std::string, std::vector<std::string>>;

Includes includes_of(const std::map<std::string, std::string>& sources) {
  static const std::regex own(R"re((?:^|\n)#include "([^"]+)")re");
  Includes all;
  for (const auto& [name, text] : sources) {
    auto& headers = all[name];
    for (std::sregex_iterator at(text.begin(), text.end(), own), end; at != end; ++at) headers.push_back((*at)[1]);
  }
  return all;
}

void add_headers(const Includes& all, const std::string& name, std::set<std::string>& seen) {
  const auto found = all.find(name);
  if (found == all.end()) return;  // made by the build
  for (const std::string& header : found->second)
    if (seen.insert(header).second) add_headers(all, header, seen);
}

const std::map<std::string, std::string>& product() {
  static const auto sources = files_below(kProduct, {".cpp", ".h", ".inc"});
  return sources;
}

const std::map<std::string, std::string>& tests() {
  static const auto sources = files_below({"tests"}, {".cpp", ".h", ".inc"});
  return sources;
}

TEST(Budgets, of_lines) {
  EXPECT_LE(n_lines(product()), kLinesOfProduct);
  EXPECT_LE(n_lines(tests()), kLinesOfTests);
  int n_long = 0, longest = 0;
  for (const auto& [name, text] : product()) {
    if (!name.ends_with(".cpp")) continue;
    n_long += n_lines(text) > 400;
    longest = std::max(longest, n_lines(text));
  }
  EXPECT_LE(n_long, kLongSources);
  EXPECT_LE(longest, kLongestSource);
}

TEST(Budgets, of_headers_that_a_source_gets) {
  auto all = product();
  all.insert(tests().begin(), tests().end());
  const Includes includes = includes_of(all);
  std::vector<int> n_headers;
  int n_see_findings = 0;
  for (const auto& [name, text] : all) {
    if (!name.ends_with(".cpp")) continue;
    std::set<std::string> headers;
    add_headers(includes, name, headers);
    n_see_findings += headers.contains("pipeline/contract/kinds_of_findings.h");
    if (product().contains(name)) n_headers.push_back(static_cast<int>(headers.size()));
  }
  std::sort(n_headers.begin(), n_headers.end());
  EXPECT_LE(n_headers[n_headers.size() / 2], kOwnHeadersMedian);
  EXPECT_LE(n_headers[n_headers.size() * 9 / 10], kOwnHeadersP90);
  EXPECT_LE(n_headers.back(), kOwnHeadersMost);
  EXPECT_GT(n_see_findings, 0);
  EXPECT_LE(n_see_findings, kSeeFindings);
}

TEST(Budgets, of_what_users_have_to_know) {
  EXPECT_LE(kinds_of_findings().size(), kKindsOfFindings);
  const std::string parameters = files::read_text(test::build_folder() / "docs/parameters.md");
  int n_rows = 0, n_words = 0;
  std::istringstream lines(parameters);
  for (std::string line; std::getline(lines, line);) n_rows += line.starts_with("| `");
  EXPECT_LE(n_rows, kParameterRows);
  for (const auto& [name, text] : files_below({"docs", "python", "samples"}, {".md"})) {
    std::istringstream stream(text);
    for (std::string word; stream >> word;) ++n_words;
  }
  EXPECT_LE(n_words, kWordsOfDocs);
}

}  // namespace
}  // namespace mbtfm
