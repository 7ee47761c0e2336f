# Debian's CMake configuration of libzip demands tools of another package (zipcmp): find the library itself.
find_library(ZIP_LIBRARY zip REQUIRED)
find_path(ZIP_INCLUDE zip.h REQUIRED)
add_library(mbtfm_zip INTERFACE)
target_include_directories(mbtfm_zip SYSTEM INTERFACE ${ZIP_INCLUDE})
target_link_libraries(mbtfm_zip INTERFACE ${ZIP_LIBRARY})
