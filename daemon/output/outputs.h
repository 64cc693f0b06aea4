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
#include "daemon/output/messages.h"
#include "daemon/output/publisher.h"
#include "daemon/output/trajectory_file.h"

namespace farpoint::daemon {

class Outputs {
 public:
  // A replay sends only what its options ask for, and only warns of a network or bus that cannot be used.
  // Live, the configuration asks, and a network that cannot be used is an error: the service manager tries
  // again.
  enum class Use : std::uint8_t { kReplay, kLive };
  // boot_counter: in replay, that of the run that is repeated, 0 for none. Throws UsageError where a file
  // cannot be written, std::runtime_error as said above.
  Outputs(const Options& options, const Config& config, Use use = Use::kReplay,
          std::int32_t boot_counter = 0);

  // The bus first: it is what a controller waits for.
  [[nodiscard]] std::vector<PoseSink*> sinks();
  [[nodiscard]] Publisher* publisher() { return &publisher_; }
  [[nodiscard]] OutputCounts counts() const;
  // Whether tick() has anything to do.
  [[nodiscard]] bool ticks() const { return bus_ != nullptr || wheels_ != nullptr; }
  // On the output's thread, often: sends what is due on the bus, and publishes what came from the wheels.
  void tick(double now_s);
  // When tick() has to send something next.
  [[nodiscard]] double next_due_s() const { return bus_ ? bus_->next_due_s() : CanBus::kNever_s; }
  // Publishes its measurements as WHEELS; it must outlive the run. Before the first tick.
  void publish_wheels_of(WheelSource* wheels) { wheels_ = wheels; }
  // What the calibration says of the body. Before the first frame.
  void set_body_is_camera(bool is_camera);
  // Of this start; 0 in replay.
  [[nodiscard]] std::int32_t boot_counter() const { return boot_counter_; }

  // On the calling thread: writes what waits for the disk.
  void write_logs();
  // On the calling thread, after the output's has ended: the bus gets its last epoch.
  void farewell();

  // Puts every file in its place; returns their names. Throws std::runtime_error where something was not
  // stored. Warns of what was not sent.
  std::vector<std::string> close(const RunEnd& end);

 private:
  void count_start(const Config& config);
  void open_files(const Config& config);
  void open_network(const Config& config);
  void open_bus(const Config& config);
  [[nodiscard]] EpochOptions epoch_options(const Config& config) const;
  CanBus* make_bus(const Config& config);
  CanReplay* make_replay(const Config& config);
  [[nodiscard]] std::string bus_name(const Config& config) const;

  const Options& options_;
  const Use use_;
  std::unique_ptr<ipc::LogWriter> log_;
  std::unique_ptr<LiveTrajectory> live_;
  std::int32_t boot_counter_ = 0;
  // Live and in a threaded replay the bus has the steady clock; a replay's log has the recording's.
  std::unique_ptr<CanBus> bus_;
  std::unique_ptr<CanReplay> replay_;
  Publisher publisher_;
  WheelSource* wheels_ = nullptr;
};

}  // namespace farpoint::daemon
