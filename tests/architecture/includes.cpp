/// The layers of the project, read from its #include lines.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = MBTFM_SOURCE_DIR;

/// Which of our folders each folder may include. pipeline/contract is at the bottom, then the mathematics that several
/// stages need and the drawing of charts; stages do not know each other.
const std::map<std::string, std::set<std::string>> kMayInclude = {
    {"pipeline/contract", {}},
    {"pipeline/numerics", {"pipeline/contract"}},
    {"pipeline/charts", {"pipeline/contract"}},
    {"pipeline", {"pipeline/contract", "pipeline/charts"}},
    {"segment", {"pipeline/contract"}},
    {"network", {"pipeline/contract"}},
    {"substrate", {"pipeline/contract", "pipeline/numerics"}},
    {"mbtfm", {"pipeline/contract", "pipeline/numerics", "pipeline/charts", "network", "substrate"}},
    {"samples", {"pipeline/contract", "segment", "network", "substrate", "mbtfm"}},
};

/// Third-party headers and the folders that may see them, by the beginning of the include.
const std::vector<std::pair<std::string, std::set<std::string>>> kThirdParty = {
    {"opencv2/", {"segment"}},
    {"tiff", {"segment"}},
    {"png", {"segment"}},
    {"jpeglib", {"segment"}},
    {"zip", {"segment"}},
    {"expat", {"segment", "pipeline/contract"}},
    {"CGAL/", {"network"}},
    {"Eigen/", {"network", "substrate", "mbtfm", "samples", "pipeline", "pipeline/numerics"}},
    {"fftw3", {"mbtfm"}},
    {"deal.II/", {"substrate"}},
    {"cholmod", {"substrate"}},
    {"metis", {"network", "substrate"}},
    {"cblas", {"substrate"}},
    {"boost/math/", {"mbtfm", "pipeline", "substrate"}},
    {"boost/", {"mbtfm", "pipeline/contract"}},
    {"vtk", {"pipeline/contract"}},
    {"CLI/", {"pipeline", "pipeline/contract"}},
    {"nlohmann/", {"pipeline", "pipeline/charts", "pipeline/contract"}},
    {"fmt/", {"pipeline", "pipeline/charts", "pipeline/contract"}},
    {"toml++/", {"pipeline", "pipeline/contract"}},
    {"openssl/", {"pipeline/contract"}},
    {"librsvg/", {"pipeline"}},
    {"cairo/", {"pipeline"}},
};

struct Include {
  std::string from_folder, from_file, header;
};

std::string folder_of(const fs::path& relative) {
  const std::string text = relative.generic_string();
  for (const char* inner : {"pipeline/contract", "pipeline/numerics", "pipeline/charts"}) {
    if (text.starts_with(std::string(inner) + "/")) return inner;
  }
  return text.substr(0, text.find('/'));
}

std::vector<Include> all_includes() {
  static const std::regex include_line(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<Include> found;
  for (const auto& [folder, allowed] : kMayInclude) {
    if (folder.find('/') != folder.npos) continue;  // inside pipeline
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      const fs::path relative = fs::relative(entry.path(), kRoot);
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        std::smatch match;
        if (!std::regex_search(line, match, include_line)) continue;
        found.push_back({folder_of(relative), relative.generic_string(), match[1]});
      }
    }
  }
  return found;
}

bool is_ours(const std::string& header) {
  return kMayInclude.contains(folder_of(header)) && header.find('/') != header.npos;
}

const std::set<std::string>* third_party_folders(const std::string& header) {
  for (const auto& [prefix, folders] : kThirdParty) {
    if (header.starts_with(prefix)) return &folders;
  }
  return nullptr;
}

TEST(Architecture, stages_know_the_contract_and_not_each_other) {
  const auto includes = all_includes();
  ASSERT_GT(includes.size(), 100u) << "the sources were not found under " << kRoot;
  for (const Include& i : includes) {
    if (!is_ours(i.header)) continue;
    const std::string to = folder_of(i.header);
    EXPECT_TRUE(to == i.from_folder || kMayInclude.at(i.from_folder).contains(to))
        << i.from_file << " includes " << i.header;
  }
}

TEST(Architecture, third_party_headers_stay_in_their_folders) {
  for (const Include& i : all_includes()) {
    if (is_ours(i.header)) continue;
    const auto* folders = third_party_folders(i.header);
    if (folders == nullptr) {
      // what is left is the standard library, POSIX and generated headers
      EXPECT_TRUE(i.header.find('/') == std::string::npos || i.header.starts_with("sys/") ||
                  i.header.starts_with("pipeline/contract/"))
          << i.from_file << " includes " << i.header << ", which no folder owns: add it to the table or drop it";
      continue;
    }
    EXPECT_TRUE(folders->contains(i.from_folder)) << i.from_file << " includes " << i.header;
  }
}

TEST(Architecture, headers_that_other_folders_include_show_no_third_party_but_eigen) {
  std::map<std::string, std::vector<Include>> includes_of;
  std::set<std::string> shown;
  const auto includes = all_includes();
  for (const Include& i : includes) {
    includes_of[i.from_file].push_back(i);
    if (is_ours(i.header) && folder_of(i.header) != i.from_folder &&
        !(i.from_folder.starts_with("pipeline") && folder_of(i.header).starts_with("pipeline/"))) {
      shown.insert(i.header);
    }
  }
  std::vector<std::string> queue(shown.begin(), shown.end());
  while (!queue.empty()) {
    const std::string header = queue.back();
    queue.pop_back();
    for (const Include& i : includes_of[header]) {
      if (is_ours(i.header) && shown.insert(i.header).second) queue.push_back(i.header);
      EXPECT_TRUE(third_party_folders(i.header) == nullptr || i.header.starts_with("Eigen/"))
          << header << ", which other folders include, shows " << i.header;
    }
  }
}

}  // namespace
