/// The tables between stages.
#include "tests/fuzz/target.h"
#include "tests/support/fake_tables.h"

namespace mbtfm::fuzz::csv_readers {
namespace {

/// A cell's tables by name, whole, in the folder `whole`; in `damaged-NAME` one of them is the input.
const std::vector<std::string>& cell_tables() {
  static const std::vector<std::string> names = [] {
    test::write_cell(folder() / "whole");
    put("input.csv", "");
    for (const std::string& damaged : files::kCellFiles) {
      const fs::path inside = folder() / ("damaged-" + damaged);
      fs::create_directory(inside);
      for (const std::string& name : files::kCellFiles)
        fs::create_symlink(name == damaged ? folder() / "input.csv" : folder() / "whole" / name, inside / name);
    }
    return files::kCellFiles;
  }();
  return names;
}

std::vector<std::string> samples() {
  std::vector<std::string> texts;
  for (const std::string& name : cell_tables()) texts.push_back(bytes_of(folder() / "whole" / name));
  for (const fs::path& file : test::write_tables(folder() / "whole")) texts.push_back(bytes_of(file));
  return texts;
}

void read(std::string_view bytes) {
  const auto& tables = cell_tables();
  const auto file = fuzz::put("input.csv", bytes);
  fuzz::answer([&] { files::read_displacement(file); });
  fuzz::answer([&] { files::read_displacement_in_space(file); });
  fuzz::answer([&] { files::read_points(file); });
  fuzz::answer([&] { files::read_heights(file); });
  fuzz::answer([&] { files::read_tensions(file); });
  fuzz::answer([&] { files::read_adhesion_forces(file); });
  for (const std::string& name : tables) fuzz::answer([&] { files::read_cell(fuzz::folder() / ("damaged-" + name)); });
}

const bool is_added = add({"csv", 5000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::csv_readers
