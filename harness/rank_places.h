#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/mpi_ranks.h"

/// Where ranks run, and how those of one host share its cores.
namespace penumbra {

using CpuList = std::vector<int>;  ///< numbers as the kernel has them, rising

/// What a rank has of its host.
struct CpuShare {
  CpuList cpus;
  int threads{1};
  /// Whether no other rank may use them; otherwise there are too few, or the launcher gave out sets
  /// that overlap in part.
  bool is_own{false};

  friend bool operator==(const CpuShare&, const CpuShare&) = default;
};

/// Shares the cores of one host. Ranks that may run on the same ones get a part each, in their
/// order; ranks that their launcher bound to cores of their own keep them.
/// @param allowed  [rank of the host], not empty
std::vector<CpuShare> share_cpus(std::span<const CpuList> allowed);

/// A rank as environment.json tells of it.
struct RankPlace {
  int rank{0};
  std::string host;
  std::string cpus;       ///< "0-3,8"
  std::string pinned_by;  ///< "launcher", "penumbra"; empty: not pinned
};

struct RankPlaces {
  std::vector<RankPlace> ranks;
  int threads{1};  ///< of each: the fewest that a rank has cores for, so that times are alike
};

/// Tells all ranks where all are. To be called before there are other threads.
/// @param binds  this rank to its share of the host: where the number of threads follows from that
RankPlaces place_ranks(const Ranks& ranks, bool binds);

/// "0-3,8"
std::string to_text(const CpuList& cpus);

/// Of this machine; empty where it has none.
std::string host_name();

}  // namespace penumbra
