# cmake -DIN=findings.txt -DHEADER=FILE.h -DSOURCE=FILE.cpp -P findings.cmake: the kinds of findings as C++: the enumeration
# Symptom, and the table of kinds_of_findings().
file(READ ${IN} text)
string(REGEX REPLACE "\n#[^\n]*" "" text "\n${text}")
string(REGEX REPLACE "\n +" " " text "${text}")
string(REPLACE "\"" "\\\"" text "${text}")
string(REGEX MATCHALL "\n[a-z_]+ \\(" symptoms "${text}")
string(REGEX REPLACE "\n([a-z_]+) \\(" "  \\1" symptoms "${symptoms}")
string(REPLACE ";" ",\n" symptoms "${symptoms}")

# former identities of a cause after its present one
string(REGEX MATCHALL "\n\\[[a-z-]+\\]|\nformerly: [^\n]+" lines "${text}")
string(REGEX REPLACE "\nformerly: [^\n]+" "" text "${text}")
set(former "")
foreach(line IN LISTS lines)
  if(line MATCHES "formerly: (.+)")
    string(APPEND former "    {\"${id}\", \"${CMAKE_MATCH_1}\"},\n")
  elseif(line MATCHES "[a-z-]+")
    set(id ${CMAKE_MATCH_0})
  endif()
endforeach()

set(severity "note|caution|bad")
string(REGEX REPLACE
  "\n([a-z_]+) \\(([^)]+), (${severity})\\) above ([^\n]+)\nfinding: ([^\n]+)\nnumber: ([^\n]+)\nreason: ([^\n]+)"
  "\n  {\\1, \"\\2\", \\3, \"\\5\", \"\\6\", \\4, \"\\7\"}," text "${text}")
string(REGEX REPLACE
  "\n\\[([a-z-]+)\\]\nmeaning: ([^\n]+)\nremedy: ([^\n]+)((\nfalse: [^\n]+)?)"
  "\n}},\n{\"\\1\", \"\\2\", \"\\3\", \"\"\\4\n, {" text "${text}")
string(REGEX REPLACE "\nfalse: ([^\n]+)" " \"\\1\"" text "${text}")
if(text MATCHES "\n[^\n{},\" ][^\n]*")
  message(FATAL_ERROR "${IN}: not as the head of the file says: ${CMAKE_MATCH_0}")
endif()
string(REGEX REPLACE "^[\n ]*}},\n" "" text "${text}")

file(WRITE ${HEADER} "/// Made of pipeline/contract/findings.txt: the symptoms by which findings are seen, for sources that name one.
#pragma once

#include \"pipeline/contract/findings.h\"

namespace mbtfm {

enum class Symptom : int {
${symptoms}
};

}  // namespace mbtfm
")
file(WRITE ${SOURCE} "#include \"pipeline/contract/kinds_of_findings.h\"

namespace mbtfm {

extern const std::vector<std::pair<const char*, const char*>> kFormerIds;
const std::vector<std::pair<const char*, const char*>> kFormerIds = {
${former}};

const std::vector<KindOfFinding>& kinds_of_findings() {
  using enum Symptom;
  using enum Severity;
  static const std::vector<KindOfFinding> all = {
${text}
  }}};
  return all;
}

}  // namespace mbtfm
")
