#include "scenes/core/module.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "scenes/core/error.h"

namespace penumbra {
namespace {

std::filesystem::path module_file(const std::string& name) {
  const std::string file = "penumbra_" + name + ".so";
  if (const char* given = std::getenv("PENUMBRA_MODULES"); given != nullptr && *given != '\0') {
    return std::filesystem::path(given) / file;
  }
  std::error_code ignored;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  return program.parent_path().parent_path() / "lib" / file;
}

}  // namespace

void* open_module(const std::string& name, const char* entry) {
  const std::filesystem::path file = module_file(name);
  void* const module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const symbol = module != nullptr ? dlsym(module, entry) : nullptr;
  if (symbol == nullptr) {
    const char* const why = dlerror();
    throw RunError("module " + file.string() +
                   " can not be opened: " + (why != nullptr ? why : "unknown reason") +
                   "; PENUMBRA_MODULES names the folder of the modules");
  }
  return symbol;
}

bool module_is_open(const std::string& name) {
  void* const module = dlopen(module_file(name).c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (module != nullptr) dlclose(module);
  return module != nullptr;
}

}  // namespace penumbra
