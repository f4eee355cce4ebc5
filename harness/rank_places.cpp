#include "harness/rank_places.h"

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <thread>

namespace penumbra {
namespace {

CpuList allowed_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  CpuList cpus;
  if (sched_getaffinity(0, sizeof(set), &set) != 0) return {0};
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<unsigned>(cpu), &set)) cpus.push_back(cpu);
  }
  return cpus;
}

bool bind_to(const CpuList& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : cpus) CPU_SET(static_cast<unsigned>(cpu), &set);
  return sched_setaffinity(0, sizeof(set), &set) == 0;
}

// Binds this rank. @return RankPlace::pinned_by
std::string pin(const CpuList& allowed, const CpuShare& share, bool binds) {
  if (!share.is_own) return {};
  if (share.cpus != allowed) return binds && bind_to(share.cpus) ? "penumbra" : "";
  return allowed.size() < std::thread::hardware_concurrency() ? "launcher" : "";
}

bool overlap(const CpuList& a, const CpuList& b) {
  return std::any_of(a.begin(), a.end(),
                     [&](int cpu) { return std::binary_search(b.begin(), b.end(), cpu); });
}

// Between ranks: "host\n0 1 2 3".
std::string message_of(const std::string& host, const CpuList& cpus) {
  std::string text = host + "\n";
  for (const int cpu : cpus) text += fmt::format("{} ", cpu);
  return text;
}

}  // namespace

std::vector<CpuShare> share_cpus(std::span<const CpuList> allowed) {
  std::vector<CpuShare> shares;
  for (std::size_t r = 0; r < allowed.size(); ++r) {
    const CpuList& cpus = allowed[r];
    std::size_t same = 0, before = 0;
    bool others = false;
    for (std::size_t other = 0; other < allowed.size(); ++other) {
      if (allowed[other] == cpus) {
        ++same;
        before += other < r ? 1 : 0;
      } else {
        others = others || overlap(allowed[other], cpus);
      }
    }
    const std::size_t part = cpus.size() / same;
    if (others || part == 0) {
      shares.push_back({cpus, std::max(1, static_cast<int>(others ? part / 2 : part)), false});
      continue;
    }
    const auto begin = cpus.begin() + static_cast<std::ptrdiff_t>(before * part);
    shares.push_back(
        {CpuList(begin, begin + static_cast<std::ptrdiff_t>(part)), static_cast<int>(part), true});
  }
  return shares;
}

RankPlaces place_ranks(const Ranks& ranks, bool binds) {
  const CpuList own = allowed_cpus();
  std::vector<std::string> hosts;
  std::map<std::string, std::vector<CpuList>> allowed;  // by host, in the order of ranks
  for (const std::string& message : ranks.gather(message_of(host_name(), own))) {
    const std::size_t end = message.find('\n');
    hosts.push_back(message.substr(0, end));
    std::istringstream numbers(message.substr(end + 1));
    CpuList& cpus = allowed[hosts.back()].emplace_back();
    for (int cpu = 0; numbers >> cpu;) cpus.push_back(cpu);
  }
  RankPlaces places;
  std::string own_pin;
  std::vector<std::string> whole;  // what each may use without a pin
  std::map<std::string, std::size_t> next;
  for (std::size_t r = 0; r < hosts.size(); ++r) {
    const std::size_t place = next[hosts[r]]++;
    const CpuShare share = share_cpus(allowed[hosts[r]])[place];
    if (static_cast<int>(r) == ranks.rank()) own_pin = pin(own, share, binds);
    places.ranks.push_back({static_cast<int>(r), hosts[r], to_text(share.cpus), {}});
    whole.push_back(to_text(allowed[hosts[r]][place]));
    places.threads = r == 0 ? share.threads : std::min(places.threads, share.threads);
  }
  const std::vector<std::string> pins = ranks.gather(own_pin);
  for (std::size_t r = 0; r < pins.size(); ++r) {
    places.ranks[r].pinned_by = pins[r];
    if (pins[r].empty()) places.ranks[r].cpus = whole[r];
  }
  return places;
}

std::string to_text(const CpuList& cpus) {
  std::string text;
  for (std::size_t i = 0; i < cpus.size();) {
    std::size_t last = i;
    while (last + 1 < cpus.size() && cpus[last + 1] == cpus[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", cpus[i]);
    if (last > i) text += fmt::format("-{}", cpus[last]);
    i = last + 1;
  }
  return text;
}

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace penumbra
