// SPDX-License-Identifier: Apache-2.0
#include <linux/can.h>
#include <spdlog/fmt/fmt.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

#include "daemon/check/checks.h"
#include "daemon/output/message_sink.h"
#include "drivers/can/wheel_reader.h"

namespace farpoint::daemon {
namespace {

bool kernel_has_can() {
  const int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

void check_wheels(const CanConfig& can, bool is_used, Findings* findings) {
  const std::string what = "wheel speeds";
  if (can.wheels_dbc == "none" || can.wheel_signals == "none") return;
  try {
    const drivers::WheelReader reader(can.wheels_dbc, can.wheel_signals);
    if (!is_used) return findings->warn(what, "not read: no bus is in use (can.enabled, --can)");
    findings->ok(what, fmt::format("{}: {}", can.wheels_dbc, can.wheel_signals));
  } catch (const std::runtime_error& error) {
    findings->fail(what, error.what());
  }
}

std::string described(const drivers::LinkInfo& link) {
  const std::string rate = link.bitrate > 0    ? fmt::format("{} bit/s", link.bitrate)
                           : link.kind.empty() ? "no bit rate that the kernel tells"
                                               : "a bus of kind " + link.kind + " without a bit rate";
  return fmt::format("up, {}, queue {} for {} frames", rate, link.queue, link.txqueuelen);
}

}  // namespace

void check_network(const Options& options, const Config& config, Findings* findings) {
  const std::string what = "LCM";
  if (!options.lcm_url && !config.lcm.enabled) return findings->ok(what, "off (lcm.enabled)");
  const std::string url = options.lcm_url.value_or("").empty() ? config.lcm.url : *options.lcm_url;
  if (const std::string problem = lcm_url_problem(url); !problem.empty())
    return findings->fail(what, fmt::format("lcm.url: '{}', {}", url, problem));
  if (!ipc::has_route(url))
    return findings->warn(what, url +
                                    ": no route to the multicast group, expected one (for this computer "
                                    "alone: ip route add 239.255.76.67/32 dev lo)");
  findings->ok(what, url);
}

void judge_link(const std::string& interface, const std::optional<drivers::LinkInfo>& link,
                const ipc::CanLayout& layout, Findings* findings) {
  const std::string what = "CAN";
  const auto fail = [&](const std::string& sentence) { findings->fail(what, interface + ": " + sentence); };
  if (!link) return fail("no such interface, expected one (ip link show type can)");
  if (!link->is_can) return fail("no CAN interface, expected one (ip link show type can)");
  if (link->kind == "can" && link->bitrate == 0)
    return fail("no bit rate is set, expected the bus's own (ip link set " + interface +
                " type can bitrate 500000)");
  if (!link->is_up) return fail("down, expected up (ip link set " + interface + " up)");
  if (layout.fd && link->mtu != CANFD_MTU)
    return fail("no CAN FD, which can.fd asks for (ip link set " + interface + " type can ... fd on)");
  if (const std::string problem = drivers::queue_problem(*link, layout.most_frames()); !problem.empty())
    return findings->warn(what, interface + ": " + problem);
  findings->ok(what, interface + ": " + described(*link));
}

void check_bus(const Options& options, const Config& config, Findings* findings) {
  const CanConfig& can = config.can;
  const bool is_used = options.can_interface || can.enabled;
  check_wheels(can, is_used, findings);
  if (!is_used) return findings->ok("CAN", "off (can.enabled)");
  const std::string interface =
      options.can_interface.value_or("").empty() ? can.interface : *options.can_interface;
  if (!kernel_has_can())
    return findings->fail("CAN", interface + ": this kernel has no CAN, expected modules can and can_raw");
  judge_link(interface, drivers::read_link(interface), can_layout(can), findings);
}

}  // namespace farpoint::daemon
