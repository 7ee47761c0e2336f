/// Of each kind of finding a test makes the cause and sees it fire, and a test sees it silent where all is sound.
/// Studies do not count: nobody runs them with each change.
#include <regex>

#include "pipeline/contract/findings.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

/// Identities.
struct Seen {
  std::set<std::string> to_fire, to_be_silent;
};

void add_matches(const std::string& text, const std::string& pattern, std::set<std::string>& to) {
  const std::regex regex(pattern);
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at) to.insert((*at)[1]);
}

/// What these lines expect by tests/support/findings.h; comments do not count.
Seen seen_in(const std::string& source) {
  const std::string code = std::regex_replace(source, std::regex("//[^\n]*"), "");
  const std::string call = R"re(\(\s*(?:test::)?fires\(\s*"([a-z-]+)")re";
  Seen seen;
  for (const char* either : {"TRUE", "EQ"}) add_matches(code, "_" + (either + call), seen.to_fire);
  for (const char* either : {"FALSE", "EQ"}) add_matches(code, "_" + (either + call), seen.to_be_silent);
  const std::regex lists(R"re(expect_silent\(\s*\{([^}]*)\})re");
  for (std::sregex_iterator at(code.begin(), code.end(), lists), end; at != end; ++at)
    add_matches((*at)[1], R"re("([a-z-]+)")re", seen.to_be_silent);
  return seen;
}

Seen seen_in_all_tests() {
  Seen all;
  const fs::path tests = test::source_folder() / "tests";
  for (const auto& entry : fs::recursive_directory_iterator(tests)) {
    const std::string folder = entry.path().parent_path().filename(), extension = entry.path().extension();
    if (folder == "studies" || folder == "architecture" || (extension != ".h" && extension != ".cpp")) continue;
    std::ifstream stream(entry.path());
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    if (text.find("fires(\"") == text.npos && text.find("expect_silent(") == text.npos)
      continue;  // quick, unlike what follows
    Seen seen = seen_in(text);
    all.to_fire.merge(seen.to_fire);
    all.to_be_silent.merge(seen.to_be_silent);
  }
  return all;
}

TEST(Findings, expectations_are_read_over_lines_and_without_comments) {
  const Seen seen = seen_in(
      "EXPECT_TRUE(fires(\"a-b\", x)); ASSERT_FALSE(test::fires(\n    \"c\", x));\n// EXPECT_TRUE(fires(\"no\", x))\n"
      "EXPECT_EQ(fires(\"d\", x), y); found(\"no\"); test::expect_silent({\"e\",\n\"f\"}, x);");
  EXPECT_EQ(seen.to_fire, (std::set<std::string>{"a-b", "d"}));
  EXPECT_EQ(seen.to_be_silent, (std::set<std::string>{"c", "d", "e", "f"}));
}

TEST(Findings, each_kind_is_seen_to_fire_and_to_be_silent) {
  const Seen seen = seen_in_all_tests();
  for (const KindOfFinding& kind : kinds_of_findings()) {
    EXPECT_TRUE(seen.to_fire.contains(kind.id)) << "no test has EXPECT_TRUE(fires(\"" << kind.id << "\", …))";
    EXPECT_TRUE(seen.to_be_silent.contains(kind.id)) << "no test has EXPECT_FALSE(fires(\"" << kind.id << "\", …))";
  }
}

}  // namespace
}  // namespace mbtfm
