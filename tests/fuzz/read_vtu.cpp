/// Networks in VTK files.
#include "pipeline/files/vtk_files.h"
#include "tests/fuzz/target.h"
#include "tests/support/fake_tables.h"
#include "tests/support/vtu_variants.h"

namespace mbtfm::fuzz::vtu_readers {
namespace {

std::vector<std::string> samples() {
  const Network network = test::small_network();
  put("whole.vtu", "");
  files::write_network(folder() / "whole.vtu", network);
  std::vector<std::string> texts = {bytes_of(folder() / "whole.vtu")};
  for (const test::VtuVariant& variant : test::vtu_variants()) texts.push_back(test::stored_as(texts.front(), variant));
  files::write_contracted_network(folder() / "whole.vtu", network, network.vertices_um,
                                  std::vector<double>(network.links.size(), 0.25),
                                  std::vector<CableState>(network.links.size(), CableState::taut));
  texts.push_back(bytes_of(folder() / "whole.vtu"));
  return texts;
}

void read(std::string_view bytes) {
  const auto file = fuzz::put("input.vtu", bytes);
  fuzz::answer([&] { files::read_network(file); });
  fuzz::answer([&] { files::read_contracted_network(file); });
}

const bool is_added = add({"vtu", 20000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::vtu_readers
