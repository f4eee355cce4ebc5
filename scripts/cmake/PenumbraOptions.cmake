# Compile options of the project's own targets, as the interface library penumbra_options.
add_library(penumbra_options INTERFACE)
target_include_directories(penumbra_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(penumbra_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion
  $<$<BOOL:${PENUMBRA_WERROR}>:-Werror>
  # Neither changes a result: errno of sqrt and the like is not read, floating-point traps are off.
  -fno-math-errno -fno-trapping-math
  $<$<CONFIG:Release>:-O3>)

# GCC 12 sees overlapping copies in std::string where there are none (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(penumbra_options INTERFACE -Wno-restrict)
endif()

if(PENUMBRA_ARCH)
  target_compile_options(penumbra_options INTERFACE -march=${PENUMBRA_ARCH})
endif()
if(PENUMBRA_SANITIZE)
  target_compile_options(penumbra_options INTERFACE
    -fsanitize=${PENUMBRA_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(penumbra_options INTERFACE -fsanitize=${PENUMBRA_SANITIZE})
endif()

# penumbra_hot(<targets>): the libraries of the sampling loop, whose small functions are inlined into each other across
# files. The rest of the program is left out, because that would only lengthen every link.
include(CheckIPOSupported)
check_ipo_supported(RESULT PENUMBRA_IPO LANGUAGES CXX OUTPUT PENUMBRA_IPO_PROBLEM)
function(penumbra_hot)
  if(PENUMBRA_IPO AND CMAKE_BUILD_TYPE STREQUAL "Release" AND NOT PENUMBRA_SANITIZE)
    set_target_properties(${ARGN} PROPERTIES INTERPROCEDURAL_OPTIMIZATION ON)
  endif()
endfunction()
