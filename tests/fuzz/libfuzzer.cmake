# The mutating fuzzer, and a short run of it per target as a test.
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  message(FATAL_ERROR "PENUMBRA_FUZZ needs Clang, for libFuzzer; found ${CMAKE_CXX_COMPILER_ID}")
endif()

add_executable(penumbra_fuzz fuzz/libfuzzer_main.cpp)
target_link_libraries(penumbra_fuzz PRIVATE penumbra_fuzz_targets)
target_link_options(penumbra_fuzz PRIVATE -fsanitize=fuzzer)

# Half a minute in all. The first folder takes what is found to lead further.
foreach(target scene config obj ply gltf image exr rows plan manifest)
  set(found ${CMAKE_BINARY_DIR}/fuzz/${target})
  file(MAKE_DIRECTORY ${found})
  add_test(NAME Fuzz.${target}SurvivesThreeSecondsOfMutations
    COMMAND penumbra_fuzz --target=${target} -seed=1 -max_total_time=3 -detect_leaks=0 -timeout=20 -rss_limit_mb=2560
            -artifact_prefix=${found}- ${found} ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/${target})
  set_tests_properties(Fuzz.${target}SurvivesThreeSecondsOfMutations PROPERTIES
    LABELS fuzz TIMEOUT 120 ENVIRONMENT "ASAN_OPTIONS=detect_leaks=0:new_delete_type_mismatch=0")
endforeach()
