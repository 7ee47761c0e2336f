# mbtfm_library(NAME [HOT|WORDS] sources… [PUBLIC libs…] [PRIVATE libs…]) and mbtfm_executable(NAME sources… [PRIVATE libs…]):
# a target with the project's include root and warnings. Sources are compiled with -O2; with -O3 those where a profile shows the
# programs' time (HOT); with -O1 those that write words, tables and pages (WORDS), most of whose time is the compiler's.

add_library(mbtfm_options INTERFACE)
target_compile_features(mbtfm_options INTERFACE cxx_std_20)
target_include_directories(mbtfm_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/mbtfm>)
# -Wno-restrict: GCC 12 sees overlapping copies in std::string concatenation that are not there (GCC PR 105651).
# The compiler's own memory is not tidied below 500 MB, which takes a sixteenth of its time.
target_compile_options(mbtfm_options INTERFACE
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wshadow;$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;--param=ggc-min-heapsize=500000>;$<$<BOOL:${MBTFM_STRICT}>:-Werror>>")

# Optimise a target at this level, and share what most sources include, which is read once for each level.
option(MBTFM_PRECOMPILED "sources share precompiled headers" ON)
function(mbtfm_optimise target level)
  if(NOT level EQUAL 2)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O${level}>)
  endif()
  # GCC takes the options of a precompiled header for its own in functions with a target attribute: HOT sources have none.
  if(NOT MBTFM_PRECOMPILED OR level EQUAL 3)
    return()
  endif()
  if(NOT TARGET mbtfm_headers_O${level})
    set(nothing ${CMAKE_BINARY_DIR}/generated/headers_O${level}.cpp)
    if(NOT EXISTS ${nothing})
      file(WRITE ${nothing} "")
    endif()
    add_library(mbtfm_headers_O${level} OBJECT ${nothing})
    target_link_libraries(mbtfm_headers_O${level} PRIVATE mbtfm_options Eigen3::Eigen)
    target_compile_options(mbtfm_headers_O${level} PRIVATE $<$<CONFIG:Release>:-O${level}>)
    target_precompile_headers(mbtfm_headers_O${level} PRIVATE
      <Eigen/Core> <algorithm> <array> <cmath> <filesystem> <fstream> <functional> <map> <memory> <optional> <set>
      <sstream> <string> <vector>)
  endif()
  target_precompile_headers(${target} REUSE_FROM mbtfm_headers_O${level})
endfunction()

# mbtfm_embed(OUT NAMESPACE NAME=FILE...): text files as `extern const std::string_view NAME` each, in the source OUT
function(mbtfm_embed out namespace)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/embedded_texts.cpp)
  list(TRANSFORM ARGN REPLACE "=" "=${CMAKE_CURRENT_SOURCE_DIR}/" OUTPUT_VARIABLE entries)
  list(TRANSFORM ARGN REPLACE "^.*=" "" OUTPUT_VARIABLE files)
  add_custom_command(OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} -DOUT=${source} -DNAMESPACE=${namespace} "-DFILES=${entries}"
            -P ${CMAKE_SOURCE_DIR}/cmake/embed.cmake
    DEPENDS ${CMAKE_SOURCE_DIR}/cmake/embed.cmake ${files}
    VERBATIM)
  set(${out} ${source} PARENT_SCOPE)
endfunction()

function(mbtfm_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "HOT;WORDS" "" "PUBLIC;PRIVATE")
  if(NOT arg_UNPARSED_ARGUMENTS)  # headers alone
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE mbtfm_options ${arg_PUBLIC})
    return()
  endif()
  add_library(${name} STATIC ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PUBLIC mbtfm_options ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  if(arg_HOT)
    mbtfm_optimise(${name} 3)
  elseif(arg_WORDS)
    mbtfm_optimise(${name} 1)
  else()
    mbtfm_optimise(${name} 2)
  endif()
endfunction()

# All programs, without the tests.
add_custom_target(executables)

function(mbtfm_executable name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "PRIVATE")
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE mbtfm_options ${arg_PRIVATE})
  mbtfm_optimise(${name} 1)
  add_dependencies(executables ${name})
  set_property(GLOBAL APPEND PROPERTY MBTFM_PROGRAMS ${name})
  install(TARGETS ${name} RUNTIME)
endfunction()
