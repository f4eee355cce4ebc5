# penumbra_embed(<target> <text file> <symbol> <header>): compiles a text file into a std::string_view constant
# penumbra::<symbol>, which <header> declares, so that the program needs no file of its own at run time.
function(penumbra_embed target file symbol header)
  file(READ ${file} PENUMBRA_EMBED_TEXT)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${symbol}.cpp)
  file(CONFIGURE OUTPUT ${output} @ONLY CONTENT
"#include \"${header}\"

namespace penumbra {
const std::string_view ${symbol} = R\"embedded(@PENUMBRA_EMBED_TEXT@)embedded\";
}  // namespace penumbra
")
  target_sources(${target} PRIVATE ${output})
endfunction()
