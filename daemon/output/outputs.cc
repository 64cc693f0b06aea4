#include "daemon/output/outputs.h"

#include <spdlog/spdlog.h>

namespace farpoint::daemon {

Outputs::Outputs(const Options& options, const Config& config, Use use) : options_(options), use_(use) {
  try {
    open_files(config);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  open_network(config);
  open_bus(config);
}

std::vector<PoseSink*> Outputs::sinks() {
  std::vector<PoseSink*> all;
  if (can_) all.push_back(can_.get());
  if (live_) all.push_back(live_.get());
  return all;
}

OutputCounts Outputs::counts() const {
  OutputCounts counts;
  if (!can_) return counts;
  counts.can_send_errors = can_->errors();
  counts.can_bus_offs = static_cast<std::int64_t>(can_->bus_counts().bus_off);
  counts.can_received = static_cast<std::int64_t>(can_->bus_counts().received);
  counts.can_state = static_cast<std::int8_t>(can_->bus_state());
  return counts;
}

void Outputs::tick(double now_s) {
  if (!can_) return;
  while (can_->tick(now_s, &wheels_)) publisher_.publish(ipc::kWheelsChannel, wheels_.utime, wheels_);
}

std::vector<std::string> Outputs::close(const RunEnd& end) {
  std::vector<std::string> written;
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
  if (can_) {
    can_->close();
    if (!options_.can_log.empty()) written.push_back(options_.can_log);
  }
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
    make_can(config)->log_to(
        std::make_unique<ipc::CandumpWriter>(options_.can_log, bus_name(config), config.can.fd));
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
  if (!options_.can_interface && !(use_ == Use::kLive && config.can.enabled)) return;
  try {
    const drivers::CanOptions options = read_wheels(config);
    auto bus = std::make_unique<drivers::SocketCan>(bus_name(config), options);
    make_can(config)->send_on(std::move(bus));
    if (use_ == Use::kLive)
      can_->send_steadily(config.can.rate_hz,
                          config.camera.rate_hz > 0.0 ? 1.0 / config.camera.rate_hz : 0.0);
  } catch (const ConfigError&) {
    throw;
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}; the run goes on without the bus", error.what());
  }
}

drivers::CanOptions Outputs::read_wheels(const Config& config) {
  drivers::CanOptions options;
  options.fd = config.can.fd;
  options.wait_for_interface = use_ == Use::kLive;
  if (use_ != Use::kLive || config.can.wheels_dbc == "none" || config.can.wheel_signals == "none")
    return options;
  try {
    auto wheels = std::make_unique<drivers::WheelReader>(config.can.wheels_dbc, config.can.wheel_signals);
    options.wanted_ids = wheels->ids();
    make_can(config)->read_wheels(std::move(wheels));
  } catch (const std::runtime_error& error) {
    throw ConfigError(std::string("configuration: can: ") + error.what());
  }
  return options;
}

CanSink* Outputs::make_can(const Config& config) {
  if (!can_) can_ = std::make_unique<CanSink>(config.can.frame);
  return can_.get();
}

std::string Outputs::bus_name(const Config& config) const {
  const bool named = options_.can_interface && !options_.can_interface->empty();
  return named ? *options_.can_interface : config.can.interface;
}

}  // namespace farpoint::daemon
