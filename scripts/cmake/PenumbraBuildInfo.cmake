# Run with cmake -P at every build: writes build_info.cpp anew only when the commit, its state or the flags changed.
execute_process(COMMAND git -C ${SOURCE_DIR} rev-parse --short=12 HEAD
                OUTPUT_VARIABLE PENUMBRA_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE
                ERROR_QUIET RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  set(PENUMBRA_COMMIT "unknown")
else()
  execute_process(COMMAND git -C ${SOURCE_DIR} status --porcelain --untracked-files=no
                  OUTPUT_VARIABLE changes ERROR_QUIET)
  if(changes)
    string(APPEND PENUMBRA_COMMIT "+dirty")
  endif()
endif()
string(STRIP "${PENUMBRA_FLAGS}" PENUMBRA_FLAGS)
configure_file(${SOURCE_DIR}/harness/build_info.cpp.in ${OUTPUT} @ONLY)
