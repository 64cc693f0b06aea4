#include "daemon/replay.h"

#include <spdlog/fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <memory>
#include <optional>

#include "daemon/build_info.h"
#include "daemon/can_sink.h"
#include "daemon/log_frame_source.h"
#include "daemon/logging.h"
#include "daemon/rig.h"
#include "daemon/session.h"
#include "daemon/trajectory_file.h"

namespace farpoint::daemon {
namespace {

volatile std::sig_atomic_t stop_signal = 0;

// SIGINT and SIGTERM end the replay between two frames, so that no temporary file is left behind.
class StopOnSignal {
 public:
  StopOnSignal() : on_interrupt_(std::signal(SIGINT, note)), on_terminate_(std::signal(SIGTERM, note)) {
    stop_signal = 0;
  }
  ~StopOnSignal() {
    std::signal(SIGINT, on_interrupt_);
    std::signal(SIGTERM, on_terminate_);
  }
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

 private:
  using Handler = void (*)(int);
  static void note(int signal) { stop_signal = signal; }
  Handler on_interrupt_, on_terminate_;
};

// Everything that a replay writes or sends. Files appear when close() is called, else not at all.
class Outputs {
 public:
  // Throws UsageError where a file cannot be written. A network or bus that cannot be used is only warned of.
  Outputs(const Options& options, const Config& config) : options_(options) {
    try {
      open_files(config);
    } catch (const std::runtime_error& error) {
      throw UsageError(error.what());
    }
    open_network(config);
    open_bus(config);
  }

  // The bus first: it is what a controller waits for.
  [[nodiscard]] std::vector<PoseSink*> sinks() {
    std::vector<PoseSink*> all;
    if (can_) all.push_back(can_.get());
    if (live_) all.push_back(live_.get());
    return all;
  }
  [[nodiscard]] Publisher* publisher() { return &publisher_; }
  [[nodiscard]] OutputCounts counts() const { return {can_ ? can_->errors() : 0}; }
  [[nodiscard]] std::uint64_t network_errors() const { return publisher_.network_errors(); }

  // Puts every file in its place; returns their names. Throws std::runtime_error where something was not
  // stored.
  std::vector<std::string> close(const RunEnd& end) {
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
    return written;
  }

 private:
  void open_files(const Config& config) {
    if (!options_.output.empty()) {
      log_ = std::make_unique<ipc::LogWriter>(options_.output);
      publisher_.add(std::make_unique<LogMessageSink>(log_.get()));
    }
    if (!options_.live_trajectory.empty()) live_ = std::make_unique<LiveTrajectory>(options_.live_trajectory);
    if (!options_.can_log.empty()) {
      make_can(config)->log_to(std::make_unique<ipc::CandumpWriter>(options_.can_log, bus_name(config)));
    }
    // Written at the end only: find out now whether that will be possible.
    if (!options_.trajectory.empty()) ipc::ReplacedPath probe(options_.trajectory);
  }

  void open_network(const Config& config) {
    if (!options_.lcm_url) return;
    const std::string url = options_.lcm_url->empty() ? config.lcm.url : *options_.lcm_url;
    try {
      publisher_.add(std::make_unique<LcmMessageSink>(url));
    } catch (const std::runtime_error& error) {
      spdlog::warn("{}; replay goes on without the network", error.what());
    }
  }

  void open_bus(const Config& config) {
    if (!options_.can_interface) return;
    try {
      auto bus = std::make_unique<drivers::SocketCan>(bus_name(config));
      make_can(config)->send_on(std::move(bus));
    } catch (const std::runtime_error& error) {
      spdlog::warn("{}; replay goes on without the bus", error.what());
    }
  }

  CanSink* make_can(const Config& config) {
    if (!can_) can_ = std::make_unique<CanSink>(config.can.frame);
    return can_.get();
  }
  [[nodiscard]] std::string bus_name(const Config& config) const {
    const bool named = options_.can_interface && !options_.can_interface->empty();
    return named ? *options_.can_interface : config.can.interface;
  }

  const Options& options_;
  std::unique_ptr<ipc::LogWriter> log_;
  std::unique_ptr<LiveTrajectory> live_;
  std::unique_ptr<CanSink> can_;
  Publisher publisher_;
};

std::unique_ptr<Session> make_session(const Config& config, const LogFrameSource& source, Outputs* outputs) {
  try {
    const slam::Rig rig = make_rig(source.calibration(), config.camera.index);
    spdlog::info("farpointd {}, configuration {:016x}, lockstep replay of {}", build_text(),
                 config_hash(config), source.name());
    return std::make_unique<Session>(config, rig, calibration_hash(source.calibration()), outputs->sinks(),
                                     outputs->publisher());
  } catch (const InputError& error) {
    throw InputError(source.name() + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw ConfigError(std::string("configuration: ") + error.what());
  } catch (const std::bad_alloc&) {
    throw ConfigError(
        "configuration: not enough memory for the keys of section capacity, expected smaller ones");
  }
}

double percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * double(part) / double(whole) : 0.0;
}

const char* outcome(const RunEnd& end) {
  if (end.trajectories.empty()) return "done, never initialised";
  if (end.last.state == slam::State::kLost || end.last.state == slam::State::kRelocalising)
    return "done, lost at the end";
  return "done";
}

const char* scale_text(slam::ScaleState scale) {
  switch (scale) {
    case slam::ScaleState::kUnknown:
      return "unknown";
    case slam::ScaleState::kAssumed:
      return "assumed";
    case slam::ScaleState::kMetric:
      return "metric";
  }
  return "unknown";
}

// What was refused, where anything was.
std::string refused_text(const InputCounts& in) {
  std::string text;
  const auto add = [&](std::int64_t count, const char* what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "; refused: " : ", ", count, what);
  };
  add(in.wrong_size, "images of wrong size");
  add(in.undecodable, "undecodable images");
  add(in.unknown_camera, "images without calibration");
  add(in.times_backwards, "times not after the one before");
  add(in.messages_undecodable, "undecodable messages");
  add(in.log_damages, "damaged places of the log");
  return text;
}

std::string last_line(const RunEnd& end, const InputCounts& in, std::vector<double> cpu_ms,
                      const std::vector<std::string>& written) {
  std::sort(cpu_ms.begin(), cpu_ms.end());
  double sum_ms = 0.0;
  for (const double ms : cpu_ms) sum_ms += ms;
  const std::size_t maps = end.trajectories.size();
  constexpr double kMegabyte = 1e6;
  return fmt::format(
      "farpointd: {}: {} frames, {} tracked ({:.1f} %), {} map{}, lost {} time{}, scale {}; {:.1f} ms a "
      "frame (CPU "
      "mean, p99 {:.1f}); peak memory {:.0f} MB{}{}{}",
      outcome(end), end.frames, end.frames_valid, percent(end.frames_valid, end.frames), maps,
      maps == 1 ? "" : "s", end.counts.lost, end.counts.lost == 1 ? "" : "s", scale_text(end.last.scale),
      cpu_ms.empty() ? 0.0 : sum_ms / double(cpu_ms.size()), quantile(cpu_ms, 0.99),
      double(peak_resident_bytes()) / kMegabyte, refused_text(in), written.empty() ? "" : "; wrote ",
      fmt::join(written, " "));
}

// Standard output, but where that carries one of the outputs.
std::FILE* line_stream(const Options& o) {
  for (const std::string* path : {&o.output, &o.trajectory, &o.live_trajectory, &o.can_log}) {
    if (*path == "-") return stderr;
  }
  return stdout;
}

void show_progress(const LogFrameSource& source, const FrameOutput& frame, std::int64_t frames,
                   Progress* progress) {
  progress->show(source.progress(), fmt::format("frame {}, {}, {} landmarks agree", frames,
                                                slam::to_string(frame.result.state), frame.result.inliers));
}

}  // namespace

int replay_lockstep(const Options& options, const Config& config) {
  const StopOnSignal stop;
  LogFrameSource source(options.replay, config.camera.index);
  Outputs outputs(options, config);
  std::unique_ptr<Session> session;
  std::vector<double> cpu_ms;  // of decoding and tracking, a frame
  Progress progress;
  StageClock clock;
  SourceFrame frame;
  while (source.next(&frame, &clock)) {
    if (stop_signal != 0)
      throw std::runtime_error(fmt::format("stopped by signal {}, no output written", stop_signal));
    if (!session) session = make_session(config, source, &outputs);
    const slam::ImageView view{frame.image->data(), frame.image->width_px, frame.image->height_px,
                               frame.image->width_px};
    const slam::FrameInput input{frame.utime, frame.sequence, 0, view};
    const FrameOutput& output = session->process(input, source.counts(), outputs.counts(), &clock);
    cpu_ms.push_back(clock.cpu_ms(timing_t::STAGE_FRAME));
    show_progress(source, output, static_cast<std::int64_t>(cpu_ms.size()), &progress);
    clock.new_frame();
  }
  progress.clear();
  const RunEnd& end = session->finish(source.counts());
  const std::vector<std::string> written = outputs.close(end);
  if (outputs.network_errors() > 0) spdlog::warn("{} messages were not sent", outputs.network_errors());
  if (outputs.counts().can_send_errors > 0)
    spdlog::warn("{} CAN frames were not sent", outputs.counts().can_send_errors);
  const ipc::LogDamage& damage = source.damage();
  if (damage.cut_off) {
    std::fprintf(
        stderr,
        "farpointd: %s: cut off within its last event, expected a whole log (damaged in %llu places, "
        "the first at byte %llu); what came before was replayed\n",
        source.name().c_str(), static_cast<unsigned long long>(damage.places),
        static_cast<unsigned long long>(damage.first_offset));
  }
  std::fprintf(line_stream(options), "%s\n",
               last_line(end, source.counts(), std::move(cpu_ms), written).c_str());
  return damage.cut_off ? 2 : 0;
}

}  // namespace farpoint::daemon
