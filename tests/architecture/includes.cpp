/// The layers of the project, read from its #include lines. A folder is a library, a namespace and a node of their
/// graph.
#include <regex>

#include "pipeline/files/text.h"
#include "tests/architecture/graph.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace {

namespace fs = std::filesystem;

using mbtfm::test::Graph;

const fs::path kRoot = mbtfm::test::source_folder();
const std::string kPrograms = "programs";

/// Every node, and which others it may include. The programs (*_main.cpp) lie above all.
const Graph kMayInclude = {
    {"pipeline/contract", {}},
    {"pipeline/files", {"pipeline/contract"}},
    {"pipeline/numerics", {"pipeline/contract", "pipeline/files"}},
    {"pipeline/stage", {"pipeline/contract", "pipeline/files", "pipeline/numerics"}},
    {"pipeline/charts", {"pipeline/contract", "pipeline/files"}},
    {"pipeline/runner", {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage"}},
    {"pipeline/report",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts"}},
    {"pipeline/statistics",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts",
      "pipeline/runner", "pipeline/report"}},
    {"pipeline/cost", {"pipeline/contract", "pipeline/files", "pipeline/charts", "pipeline/runner", "pipeline/report"}},
    {"pipeline/commands",
     {"pipeline/contract", "pipeline/files", "pipeline/report", "pipeline/runner", "pipeline/cost", "pipeline/stage"}},
    {"segment/images", {"pipeline/contract", "pipeline/files", "pipeline/stage"}},
    {"segment/rois", {"pipeline/contract"}},
    {"segment/cells", {"pipeline/contract", "pipeline/numerics", "pipeline/stage", "segment/images", "segment/rois"}},
    {"segment/beads", {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "segment/images"}},
    {"segment/survey",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/report", "segment/images",
      "segment/beads", "segment/cells", "segment/stacks"}},
    {"segment/stacks",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "segment/images", "segment/beads"}},
    {"network/mesh", {"pipeline/contract", "pipeline/numerics", "pipeline/stage"}},
    {"network", {"pipeline/contract"}},
    {"network/cables", {"pipeline/contract", "pipeline/numerics", "pipeline/stage", "network"}},
    {"continuum/sheet",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts", "substrate"}},
    {"substrate", {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage"}},
    {"substrate/greens", {"pipeline/contract", "pipeline/numerics", "substrate"}},
    {"substrate/surface", {"pipeline/contract", "pipeline/charts", "pipeline/numerics", "pipeline/stage"}},
    {"substrate/elements",
     {"pipeline/contract", "pipeline/numerics", "substrate", "substrate/greens", "substrate/surface"}},
    {"substrate/choice",
     {"pipeline/contract", "pipeline/stage", "substrate", "substrate/greens", "substrate/elements"}},
    {"mbtfm/inverse", {"pipeline/contract", "pipeline/numerics"}},
    {"mbtfm/tensions",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts", "network",
      "substrate", "substrate/greens", "mbtfm/inverse"}},
    {"mbtfm/fit",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "network/mesh", "network/cables",
      "substrate", "substrate/choice", "mbtfm/tensions", "mbtfm/tractions", "mbtfm/sheets"}},
    {"mbtfm/sheets",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "continuum/sheet", "mbtfm/tensions", "substrate"}},
    {"mbtfm/tractions",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts", "substrate",
      "substrate/greens", "mbtfm/inverse"}},
    {"mbtfm/spatial",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "substrate", "substrate/choice",
      "substrate/surface", "mbtfm/inverse", "mbtfm/tractions"}},
    {"mbtfm/sheet_stage",
     {"pipeline/contract", "pipeline/files", "pipeline/stage", "pipeline/charts", "pipeline/report", "continuum/sheet",
      "continuum/outlines", "segment/cells", "substrate", "substrate/choice", "mbtfm/tensions", "mbtfm/tractions",
      "mbtfm/sheets"}},
    {"continuum/outlines", {"pipeline/contract", "pipeline/files", "continuum/sheet", "segment/cells", "segment/rois"}},
    {"mbtfm/mean",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts",
      "pipeline/runner", "segment/images", "substrate/greens", "continuum/outlines", "mbtfm/tractions"}},
    {"continuum/solids",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "pipeline/charts"}},
    {"samples/drawing", {"pipeline/contract", "pipeline/numerics", "pipeline/stage", "segment/images"}},
    {"samples/gels", {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "samples/drawing"}},
    {"samples/experiment",
     {"pipeline/contract", "pipeline/files", "pipeline/numerics", "pipeline/stage", "samples/drawing", "network/mesh",
      "network/cables", "substrate", "substrate/choice", "substrate/greens"}},
    {"samples/colonies",
     {"pipeline/contract", "pipeline/files", "pipeline/stage", "samples/drawing", "samples/experiment",
      "continuum/sheet", "substrate", "substrate/greens"}},
    {"samples/plan",
     {"pipeline/contract", "pipeline/files",  "pipeline/numerics",  "pipeline/stage",   "pipeline/charts",
      "pipeline/report",   "network/cables",  "substrate",          "substrate/greens", "substrate/choice",
      "substrate/surface", "mbtfm/tensions",  "mbtfm/fit",          "mbtfm/tractions",  "mbtfm/spatial",
      "continuum/sheet",   "samples/drawing", "samples/experiment", "samples/gels",     "samples/colonies"}},
};

/// Third-party headers and the nodes that may see them, by the beginning of the include.
const std::vector<std::pair<std::string, std::set<std::string>>> kThirdParty = {
    {"opencv2/", {"segment/cells", "segment/beads", "mbtfm/mean", kPrograms}},
    {"tiff", {"segment/images"}},
    {"png", {"pipeline/statistics", "segment/images"}},
    {"jpeglib", {"segment/images"}},
    {"zip", {"segment/rois"}},
    {"pugixml", {"segment/images", "pipeline/files"}},
    {"CGAL/", {"continuum/sheet", "network/mesh", "substrate/surface"}},
    {"Eigen/",
     {"pipeline/numerics", "pipeline/statistics", "network",          "network/cables",     "segment/stacks",
      "samples/gels",      "substrate",           "substrate/greens", "substrate/elements", "substrate/choice",
      "substrate/surface", "samples/plan",        "mbtfm/inverse",    "mbtfm/sheets",       "mbtfm/spatial",
      "mbtfm/tensions",    "mbtfm/tractions",     "mbtfm/mean",       "continuum/sheet",    "continuum/solids"}},
    {"fftw3", {"pipeline/numerics"}},
    {"deal.II/", {"substrate/elements"}},
    {"cholmod", {}},
    {"metis", {"pipeline/numerics"}},
    {"boost/math/", {"mbtfm/inverse", "pipeline/numerics"}},
    {"boost/", {"mbtfm/inverse", "pipeline/numerics"}},
    {"vtk", {"pipeline/files"}},
    {"CLI/", {"pipeline/commands", "pipeline/stage", kPrograms}},
    {"nlohmann/",
     {"pipeline/files", "pipeline/stage", "pipeline/charts", "pipeline/runner", "pipeline/report", "pipeline/cost"}},
    {"fmt/", {"pipeline/charts", "pipeline/report", "pipeline/cost", "pipeline/statistics"}},
    {"toml++/", {"pipeline/files"}},
    {"openssl/", {"pipeline/files"}},
    {"librsvg/", {"pipeline/statistics"}},
    {"cairo/", {"pipeline/statistics"}},
    {"zlib", {"pipeline/statistics"}},
};

/// Headers that show a third party's names to the pipeline's other folders, each told so in its first lines.
const std::set<std::string> kShown = {"pipeline/files/json.h", "pipeline/files/json_record.h", "pipeline/files/toml.h"};

struct Include {
  std::string from, from_file, header;  ///< from: the node
};

std::string top_of(const std::string& path) { return path.substr(0, path.find('/')); }

/// Where a header belongs; the programs where no node has its folder.
std::string node_of(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().generic_string();
  return kMayInclude.contains(folder) && !file.ends_with("_main.cpp") ? folder : kPrograms;
}

std::vector<std::string> sources() {
  std::vector<std::string> found;
  for (const char* top : {"pipeline", "segment", "network", "substrate", "mbtfm", "continuum", "samples"})
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp" && extension != ".inc") continue;
      found.push_back(fs::relative(entry.path(), kRoot).generic_string());
    }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<Include> read_includes() {
  static const std::regex include_line(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<Include> found;
  for (const std::string& file : sources()) {
    std::ifstream stream(kRoot / file);
    for (std::string line; std::getline(stream, line);) {
      std::smatch match;
      if (line.find("include") == line.npos) continue;  // cheaper than the expression
      if (std::regex_search(line, match, include_line)) found.push_back({node_of(file), file, match[1]});
    }
  }
  return found;
}

const std::vector<Include>& all_includes() {
  static const std::vector<Include> includes = read_includes();
  return includes;
}

bool is_ours(const std::string& header) {
  return header.find('/') != header.npos && fs::exists(kRoot / header.substr(0, header.find('/')));
}

const std::set<std::string>* third_party_nodes(const std::string& header) {
  for (const auto& [prefix, nodes] : kThirdParty)
    if (header.starts_with(prefix)) return &nodes;
  return nullptr;
}

/// What is included in fact.
Graph graph_of_sources() {
  Graph graph;
  for (const Include& i : all_includes()) {
    auto& to = graph[i.from];
    if (is_ours(i.header) && node_of(i.header) != i.from) to.insert(node_of(i.header));
  }
  return graph;
}

TEST(Architecture, nodes_include_what_the_table_lets_them_and_no_more) {
  const auto& includes = all_includes();
  ASSERT_GT(includes.size(), 1000u) << "the sources were not found under " << kRoot;
  for (const Include& i : includes) {
    if (!is_ours(i.header) || i.from == kPrograms || node_of(i.header) == i.from) continue;
    EXPECT_TRUE(kMayInclude.at(i.from).contains(node_of(i.header))) << i.from_file << " includes " << i.header;
  }
  const Graph graph = graph_of_sources();
  for (const auto& [node, allowed] : kMayInclude) {
    ASSERT_TRUE(graph.contains(node)) << node << " has no source";
    for (const std::string& to : allowed)
      EXPECT_TRUE(graph.at(node).contains(to))
          << node << " does not include " << to << " any more: take it off the table";
  }
}

TEST(Architecture, the_table_has_no_cycle_and_no_stage_knows_another) {
  EXPECT_EQ(mbtfm::test::levels_of(kMayInclude).size(), kMayInclude.size()) << "a cycle";
  const std::set<std::string> stages = {"segment", "network", "substrate", "mbtfm", "samples"};
  for (const auto& [node, allowed] : kMayInclude)
    for (const std::string& to : allowed) {
      const bool is_above = top_of(node) == "mbtfm" || top_of(node) == "continuum" || top_of(node) == "samples";
      if (is_above || top_of(to) == top_of(node)) continue;
      EXPECT_EQ(top_of(to), "pipeline") << node << " knows " << to;
    }
}

/// Programs stand above all.
TEST(Architecture, a_top_folder_stands_on_those_before_it) {
  const std::vector<std::string> order = {"pipeline",  "network", "substrate", "segment",
                                          "continuum", "mbtfm",   "samples"};
  const auto place = [&](const std::string& node) { return std::ranges::find(order, top_of(node)) - order.begin(); };
  for (const auto& [node, allowed] : kMayInclude)
    for (const std::string& to : allowed) EXPECT_LE(place(to), place(node)) << node << " knows " << to;
}

TEST(Architecture, every_source_lies_in_a_node_or_belongs_to_a_program) {
  for (const std::string& file : sources())
    EXPECT_TRUE(node_of(file) != kPrograms || file.ends_with("_main.cpp"))
        << file << ": its folder is not in the table";
}

/// substrate/greens is the library substrate_greens.
TEST(Architecture, a_node_is_a_library) {
  for (const auto& [node, allowed] : kMayInclude) {
    std::string library = node;
    std::replace(library.begin(), library.end(), '/', '_');
    const std::string list = mbtfm::files::read_text(kRoot / node / "CMakeLists.txt");
    EXPECT_TRUE(mbtfm::test::has_words(list, "mbtfm_library(" + library)) << node << " makes no library " << library;
    for (const std::string& file : sources()) {
      const std::string name = fs::path(file).filename();
      if (node_of(file) != node || !name.ends_with(".cpp")) continue;
      EXPECT_TRUE(mbtfm::test::has_words((" " + list), name)) << file << " is not built";
    }
  }
}

/// substrate/greens is mbtfm::greens; the contract, everybody's vocabulary, is mbtfm itself.
TEST(Architecture, a_node_is_a_namespace) {
  static const std::regex opened(R"(^namespace (mbtfm(::\w+)?) \{)");
  for (const std::string& file : sources()) {
    if (node_of(file) == kPrograms) continue;
    const std::string name = fs::path(node_of(file)).filename();
    std::ifstream stream(kRoot / file);
    for (std::string line; std::getline(stream, line);) {
      std::smatch match;
      if (!line.starts_with("namespace") || !std::regex_search(line, match, opened)) continue;
      // names of Eigen's matrices are everybody's, too
      if (file == "pipeline/numerics/dense.h" && match[1] == "mbtfm") continue;
      EXPECT_EQ(match[1], name == "contract" ? "mbtfm" : "mbtfm::" + name) << file;
    }
  }
}

TEST(Architecture, third_party_headers_stay_in_their_nodes) {
  for (const Include& i : all_includes()) {
    if (is_ours(i.header)) continue;
    const auto* nodes = third_party_nodes(i.header);
    if (nodes == nullptr) {
      // what is left is the standard library and POSIX
      EXPECT_TRUE(i.header.find('/') == std::string::npos || i.header.starts_with("sys/"))
          << i.from_file << " includes " << i.header << ", which no node owns: add it to the table or drop it";
      continue;
    }
    EXPECT_TRUE(nodes->contains(i.from)) << i.from_file << " includes " << i.header;
  }
}

TEST(Architecture, headers_that_other_nodes_include_show_no_third_party_but_eigen) {
  std::map<std::string, std::vector<Include>> includes_of;
  std::set<std::string> shown;
  const auto& includes = all_includes();
  for (const Include& i : includes) {
    includes_of[i.from_file].push_back(i);
    const bool is_own_program =
        i.from == kPrograms && top_of(i.from_file) == top_of(i.header);  // it sees all of its stage
    if (is_ours(i.header) && node_of(i.header) != i.from && !is_own_program) shown.insert(i.header);
  }
  for (const std::string& header : kShown) shown.erase(header);
  std::vector<std::string> queue(shown.begin(), shown.end());
  while (!queue.empty()) {
    const std::string header = queue.back();
    queue.pop_back();
    for (const Include& i : includes_of[header]) {
      if (is_ours(i.header) && !kShown.contains(i.header) && shown.insert(i.header).second) queue.push_back(i.header);
      EXPECT_TRUE(third_party_nodes(i.header) == nullptr || i.header.starts_with("Eigen/"))
          << header << ", which other nodes include, shows " << i.header;
    }
  }
}

/// Set MBTFM_WRITE_DOCS to draw it anew.
TEST(Architecture, the_picture_of_the_graph_is_what_the_sources_include) {
  const fs::path file = kRoot / "docs/images/architecture.svg";
  const std::string picture = mbtfm::test::drawn(graph_of_sources(), "What includes what");
  if (std::getenv("MBTFM_WRITE_DOCS") != nullptr) mbtfm::files::write_text(file, picture);
  EXPECT_EQ(mbtfm::files::read_text(file), picture) << "MBTFM_WRITE_DOCS=1 build/tests/architecture_tests";
}

}  // namespace
