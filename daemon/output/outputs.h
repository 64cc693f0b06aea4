// SPDX-License-Identifier: Apache-2.0
// Everything that a run writes or sends. Files appear when close() is called, else not at all.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/input/counts.h"
#include "daemon/input/wheel_source.h"
#include "daemon/output/can_bus.h"
#include "daemon/output/can_replay.h"
#include "daemon/output/file_writer.h"
#include "daemon/output/mavlink_output.h"
#include "daemon/output/messages.h"
#include "daemon/output/publisher.h"
#include "daemon/output/trajectory_file.h"
#include "daemon/system/side_functions.h"

namespace farpoint::daemon {

// Live and in a threaded replay, files are written on a thread of their own; lockstep writes them at once.
class Outputs {
 public:
  // A replay: sends what its options ask for, and warns of a network or bus that cannot be used.
  // boot_counter: that of the run that is repeated, 0 for none. Throws UsageError where a file cannot be
  // written.
  Outputs(const Options& options, const Config& config, std::int32_t boot_counter = 0);
  // A live run: sends what the configuration asks for. A file or network that cannot be used is left to
  // `side`, which outlives this object and must have stopped before its end. Throws ConfigError for a URL
  // that can never work.
  Outputs(const Options& options, const Config& config, SideFunctions* side);

  // The bus first: it is what a controller waits for.
  [[nodiscard]] std::vector<PoseSink*> sinks();
  [[nodiscard]] Publisher* publisher() { return &publisher_; }
  // Output thread.
  [[nodiscard]] OutputCounts counts() const;
  // Whether tick() has anything to do.
  [[nodiscard]] bool ticks() const { return bus_ != nullptr || wheels_ != nullptr; }
  // Output thread, often: sends what is due on the bus, and publishes what came from the wheels.
  void tick(double now_s);
  // When tick() has to send something next.
  [[nodiscard]] double next_due_s() const { return bus_ ? bus_->next_due_s() : CanBus::kNever_s; }
  // Publishes its measurements as WHEELS; it must outlive the run. Before the first tick.
  void publish_wheels_of(WheelSource* wheels) { wheels_ = wheels; }
  // What the calibration says of the body. Before the first frame.
  void set_body_is_camera(bool is_camera);
  // Of this start; 0 in replay.
  [[nodiscard]] std::int32_t boot_counter() const { return boot_counter_; }

  // Before the output thread starts: starts the thread of the files, where there is one. `report` may be
  // null.
  void start_writing(const RealtimeConfig& config, RealtimeReport* report);
  // Calling thread, after the output thread has ended: the bus gets its last epoch.
  void farewell();
  // Calling thread, after that: waits until the files hold what was published. Results that follow are
  // written at once.
  void finish_writing();

  // Renames every file to its final name, each by itself, and appends the names to *written. Throws
  // std::runtime_error where something was not stored, after all others are closed. Warns of what was not
  // sent.
  void close(const RunEnd& end, std::vector<std::string>* written);

 private:
  using Paths = std::vector<std::string>;

  [[nodiscard]] bool is_live() const { return side_ != nullptr; }
  // The steady clock drives the outputs, and threads of their own.
  [[nodiscard]] bool is_steady() const { return is_live() || options_.speed.has_value(); }
  void count_start(const Config& config);
  // A file: in replay it must open now.
  void open_file(SideFunction which, const std::string& path, const SideFunctions::Begin& open);
  void open_files(const Config& config);
  void open_log();
  void open_live_trajectory();
  void open_can_log(const Config& config);
  void open_network(const Config& config);
  void open_live_network(const std::string& url);
  void open_bus(const Config& config);
  void open_mavlink(const Config& config);
  Paths close_log();
  [[nodiscard]] Paths write_trajectories(const RunEnd& end) const;
  Paths close_live_trajectory();
  Paths close_buses();
  void warn_of_losses() const;
  [[nodiscard]] EpochOptions epoch_options(const Config& config) const;
  CanBus* make_bus(const Config& config);
  CanReplay* make_replay(const Config& config);
  [[nodiscard]] std::string bus_name(const Config& config) const;

  const Options& options_;
  SideFunctions* side_;  // null in replay
  std::unique_ptr<FileWriter> files_;
  LateOpened<ipc::LogWriter> log_;
  std::unique_ptr<LiveTrajectory> live_;
  std::int32_t boot_counter_ = 0;
  // Live and in a threaded replay the bus has the steady clock; a replay's log has the recording's.
  std::unique_ptr<CanBus> bus_;
  std::unique_ptr<CanReplay> replay_;
  std::unique_ptr<MavlinkOutput> mavlink_;  // live, where it is enabled
  Publisher publisher_;
  WheelSource* wheels_ = nullptr;
};

}  // namespace farpoint::daemon
