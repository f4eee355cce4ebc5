#pragma once

#include <span>
#include <string>
#include <vector>

/// The processes that `mpirun` or the like started together; the only file that knows MPI. A build
/// without MPI, and a process that nobody launched, is one rank, and all calls return at once.
namespace penumbra {

/// Ranks wait asleep, so that those that are still measuring have the cores to themselves. All
/// ranks must call the same functions in the same order, but for `abort`.
class Ranks {
 public:
  /// One rank.
  Ranks() = default;

  /// Starts MPI where a launcher started this process.
  /// @throws InputError when it started several and this build has no MPI
  static Ranks launched() { return Ranks(Launched{}); }

  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const { return rank_; }
  int count() const { return count_; }
  bool is_root() const { return rank_ == 0; }
  /// Whether a launcher started this process, be it as the only one.
  bool is_launched() const { return launched_; }

  /// Returns when all ranks have called it.
  void barrier() const;

  /// The root's text.
  std::string from_root(const std::string& text) const;

  /// The texts of all ranks, in their order.
  std::vector<std::string> gather(const std::string& text) const;

  /// At the root, the sums over all ranks of each number; elsewhere `values` are of no use then.
  /// The order of a sum is not fixed: exact where all ranks but one have 0.
  void sum_to_root(std::span<double> values) const;

  /// Ends all ranks. Without MPI it only returns.
  void abort(int exit_code) const;

 private:
  struct Launched {};
  explicit Ranks(Launched);

  int rank_{0};
  int count_{1};
  bool launched_{false};
};

/// The one rank of a process that nobody launched.
const Ranks& single_rank();

}  // namespace penumbra
