# CHOLMOD has no CMake configuration in Debian. A benchmark compares with it.
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
find_path(CHOLMOD_INCLUDE cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
add_library(mbtfm_cholmod INTERFACE)
target_include_directories(mbtfm_cholmod SYSTEM INTERFACE ${CHOLMOD_INCLUDE})
target_link_libraries(mbtfm_cholmod INTERFACE ${CHOLMOD_LIBRARY})
