// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/outputs.h"

#include <spdlog/spdlog.h>

#include "daemon/system/boot_counter.h"
#include "drivers/can/link_info.h"

namespace farpoint::daemon {

Outputs::Outputs(const Options& options, const Config& config, Use use, std::int32_t boot_counter)
    : options_(options), use_(use), boot_counter_(boot_counter) {
  if (use == Use::kLive) count_start(config);
  try {
    open_files(config);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  open_network(config);
  open_bus(config);
}

void Outputs::count_start(const Config& config) {
  const BootCounter counter = next_boot_counter(state_folder(config.state.folder));
  boot_counter_ = counter.value;
  const auto level = config.state.folder == "auto" ? spdlog::level::info : spdlog::level::warn;
  if (!counter.problem.empty())
    spdlog::log(level, "boot counter {}: a random number, since {}", boot_counter_, counter.problem);
  else
    spdlog::info("boot counter {}", boot_counter_);
}

std::vector<PoseSink*> Outputs::sinks() {
  std::vector<PoseSink*> all;
  if (bus_) all.push_back(bus_.get());
  if (replay_) all.push_back(replay_.get());
  if (live_) all.push_back(live_.get());
  return all;
}

OutputCounts Outputs::counts() const {
  OutputCounts counts;
  counts.can_send_errors = (bus_ ? bus_->errors() : 0) + (replay_ ? replay_->errors() : 0);
  counts.can_received = wheels_ != nullptr ? wheels_->received() : 0;
  if (!bus_) return counts;
  counts.can_bus_offs = static_cast<std::int64_t>(bus_->bus_counts().bus_off);
  counts.can_state = static_cast<std::int8_t>(bus_->bus_state());
  return counts;
}

void Outputs::tick(double now_s) {
  if (bus_) bus_->tick(now_s);
  if (wheels_ == nullptr) return;
  while (const wheels_t* wheels = wheels_->front()) {
    publisher_.publish(ipc::kWheelsChannel, wheels->utime, *wheels);
    wheels_->pop();
  }
}

void Outputs::set_body_is_camera(bool is_camera) {
  if (bus_) bus_->set_body_is_camera(is_camera);
  if (replay_) replay_->set_body_is_camera(is_camera);
}

void Outputs::write_logs() {
  if (bus_) bus_->write_log();
}

void Outputs::farewell() {
  if (bus_) bus_->farewell();
}

std::vector<std::string> Outputs::close(const RunEnd& end) {
  std::vector<std::string> written;
  farewell();
  if (log_) {
    log_->close();
    written.push_back(options_.output);
  }
  if (!options_.trajectory.empty()) {
    for (auto& path : write_final_trajectories(options_.trajectory, end.trajectories, end.unit_scale)) {
      written.push_back(std::move(path));
    }
  }
  if (live_) {
    live_->close();
    written.push_back(options_.live_trajectory);
  }
  if (bus_) bus_->close();
  if (replay_) replay_->close();
  if (!options_.can_log.empty()) written.push_back(options_.can_log);
  if (publisher_.network_errors() > 0) spdlog::warn("{} messages were not sent", publisher_.network_errors());
  if (counts().can_send_errors > 0) spdlog::warn("{} CAN frames were not sent", counts().can_send_errors);
  return written;
}

void Outputs::open_files(const Config& config) {
  if (!options_.output.empty()) {
    log_ = std::make_unique<ipc::LogWriter>(options_.output);
    publisher_.add(std::make_unique<LogMessageSink>(log_.get()));
  }
  if (!options_.live_trajectory.empty()) live_ = std::make_unique<LiveTrajectory>(options_.live_trajectory);
  if (!options_.can_log.empty()) {
    auto log = std::make_unique<ipc::CandumpWriter>(options_.can_log, bus_name(config), config.can.fd);
    if (use_ == Use::kLive)
      make_bus(config)->log_to(std::move(log));
    else
      make_replay(config)->log_to(std::move(log));
  }
  // Written at the end only: find out now whether that will be possible.
  if (!options_.trajectory.empty()) ipc::ReplacedPath probe(options_.trajectory);
}

void Outputs::open_network(const Config& config) {
  const bool live = use_ == Use::kLive;
  if (!options_.lcm_url && !(live && config.lcm.enabled)) return;
  const std::string url = options_.lcm_url.value_or("").empty() ? config.lcm.url : *options_.lcm_url;
  try {
    publisher_.add(std::make_unique<LcmMessageSink>(url));
  } catch (const std::runtime_error& error) {
    if (live) throw;
    spdlog::warn("{}; replay goes on without the network", error.what());
  }
}

void Outputs::open_bus(const Config& config) {
  const bool live = use_ == Use::kLive;
  if (!options_.can_interface && !(live && config.can.enabled)) return;
  const ipc::CanLayout layout = can_layout(config.can);
  drivers::CanOptions options;
  options.fd = layout.fd;
  options.wait_for_interface = live;
  options.extended_ids = layout.extended;
  for (std::size_t i = 0; i < (layout.fd ? 1 : ipc::kCanMessages); ++i)
    options.sent_ids.push_back(layout.id(static_cast<ipc::CanMessage>(i)));
  // Lockstep never waits for the bus.
  const bool steady = live || options_.speed;
  options.confirm = steady;
  const std::string name = bus_name(config);
  try {
    auto bus = std::make_unique<drivers::SocketCan>(name, options);
    if (*bus->waits_for() != '\0')
      spdlog::warn("CAN interface {}: {}; looking for it", name, bus->waits_for());
    else if (const auto link = drivers::read_link(name))
      if (const std::string problem = drivers::queue_problem(*link, layout.most_frames()); !problem.empty())
        spdlog::warn("CAN interface {}: {}", name, problem);
    if (steady)
      make_bus(config)->send_on(std::move(bus));
    else
      make_replay(config)->send_on(std::move(bus));
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}; the run goes on without the bus", error.what());
  }
}

EpochOptions Outputs::epoch_options(const Config& config) const {
  EpochOptions options;
  options.pose_frame = config.can.frame;
  options.boot_counter = boot_counter_on_can(boot_counter_);
  if (use_ == Use::kLive && config.camera.rate_hz > 0.0) options.frame_period_s = 1.0 / config.camera.rate_hz;
  return options;
}

CanBus* Outputs::make_bus(const Config& config) {
  if (!bus_) bus_ = std::make_unique<CanBus>(can_layout(config.can), epoch_options(config));
  return bus_.get();
}

CanReplay* Outputs::make_replay(const Config& config) {
  if (!replay_) replay_ = std::make_unique<CanReplay>(can_layout(config.can), epoch_options(config));
  return replay_.get();
}

std::string Outputs::bus_name(const Config& config) const {
  const bool named = options_.can_interface && !options_.can_interface->empty();
  return named ? *options_.can_interface : config.can.interface;
}

}  // namespace farpoint::daemon
