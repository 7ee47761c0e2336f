#include "pipeline/report/texts.h"

#include "pipeline/files/texts.h"

namespace mbtfm::report {

extern const std::string_view kTexts;  // texts.txt

std::string text_of(const std::string& name) {
  static const files::Texts texts(kTexts);
  const std::size_t point = name.find('.');
  return texts.at(name.substr(0, point), name.substr(point + 1));
}

}  // namespace mbtfm::report
