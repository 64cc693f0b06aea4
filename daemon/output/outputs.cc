// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/outputs.h"

#include <spdlog/spdlog.h>

#include <functional>
#include <utility>

#include "daemon/system/boot_counter.h"
#include "drivers/can/link_info.h"

namespace farpoint::daemon {
namespace {

std::size_t ring_bytes(const Config& config) {
  return static_cast<std::size_t>(config.realtime.disk_ring_mb) * 1'000'000;
}

bool writes_files(const Options& options) {
  return !options.output.empty() || !options.live_trajectory.empty();
}

// Closes files, each by itself.
class Closing {
 public:
  explicit Closing(std::vector<std::string>* written) : written_(*written) {}
  // close_files returns the paths of what it closed.
  void close(const std::function<std::vector<std::string>()>& close_files) {
    try {
      for (std::string& path : close_files()) written_.push_back(std::move(path));
    } catch (const std::runtime_error& error) {
      problems_ += (problems_.empty() ? "" : "; ") + std::string(error.what());
    }
  }
  void throw_problems() const {
    if (!problems_.empty()) throw std::runtime_error(problems_);
  }

 private:
  std::vector<std::string>& written_;
  std::string problems_;
};

void add_mavlink(const MavlinkCounts& of, OutputCounts* counts) {
  counts->mavlink_sent = of.sent;
  counts->mavlink_without_scale = of.without_scale;
  counts->mavlink_without_pose = of.without_pose;
  counts->mavlink_send_errors = of.send_errors;
  counts->mavlink_received = of.received;
  counts->mavlink_round_trip_us = of.round_trip_us;
  if (!of.is_open) counts->side_missing |= 1 << static_cast<int>(SideFunction::kMavlink);
  counts->side_failures += of.failed_openings;
}

}  // namespace

Outputs::Outputs(const Options& options, const Config& config, std::int32_t boot_counter)
    : options_(options), side_(nullptr), boot_counter_(boot_counter) {
  if (is_steady()) files_ = std::make_unique<FileWriter>(ring_bytes(config));
  try {
    open_files(config);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  open_network(config);
  open_bus(config);
}

Outputs::Outputs(const Options& options, const Config& config, SideFunctions* side)
    : options_(options), side_(side) {
  count_start(config);
  files_ = std::make_unique<FileWriter>(writes_files(options) ? ring_bytes(config) : 0);
  open_files(config);
  open_network(config);
  open_bus(config);
  open_mavlink(config);
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
  if (mavlink_) all.push_back(mavlink_.get());
  if (live_) all.push_back(live_.get());
  return all;
}

OutputCounts Outputs::counts() const {
  OutputCounts counts;
  counts.can_send_errors = (bus_ ? bus_->errors() : 0) + (replay_ ? replay_->errors() : 0);
  counts.can_received = wheels_ != nullptr ? wheels_->received() : 0;
  if (is_live()) {
    counts.side_missing = side_->missing();
    counts.side_failures = side_->failures();
  }
  if (mavlink_) add_mavlink(mavlink_->counts(), &counts);
  if (!bus_) return counts;
  counts.can_not_logged = bus_->not_logged();
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

void Outputs::start_writing(const RealtimeConfig& config, RealtimeReport* report) {
  if (mavlink_) mavlink_->start(config, report);
  if (!files_ || (!writes_files(options_) && options_.can_log.empty())) return;
  if (bus_) files_->add_turn([this] { bus_->write_log(); });
  files_->start(config, report);
}

void Outputs::farewell() {
  if (mavlink_) mavlink_->stop();
  if (bus_) bus_->farewell();
}

void Outputs::finish_writing() {
  if (files_) files_->stop();
}

void Outputs::close(const RunEnd& end, std::vector<std::string>* written) {
  farewell();
  finish_writing();
  Closing closing(written);
  closing.close([this] { return close_log(); });
  closing.close([&] { return write_trajectories(end); });
  closing.close([this] { return close_live_trajectory(); });
  closing.close([this] { return close_buses(); });
  closing.close([this]() -> Paths {
    warn_of_losses();
    return {};
  });
  closing.throw_problems();
}

Outputs::Paths Outputs::close_log() {
  ipc::LogWriter* log = log_.get();
  if (log == nullptr) return {};
  log->close();
  return {options_.output};
}

Outputs::Paths Outputs::write_trajectories(const RunEnd& end) const {
  if (options_.trajectory.empty()) return {};
  return write_final_trajectories(options_.trajectory, end.trajectories, end.live_utimes, end.unit_scale);
}

Outputs::Paths Outputs::close_live_trajectory() {
  if (!live_ || !live_->is_open()) return {};
  live_->close();
  return {options_.live_trajectory};
}

Outputs::Paths Outputs::close_buses() {
  const bool is_logged = (bus_ && bus_->is_logged()) || (replay_ && !options_.can_log.empty());
  if (bus_) bus_->close();
  if (replay_) replay_->close();
  return is_logged ? Paths{options_.can_log} : Paths{};
}

void Outputs::warn_of_losses() const {
  if (publisher_.network_errors() > 0) spdlog::warn("{} messages were not sent", publisher_.network_errors());
  if (counts().can_send_errors > 0) spdlog::warn("{} CAN frames were not sent", counts().can_send_errors);
  if (mavlink_)
    if (const MavlinkCounts of = mavlink_->counts(); of.without_scale > 0)
      spdlog::warn("{} MAVLink ODOMETRY messages were not sent: no sensor gave metres", of.without_scale);
  const std::uint64_t dropped = files_ ? files_->dropped() : 0;
  if (dropped == 0) return;
  const std::string problem =
      fmt::format("{} messages are missing in the files: the disk was too slow", dropped);
  // A replay that is not whole cannot be compared or repeated.
  if (!is_live()) throw std::runtime_error(problem);
  spdlog::warn("{}", problem);
}

void Outputs::open_file(SideFunction which, const std::string& path, const SideFunctions::Begin& open) {
  if (is_live())
    side_->begin(which, path, open);
  else
    open();
}

void Outputs::open_files(const Config& config) {
  if (!options_.output.empty()) open_log();
  if (!options_.live_trajectory.empty()) open_live_trajectory();
  if (!options_.can_log.empty()) open_can_log(config);
  if (options_.trajectory.empty()) return;
  // Written at the end only: find out now whether that will be possible.
  try {
    ipc::ReplacedPath probe(options_.trajectory);
  } catch (const std::runtime_error& error) {
    if (!is_live()) throw;
    spdlog::warn("{}; it is tried again at the end", error.what());
  }
}

void Outputs::open_log() {
  open_file(SideFunction::kOutputLog, options_.output,
            [this] { log_.set(std::make_unique<ipc::LogWriter>(options_.output)); });
  if (files_)
    publisher_.add(std::make_unique<QueuedLogSink>(files_.get(), &log_));
  else
    publisher_.add(std::make_unique<LogMessageSink>(log_.get()));
}

void Outputs::open_live_trajectory() {
  live_ = files_ ? std::make_unique<LiveTrajectory>(files_.get()) : std::make_unique<LiveTrajectory>();
  open_file(SideFunction::kLiveTrajectory, options_.live_trajectory,
            [this] { live_->open(options_.live_trajectory); });
}

void Outputs::open_can_log(const Config& config) {
  const std::string name = bus_name(config);
  const auto make_log = [this, name, fd = config.can.fd] {
    return std::make_unique<ipc::CandumpWriter>(options_.can_log, name, fd);
  };
  if (!is_live()) return make_replay(config)->log_to(make_log());
  make_bus(config);
  open_file(SideFunction::kCanLog, options_.can_log, [this, make_log] { bus_->log_to(make_log()); });
}

void Outputs::open_network(const Config& config) {
  if (!options_.lcm_url && !(is_live() && config.lcm.enabled)) return;
  const std::string url = options_.lcm_url.value_or("").empty() ? config.lcm.url : *options_.lcm_url;
  if (is_live()) return open_live_network(url);
  try {
    publisher_.add(std::make_unique<LcmMessageSink>(url));
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}; replay goes on without the network", error.what());
  }
}

void Outputs::open_live_network(const std::string& url) {
  if (const std::string problem = lcm_url_problem(url); !problem.empty())
    throw ConfigError(fmt::format("configuration: lcm.url: '{}', {}", url, problem));
  auto sink = std::make_unique<LcmMessageSink>();
  LcmMessageSink* lcm = sink.get();
  publisher_.add(std::move(sink));
  side_->begin(SideFunction::kLcm, "LCM", [lcm, url] { lcm->open(url); });
}

void Outputs::open_bus(const Config& config) {
  if (!options_.can_interface && !(is_live() && config.can.enabled)) return;
  const ipc::CanLayout layout = can_layout(config.can);
  drivers::CanOptions options;
  options.fd = layout.fd;
  options.wait_for_interface = is_live();
  options.extended_ids = layout.extended;
  for (std::size_t i = 0; i < (layout.fd ? 1 : ipc::kCanMessages); ++i)
    options.sent_ids.push_back(layout.id(static_cast<ipc::CanMessage>(i)));
  // Lockstep never waits for the bus.
  options.confirm = is_steady();
  const std::string name = bus_name(config);
  try {
    auto bus = std::make_unique<drivers::SocketCan>(name, options);
    if (*bus->waits_for() != '\0')
      spdlog::warn("CAN interface {}: {}; looking for it", name, bus->waits_for());
    else if (const auto link = drivers::read_link(name))
      if (const std::string problem = drivers::queue_problem(*link, layout.most_frames()); !problem.empty())
        spdlog::warn("CAN interface {}: {}", name, problem);
    if (is_steady())
      make_bus(config)->send_on(std::move(bus));
    else
      make_replay(config)->send_on(std::move(bus));
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}; the run goes on without the bus", error.what());
  }
}

void Outputs::open_mavlink(const Config& config) {
  if (!config.mavlink.enabled) return;
  mavlink_ = std::make_unique<MavlinkOutput>(config.mavlink);
  spdlog::info("MAVLink: ODOMETRY to {} at {} Hz", config.mavlink.link, config.mavlink.rate_hz);
}

EpochOptions Outputs::epoch_options(const Config& config) const {
  EpochOptions options;
  options.pose_frame = config.can.frame;
  options.boot_counter = boot_counter_on_can(boot_counter_);
  if (is_live() && config.camera.rate_hz > 0.0) options.frame_period_s = 1.0 / config.camera.rate_hz;
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
