# Debian's deal.II as one thin target. deal_ii_setup_target would leak its flags into every consumer and list 170
# libraries on each link line.
find_package(deal.II 9.4 REQUIRED QUIET HINTS $ENV{DEAL_II_DIR} /usr)
include(${DEAL_II_TARGET_CONFIG})
find_library(TEUCHOS_CORE trilinos_teuchoscore REQUIRED)
find_library(TEUCHOS_COMM trilinos_teuchoscomm REQUIRED)
find_library(DEALII_MPI mpi PATHS /usr/lib/x86_64-linux-gnu/openmpi/lib /usr/lib/aarch64-linux-gnu/openmpi/lib REQUIRED)
find_package(TBB REQUIRED)
get_target_property(dealii_library deal.ii IMPORTED_LOCATION_DEBUGRELEASE)
add_library(mbtfm_dealii INTERFACE)
target_include_directories(mbtfm_dealii SYSTEM INTERFACE ${DEAL_II_INCLUDE_DIRS})
target_compile_definitions(mbtfm_dealii INTERFACE ${DEAL_II_USER_DEFINITIONS} OMPI_SKIP_MPICXX)
target_link_libraries(mbtfm_dealii INTERFACE ${dealii_library} TBB::tbb ${TEUCHOS_CORE} ${TEUCHOS_COMM} ${DEALII_MPI})
