/// Writes the pages that are made (docs/pages.h) into a folder: pages OUT
#include <filesystem>
#include <iostream>

#include "docs/pages.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/process.h"

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::cerr << "usage: pages OUT\n";
    return 2;
  }
  const std::filesystem::path out = argv[1];
  std::filesystem::create_directories(out);
  for (const char* name : mbtfm::pages::kMade)
    mbtfm::files::write_text(out / name, mbtfm::pages::made_page(name, mbtfm::runner::executable_folder()));
  return 0;
} catch (const std::exception& error) {
  std::cerr << "pages: " << error.what() << "\n";
  return 1;
}
