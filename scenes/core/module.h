#pragma once

#include <string>

/// Parts of the program that are opened only when a scene needs them.
namespace penumbra {

/// Opens `penumbra_<name>.so` and finds its entry point. Modules lie in PENUMBRA_MODULES, else in
/// ../lib seen from the executable; they stay open until the program ends.
/// @param entry  name of an extern "C" symbol
/// @throws RunError naming the file and the dynamic linker's message
void* open_module(const std::string& name, const char* entry);

/// Whether the module has been opened by this process.
bool module_is_open(const std::string& name);

}  // namespace penumbra
