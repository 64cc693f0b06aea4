// Everything that a run writes or sends. Files appear when close() is called, else not at all.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/input/counts.h"
#include "daemon/output/can_sink.h"
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
  // Throws UsageError where a file cannot be written, std::runtime_error as said above.
  Outputs(const Options& options, const Config& config, Use use = Use::kReplay);

  // The bus first: it is what a controller waits for.
  [[nodiscard]] std::vector<PoseSink*> sinks();
  [[nodiscard]] Publisher* publisher() { return &publisher_; }
  [[nodiscard]] OutputCounts counts() const;
  // Live, on the output's thread, between the frames.
  void tick(double now_s);
  // When tick() has to send something next.
  [[nodiscard]] double next_due_s() const { return can_ ? can_->next_due_s() : CanSink::kNever_s; }

  // Puts every file in its place; returns their names. Throws std::runtime_error where something was not
  // stored. Warns of what was not sent.
  std::vector<std::string> close(const RunEnd& end);

 private:
  void open_files(const Config& config);
  void open_network(const Config& config);
  void open_bus(const Config& config);
  [[nodiscard]] drivers::CanOptions read_wheels(const Config& config);
  CanSink* make_can(const Config& config);
  [[nodiscard]] std::string bus_name(const Config& config) const;

  const Options& options_;
  const Use use_;
  std::unique_ptr<ipc::LogWriter> log_;
  std::unique_ptr<LiveTrajectory> live_;
  std::unique_ptr<CanSink> can_;
  Publisher publisher_;
  wheels_t wheels_{};
};

}  // namespace farpoint::daemon
