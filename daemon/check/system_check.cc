// SPDX-License-Identifier: Apache-2.0
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <fstream>
#include <set>

#include "daemon/check/checks.h"
#include "daemon/system/realtime.h"

namespace farpoint::daemon {
namespace {

constexpr int kHighestPriority = 99;
// Bits of CapEff in /proc/self/status (linux/capability.h).
constexpr int kCapIpcLock = 14, kCapSysNice = 23;

std::uint64_t effective_capabilities() {
  std::ifstream status("/proc/self/status");
  std::uint64_t bits = 0;
  for (std::string word; status >> word;)
    if (word == "CapEff:") status >> std::hex >> bits >> std::dec;
  return bits;
}

rlim_t limit_of(__rlimit_resource resource) {
  rlimit limit{};
  return getrlimit(resource, &limit) == 0 ? limit.rlim_cur : 0;
}

// The sentence's verdict: what the start refuses with realtime.require is an error.
struct Judged {
  const RealtimeConfig& config;
  Findings* findings;

  void lacks(const std::string& what, const std::string& sentence) const {
    if (config.require)
      findings->fail(what, sentence + " (realtime.require is set)");
    else
      findings->warn(what, sentence);
  }
};

std::array<std::pair<const char*, ThreadConfig>, 4> threads_of(const RealtimeConfig& config) {
  return {{{"capture", config.capture},
           {"tracking", config.tracking},
           {"output", config.output},
           {"mapping", config.mapping}}};
}

void check_priorities(const RealtimeConfig& wanted, int most_priority, const Judged& judged) {
  const std::string what = "real-time priority";
  int highest = 0;
  for (const auto& [name, thread] : threads_of(wanted)) highest = std::max(highest, thread.priority);
  if (highest <= 0) return judged.findings->ok(what, "none is asked for (realtime.profile)");
  if (most_priority < highest)
    return judged.lacks(what, fmt::format("this account may use {} at most, expected {}: LimitRTPRIO= in the "
                                          "unit, rtprio in /etc/security/limits.d, or CAP_SYS_NICE",
                                          most_priority, highest));
  judged.findings->ok(what, fmt::format("{} is allowed", highest));
}

void check_cores(const RealtimeConfig& wanted, const std::vector<Core>& cores, const Judged& judged) {
  const std::string what = "cores";
  std::set<int> missing;
  for (const auto& [name, thread] : threads_of(wanted)) {
    const auto is_it = [core = thread.core](const Core& c) { return c.number == core; };
    if (thread.core >= 0 && std::none_of(cores.begin(), cores.end(), is_it)) missing.insert(thread.core);
  }
  if (!missing.empty())
    return judged.lacks(what, fmt::format("this process may not use core {}, expected one of its {}",
                                          fmt::join(missing, ", "), cores.size()));
  judged.findings->ok(what, fmt::format("{} usable", cores.size()));
}

void check_locked_memory(const RealtimeConfig& config, std::uint64_t most_bytes, const Judged& judged) {
  const std::string what = "locked memory";
  constexpr std::uint64_t kMega = 1'000'000, kEnough = 2000 * kMega;  // MemoryMax= of the unit
  if (!config.lock_memory) return judged.findings->ok(what, "not asked for (realtime.lock_memory)");
  if (most_bytes == Privileges::kUnlimited) return judged.findings->ok(what, "without a limit");
  if (most_bytes >= kEnough) return judged.findings->ok(what, fmt::format("up to {} MB", most_bytes / kMega));
  judged.lacks(what,
               fmt::format("this account may lock {} MB, expected no limit: LimitMEMLOCK=infinity in the "
                           "unit, memlock in /etc/security/limits.d, or CAP_IPC_LOCK",
                           most_bytes / kMega));
}

// The start's own refusals, which it would throw with realtime.require.
void check_governors(const RealtimeConfig& config, const std::string& root, const Judged& judged) {
  RealtimeConfig patient = config;
  patient.require = false;
  RealtimeReport report(patient);
  report.check_governors(root);
  for (const std::string& refused : report.refused()) judged.lacks("processor frequency", refused);
}

}  // namespace

Privileges read_privileges() {
  const std::uint64_t capabilities = effective_capabilities();
  const auto has = [capabilities](int bit) { return (capabilities >> bit & 1U) != 0; };
  Privileges p;
  const rlim_t priority = limit_of(RLIMIT_RTPRIO), locked = limit_of(RLIMIT_MEMLOCK);
  p.most_priority =
      has(kCapSysNice) ? kHighestPriority : static_cast<int>(std::min<rlim_t>(priority, kHighestPriority));
  p.most_locked_bytes = has(kCapIpcLock) || locked == RLIM_INFINITY ? Privileges::kUnlimited : locked;
  p.may_hold_latency = access("/dev/cpu_dma_latency", W_OK) == 0;
  return p;
}

void check_privileges(const RealtimeConfig& config, const Privileges& privileges,
                      const std::vector<Core>& cores, const std::string& root, Findings* findings) {
  const Judged judged{config, findings};
  const RealtimeConfig wanted = resolved(config, cores);
  check_priorities(wanted, privileges.most_priority, judged);
  check_cores(wanted, cores, judged);
  check_locked_memory(config, privileges.most_locked_bytes, judged);
  if (config.cpu_latency_us >= 0 && !privileges.may_hold_latency)
    judged.lacks("processor sleep",
                 "/dev/cpu_dma_latency cannot be written, expected the package's udev rule and an account of "
                 "group farpoint");
  check_governors(config, root, judged);
}

Clocks read_clocks() {
  Clocks clocks;
  timex state{};
  clocks.is_synchronised = adjtimex(&state) >= 0 && (state.status & STA_UNSYNC) == 0;
  timespec resolution{};
  if (clock_getres(CLOCK_MONOTONIC, &resolution) == 0)
    clocks.resolution_ns = std::int64_t{resolution.tv_sec} * 1'000'000'000 + resolution.tv_nsec;
  std::ifstream("/sys/devices/system/clocksource/clocksource0/current_clocksource") >> clocks.source;
  return clocks;
}

void check_clocks(const Clocks& clocks, Findings* findings) {
  constexpr std::int64_t kCoarsest_ns = 100'000;  // a tenth of what a frame's time needs
  const std::string source = clocks.source.empty() ? "an unknown source" : clocks.source;
  const std::string text = fmt::format("CLOCK_MONOTONIC by {}, steps of {} ns", source, clocks.resolution_ns);
  if (clocks.resolution_ns > kCoarsest_ns)
    findings->warn("clock of images", text + ", expected at most 100 us");
  else
    findings->ok("clock of images", text);
  if (clocks.is_synchronised) return findings->ok("system clock", "synchronised");
  findings->warn("system clock",
                 "not synchronised, expected NTP or PTP: times of log lines and files may be wrong, times of "
                 "images and poses are not by it");
}

}  // namespace farpoint::daemon
