# cmake -DOUT=FILE.cpp -DNAMESPACE=a::b "-DFILES=name=path;name=path…" -P embed.cmake: text files as C++ string literals,
# `extern const std::string_view name` each.
set(source "#include <string_view>\n\nnamespace ${NAMESPACE} {\n")
foreach(entry ${FILES})
  string(REGEX MATCH "^([^=]+)=(.*)$" _ "${entry}")
  set(name ${CMAKE_MATCH_1})
  file(READ "${CMAKE_MATCH_2}" text)
  string(APPEND source "extern const std::string_view ${name};\nconst std::string_view ${name} = R\"embedded(${text})embedded\";\n")
endforeach()
file(WRITE ${OUT} "${source}}  // namespace ${NAMESPACE}\n")
