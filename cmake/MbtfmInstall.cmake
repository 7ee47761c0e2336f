# What an installation has beside the programs, each of which installs itself (mbtfm_executable). Nothing in it looks into the
# source tree, and all is found relative to bin/: an installation may be moved.
#
#   bin/  lib/mbtfm/ (what deal.II is seen by)  share/mbtfm/ (scenarios, Snakefile, profiles)  share/doc/mbtfm/
#   share/man/man1/  share/bash-completion/  share/zsh/  share/fish/
#   and for programs that use the libraries: LIBDIR/mbtfm/*.a  LIBDIR/cmake/mbtfm/  LIBDIR/pkgconfig/mbtfm.pc  include/mbtfm/

# Manual pages and completions are what the programs say of themselves.
get_property(programs GLOBAL PROPERTY MBTFM_PROGRAMS)
set(share ${CMAKE_BINARY_DIR}/share)
set(commands "")
foreach(program ${programs})
  list(APPEND commands COMMAND ${program} --manuals ${share})
endforeach()
add_custom_command(OUTPUT ${share}/manuals.stamp ${commands} COMMAND ${CMAKE_COMMAND} -E touch ${share}/manuals.stamp
  DEPENDS ${programs} COMMENT "manual pages and completions" VERBATIM)
add_custom_target(manuals ALL DEPENDS ${share}/manuals.stamp)
install(DIRECTORY ${share}/man ${share}/bash-completion ${share}/zsh ${share}/fish DESTINATION ${CMAKE_INSTALL_DATADIR})

install(DIRECTORY samples/scenarios pipeline/profiles pipeline/fiji DESTINATION ${CMAKE_INSTALL_DATADIR}/mbtfm
  USE_SOURCE_PERMISSIONS)
install(FILES pipeline/Snakefile DESTINATION ${CMAKE_INSTALL_DATADIR}/mbtfm)

# The pages, and what they link to, at the same places as in the source tree.
install(FILES README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES python/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/python)
install(FILES samples/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/samples)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs FILES_MATCHING
  PATTERN *.md PATTERN *.R PATTERN *.json PATTERN *.svg PATTERN *.png PATTERN *.jpg PATTERN *.csv)
file(GLOB_RECURSE pages RELATIVE ${CMAKE_SOURCE_DIR} docs/*.md)
set(linked "")
foreach(page README.md CHANGELOG.md CONTRIBUTING.md python/README.md samples/README.md ${pages})
  get_filename_component(folder ${page} DIRECTORY)
  file(READ ${page} text)
  string(REPLACE "](" "<link>" text "${text}")
  string(REGEX REPLACE "[][;]" "" text "${text}")  # which mean something in CMake's lists
  string(REGEX MATCHALL "<link>[^)#: ]+[)#]" links "${text}")
  foreach(link ${links})
    string(REGEX REPLACE "<link>([^)#: ]+)[)#]" "\\1" link "${link}")
    get_filename_component(file ${CMAKE_SOURCE_DIR}/${folder}/${link} ABSOLUTE)
    file(RELATIVE_PATH file ${CMAKE_SOURCE_DIR} ${file})
    if(NOT file MATCHES "^docs/|[.]md$" AND EXISTS ${CMAKE_SOURCE_DIR}/${file})
      list(APPEND linked ${file})
    endif()
  endforeach()
endforeach()
list(REMOVE_DUPLICATES linked)
foreach(file ${linked})
  get_filename_component(folder ${file} DIRECTORY)
  install(FILES ${file} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
endforeach()

# The libraries that are interfaces: the contract and its files, gels, cables; and what these are made of.
set(interfaces
  substrate_choice substrate_elements substrate_surface substrate_greens substrate
  network_cables network_mesh network
  pipeline_charts pipeline_stage pipeline_numerics pipeline_files pipeline_contract)
set(archives ${CMAKE_INSTALL_LIBDIR}/mbtfm)
install(TARGETS mbtfm_options ${interfaces} EXPORT mbtfm ARCHIVE DESTINATION ${archives} COMPONENT Development)
install(EXPORT mbtfm NAMESPACE mbtfm:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mbtfm FILE mbtfm-targets.cmake
  COMPONENT Development)
include(CMakePackageConfigHelpers)
configure_package_config_file(cmake/mbtfm-config.cmake.in ${CMAKE_BINARY_DIR}/generated/mbtfm-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mbtfm NO_SET_AND_CHECK_MACRO NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/generated/mbtfm-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/generated/mbtfm-config.cmake ${CMAKE_BINARY_DIR}/generated/mbtfm-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mbtfm COMPONENT Development)

set(MBTFM_PC_LIBRARIES "")
foreach(library ${interfaces})
  get_target_property(type ${library} TYPE)
  if(type STREQUAL STATIC_LIBRARY)
    string(APPEND MBTFM_PC_LIBRARIES " -l${library}")
  endif()
  string(REPLACE _ / folder ${library})
  file(GLOB headers ${folder}/*.h)  # those of its subfolders are other libraries'
  install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mbtfm/${folder} COMPONENT Development)
endforeach()
set(MBTFM_PC_THIRD_PARTY "")
foreach(library IOXML IOXMLParser IOCore CommonExecutionModel CommonDataModel CommonMisc CommonSystem CommonTransforms CommonMath CommonCore)
  if(TARGET VTK::${library})  # which have no pkg-config of their own
    get_target_property(configurations VTK::${library} IMPORTED_CONFIGURATIONS)
    list(GET configurations 0 configuration)
    get_target_property(file VTK::${library} IMPORTED_LOCATION_${configuration})
    get_filename_component(file ${file} NAME)
    string(REGEX REPLACE "^lib(.*)[.]so.*" "-l\\1" file ${file})
    string(APPEND MBTFM_PC_THIRD_PARTY " ${file}")
  endif()
endforeach()
file(RELATIVE_PATH MBTFM_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/mbtfm.pc.in ${CMAKE_BINARY_DIR}/generated/mbtfm.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/generated/mbtfm.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT Development)
