// The executable of libFuzzer: `penumbra_fuzz --target=NAME [libFuzzer's options] [FOLDER]...`.
// libFuzzer itself leaves options with two dashes alone, and hands them on to its workers.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/fuzz/json_mutator.h"
#include "tests/fuzz/target.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

/// What the functions below share; their signatures are libFuzzer's, which leave no other place.
struct State {
  const penumbra::FuzzTarget* target{nullptr};
  std::vector<std::string> words;
  std::unique_ptr<penumbra::Sandbox> sandbox;
};

State& state() {
  static State value;
  return value;
}

std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kOption = "--target=";
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (!argument.starts_with(kOption)) continue;
    state().target = penumbra::find_fuzz_target(argument.substr(kOption.size()));
  }
  if (state().target == nullptr) {
    std::fprintf(stderr, "expected --target=NAME, one of:");
    for (const penumbra::FuzzTarget& target : penumbra::fuzz_targets()) {
      std::fprintf(stderr, " %s", std::string(target.name).c_str());
    }
    std::fprintf(stderr, "\n");
    std::exit(2);
  }
  if (state().target->words != nullptr) state().words = state().target->words();
  state().sandbox = std::make_unique<penumbra::Sandbox>();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  state().target->read(*state().sandbox, text_of(data, size));
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned int seed) {
  const auto bytes = [&] { return LLVMFuzzerMutate(data, size, max_size); };
  if (state().words.empty() || seed % 4 == 0) return bytes();
  // What follows the document, such as overrides, stays.
  const std::string_view input = text_of(data, size);
  const std::string_view document = penumbra::split_input(input, "--set ").front();
  std::optional<std::string> text = penumbra::mutate_json(document, state().words, seed / 4);
  if (!text) return bytes();
  text->append(input.substr(document.size()));
  if (text->size() > max_size) return bytes();
  std::memcpy(data, text->data(), text->size());
  return text->size();
}
