# Libraries of the project, all from the distribution's packages (scripts/setup installs them). Their headers are
# system headers to the compiler.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)

# Embree 4 where there is one, otherwise 3; one file of the scene core knows the difference.
find_package(embree 4 CONFIG QUIET)
if(embree_FOUND)
  set(PENUMBRA_EMBREE_MAJOR 4)
else()
  find_package(embree 3 CONFIG REQUIRED)
  set(PENUMBRA_EMBREE_MAJOR 3)
endif()
message(STATUS "Embree ${embree_VERSION}")

find_package(Imath CONFIG REQUIRED)
find_package(OpenEXR CONFIG REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(fmt CONFIG REQUIRED)
find_package(CLI11 CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(pugixml CONFIG REQUIRED)
find_package(Boost REQUIRED COMPONENTS filesystem)
pkg_check_modules(CAIRO REQUIRED IMPORTED_TARGET cairo)
# Debian's CMake config names tools that its package does not have.
pkg_check_modules(OPENIMAGEIO REQUIRED IMPORTED_TARGET OpenImageIO)
pkg_check_modules(ASSIMP REQUIRED IMPORTED_TARGET assimp)
pkg_check_modules(TINYGLTF REQUIRED IMPORTED_TARGET tinygltf)
pkg_check_modules(TINYOBJ REQUIRED IMPORTED_TARGET tinyobjloader_double)

# Header-only packages without a usable config file.
find_path(VALIJSON_INCLUDE_DIR valijson/validator.hpp REQUIRED)
find_path(RANDOM123_INCLUDE_DIR Random123/philox.h REQUIRED)
find_path(XXHASH_INCLUDE_DIR xxhash.h REQUIRED)

# Optional. The deprecated C++ bindings are left out: one file calls the C interface.
if(NOT PENUMBRA_MPI STREQUAL "OFF")
  set(MPI_CXX_SKIP_MPICXX TRUE)
  if(PENUMBRA_MPI STREQUAL "ON")
    find_package(MPI REQUIRED COMPONENTS CXX)
  else()
    find_package(MPI QUIET COMPONENTS CXX)
  endif()
endif()
if(MPI_CXX_FOUND)
  message(STATUS "MPI ${MPI_CXX_VERSION}")
else()
  message(STATUS "MPI: none, runs are not spread over ranks")
endif()
