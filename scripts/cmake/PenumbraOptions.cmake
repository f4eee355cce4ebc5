# Compile options of the project's own targets, as the interface library penumbra_options.
add_library(penumbra_options INTERFACE)
target_include_directories(penumbra_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(penumbra_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion
  $<$<BOOL:${PENUMBRA_WERROR}>:-Werror>
  # Neither changes a result: errno of sqrt and the like is not read, floating-point traps are off.
  -fno-math-errno -fno-trapping-math
  # No fused multiply-add behind the code's back: the same bits with every instruction set.
  -ffp-contract=off
  $<$<CONFIG:Release>:-O3>)

# GCC 12 sees overlapping copies in std::string where there are none (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(penumbra_options INTERFACE -Wno-restrict)
endif()

if(PENUMBRA_ARCH STREQUAL "auto")
  # Eight lanes instead of four where the building machine has them.
  include(CheckCXXSourceRuns)
  check_cxx_source_runs("int main() { return __builtin_cpu_supports(\"avx2\") && __builtin_cpu_supports(\"fma\") &&
    __builtin_cpu_supports(\"bmi2\") ? 0 : 1; }" PENUMBRA_HAS_X86_64_V3)
  if(PENUMBRA_HAS_X86_64_V3)
    set(PENUMBRA_MARCH x86-64-v3)
  else()
    set(PENUMBRA_MARCH "")
  endif()
else()
  set(PENUMBRA_MARCH ${PENUMBRA_ARCH})
endif()
if(PENUMBRA_MARCH)
  target_compile_options(penumbra_options INTERFACE -march=${PENUMBRA_MARCH})
  # GCC 12 takes the undefined registers of its own AVX-512 header, which xxhash uses, for mistakes (GCC bug 105593).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13
     AND NOT PENUMBRA_MARCH MATCHES "^x86-64-v[123]$")
    target_compile_options(penumbra_options INTERFACE -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
endif()
if(PENUMBRA_SANITIZE)
  target_compile_options(penumbra_options INTERFACE
    -fsanitize=${PENUMBRA_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(penumbra_options INTERFACE -fsanitize=${PENUMBRA_SANITIZE})
  # GCC 12 takes instrumented parts of <regex> for reads of uninitialised memory (GCC bug 105562).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(penumbra_options INTERFACE -Wno-maybe-uninitialized)
  endif()
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
