# mbtfm_library(NAME sources… [PUBLIC libs…] [PRIVATE libs…]) and mbtfm_executable(NAME sources… [PRIVATE libs…]):
# a target with the project's include root and warnings.

add_library(mbtfm_options INTERFACE)
target_compile_features(mbtfm_options INTERFACE cxx_std_20)
target_include_directories(mbtfm_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/mbtfm>)
# -Wno-restrict: GCC 12 sees overlapping copies in std::string concatenation that are not there (GCC PR 105651)
target_compile_options(mbtfm_options INTERFACE
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wshadow;$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>;$<$<BOOL:${MBTFM_STRICT}>:-Werror>>")

# mbtfm_words(targets…): they write words, tables and pages. Most of their time is the compiler's.
function(mbtfm_words)
  foreach(target ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endforeach()
endfunction()

function(mbtfm_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "PUBLIC;PRIVATE")
  if(NOT arg_UNPARSED_ARGUMENTS)  # headers alone
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE mbtfm_options ${arg_PUBLIC})
    return()
  endif()
  add_library(${name} STATIC ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PUBLIC mbtfm_options ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
endfunction()

# All programs, without the tests.
add_custom_target(executables)

function(mbtfm_executable name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "PRIVATE")
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE mbtfm_options ${arg_PRIVATE})
  mbtfm_words(${name})
  add_dependencies(executables ${name})
  set_property(GLOBAL APPEND PROPERTY MBTFM_PROGRAMS ${name})
  install(TARGETS ${name} RUNTIME)
endfunction()
