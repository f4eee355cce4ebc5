#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

/// Sizes and scenes of the microbenchmarks; configs/README.md explains every key.
namespace penumbra::micro {

struct MicroConfig {
  std::filesystem::path file;
  std::string hash;  ///< of the document's values: comments and blanks do not count

  std::uint64_t seed{7};
  std::vector<std::string> scenes{"checkerboard"};

  std::vector<int> populations{4, 16, 64, 256, 1024, 4096};
  std::vector<int> components{3, 6, 18, 66, 258, 1026};
  int fixed_components{6};
  int fixed_population{256};

  std::vector<int> alsd_lights{2, 8, 32, 128, 512, 1024};
  int alsd_srl{4};

  std::vector<int> tree_samples{8, 32, 128, 512, 2048};
  std::vector<int> point_counts{4, 16, 64, 256};
  std::vector<int> mesh_levels{2, 32};
  std::vector<float> alphas{0.1f, 0.4f};
  std::vector<int> rays_per_batch{16, 64};

  std::vector<int> estimate_srl{16, 64};
  int check_spp{8};

  std::vector<int> shares_srl{16, 64};
  int shares_rounds{15};
};

/// Reads and checks a config.
/// @throws InputError with all faults at once, each with its place
MicroConfig load_micro_config(const std::filesystem::path& file);

/// configs/micro.json of the project.
/// @throws InputError when the project is not found
std::filesystem::path default_micro_config();

}  // namespace penumbra::micro
