// SPDX-License-Identifier: Apache-2.0
#include "daemon/live.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <optional>

#include "daemon/config/build_info.h"
#include "daemon/input/camera_driver.h"
#include "daemon/input/camera_source.h"
#include "daemon/input/live_camera_options.h"
#include "daemon/input/recorder.h"
#include "daemon/input/wheel_source.h"
#include "daemon/output/outputs.h"
#include "daemon/output/run_summary.h"
#include "daemon/pipeline/session.h"
#include "daemon/system/control_socket.h"
#include "daemon/system/core_plan.h"
#include "daemon/system/late_opened.h"
#include "daemon/system/logging.h"
#include "daemon/system/service_log.h"
#include "daemon/system/service_manager.h"
#include "daemon/system/side_functions.h"
#include "daemon/system/stop_signal.h"

namespace farpoint::daemon {
namespace {

// These take effect while the daemon runs.
constexpr std::array kRunTimeKeys = {
    "log.level",        "lcm.status_rate_hz",       "camera.exposure",        "camera.exposure_us",
    "camera.gain",      "camera.exposure_short_us", "camera.exposure_max_us", "camera.gain_share",
    "camera.brightness"};

constexpr double kStatusEvery_s = 1.0;

bool is_run_time_key(const std::string& name) {
  return std::find(kRunTimeKeys.begin(), kRunTimeKeys.end(), name) != kRunTimeKeys.end();
}

calibration_t read_calibration(const Config& config) {
  std::vector<std::string> notices;
  calibration_t calibration = read_live_calibration(config, &notices);
  for (const std::string& notice : notices) spdlog::warn("{}", notice);
  return calibration;
}

void say(const drivers::CameraEvent& event, const std::string& device) {
  using Kind = drivers::CameraEvent::Kind;
  const std::string why = event.error != 0 ? std::string(" (") + std::strerror(event.error) + ")" : "";
  switch (event.kind) {
    case Kind::kStreaming:
      spdlog::info("camera {}: streams {} at {}{}", device, to_string(event.format),
                   event.rate_hz > 0.0 ? fmt::format("{:.1f} Hz", event.rate_hz) : "a rate of its own",
                   event.exposure_known ? "" : ", exposure unknown: times are of its end or beginning");
      return;
    case Kind::kAbsent:
      spdlog::warn("camera {}: not there: {}{}; looking for it", device, event.what, why);
      return;
    case Kind::kRefused:
      spdlog::error("camera {}: cannot be used: {}{}; trying again", device, event.what, why);
      return;
    case Kind::kLost:
    case Kind::kStalled:
      spdlog::warn("camera {}: lost: {}{}; looking for it", device, event.what, why);
      return;
  }
}

// Stops what runs on a thread of its own, when the scope ends.
template <typename Runner>
class StopAtEnd {
 public:
  explicit StopAtEnd(Runner* runner) : runner_(runner) {}  // null: none runs
  ~StopAtEnd() {
    if (runner_ != nullptr) runner_->stop();
  }
  StopAtEnd(const StopAtEnd&) = delete;
  StopAtEnd& operator=(const StopAtEnd&) = delete;

 private:
  Runner* runner_;
};

// One live run. Members are in the order of their dependence.
class LiveRun {
 public:
  LiveRun(const Options& options, const Config& config, LiveEnvironment* environment);

  int run(const std::function<Config()>& reload, const ThreadHooks& hooks);
  // Ends the recorder's thread, where it runs.
  void stop();

 private:
  [[nodiscard]] std::unique_ptr<Session> open_session();
  [[nodiscard]] PipelineOptions pipeline_options() const;
  [[nodiscard]] PipelineParts pipeline_parts();
  [[nodiscard]] bool wants_results() const {
    return !options_.output.empty() || !options_.trajectory.empty();
  }
  [[nodiscard]] std::deque<CameraSource> open_cameras(LiveEnvironment* environment) const;
  void open_log_file_aside();
  void open_recorder_aside();
  void open_wheels();
  void run_threads(const ThreadHooks& hooks);
  void tick(const std::function<Config()>& reload);
  [[nodiscard]] bool all_threads_alive(double now_s);
  void take_over(const std::function<Config()>& reload);
  void tell_status(double now_s);
  void open_control();
  [[nodiscard]] std::string obey(const std::string& command);
  [[nodiscard]] std::string status_text() const;
  int conclude();

  const StopOnSignal stop_;
  const ReloadOnSignal reload_signal_;
  const Options& options_;
  Config config_;
  const calibration_t calibration_;
  ServiceManager manager_;
  SideFunctions side_;
  Outputs outputs_;
  LateOpened<Recorder> recorder_;
  std::optional<Thread> recording_;
  std::unique_ptr<WheelSource> wheels_;  // null: none is configured
  std::optional<ControlSocket> control_;
  std::deque<CameraSource> cameras_;  // the first feeds the pipeline
  std::unique_ptr<Session> session_;
  RealtimeReport realtime_;
  Pipeline pipeline_;
  double next_status_s_ = 0;
  // As logged last.
  struct Logged {
    std::int64_t left_out = 0;  // of the recording
    slam::State state = slam::State::kStarting;
    const char* hung = nullptr;  // thread
  } logged_;
};

LiveRun::LiveRun(const Options& options, const Config& config, LiveEnvironment* environment)
    : options_(options),
      config_(config),
      calibration_(read_calibration(config)),
      outputs_(options, config, &side_),
      cameras_(open_cameras(environment)),
      session_(open_session()),
      realtime_(config.realtime),
      pipeline_(config, pipeline_options(), pipeline_parts()) {
  open_log_file_aside();
  open_control();
  open_wheels();
}

std::deque<CameraSource> LiveRun::open_cameras(LiveEnvironment* environment) const {
  const CameraConfig& c = config_.camera;
  std::deque<CameraSource> cameras;
  const auto open = [&](std::unique_ptr<drivers::Camera> given, const char* key) {
    const int index = static_cast<int>(cameras.size());
    if (!given) given = make_camera(c.driver, camera_options(config_, calibration_, index), key);
    cameras.emplace_back(index, std::move(given));
    cameras.back().limit_opening(c.open_limit_s);
    if (index > 0) cameras.front().pair_with(&cameras.back(), c.pair_tolerance_us);
  };
  open(std::move(environment->camera), "camera.device");
  if (c.has_second()) open(std::move(environment->second_camera), "camera.second_device");
  return cameras;
}

void LiveRun::open_log_file_aside() {
  if (config_.log.file == "none") return;
  side_.begin(SideFunction::kLogFile, "log.file", [log = config_.log] { open_log_file(log); });
}

void LiveRun::open_recorder_aside() {
  if (options_.record.empty()) return;
  side_.begin(SideFunction::kRecording, "--record", [this] {
    auto recorder = std::make_unique<Recorder>(options_.record, config_.record, calibration_);
    recording_.emplace(Recorder::kThread, config_.realtime, ThreadConfig{}, nullptr,
                       [recorder = recorder.get()] { recorder->run(); });
    for (CameraSource& camera : cameras_) camera.record_to(recorder.get());
    if (wheels_) wheels_->record_to(recorder.get());
    recorder_.set(std::move(recorder));
  });
}

void LiveRun::stop() {
  if (Recorder* recorder = recorder_.get()) recorder->stop();
  recording_.reset();
}

void LiveRun::open_wheels() {
  const CanConfig& can = config_.can;
  if (can.wheels_dbc == "none" || can.wheel_signals == "none") return;
  std::optional<drivers::WheelReader> reader;
  try {
    reader.emplace(can.wheels_dbc, can.wheel_signals);
  } catch (const std::runtime_error& error) {
    throw ConfigError(std::string("configuration: can: ") + error.what());
  }
  const bool named = options_.can_interface && !options_.can_interface->empty();
  if (!options_.can_interface && !can.enabled) return;
  drivers::CanOptions options;
  options.wanted_ids = reader->ids();
  options.fd = can.fd;
  options.wait_for_interface = true;
  try {
    auto bus = std::make_unique<drivers::SocketCan>(named ? *options_.can_interface : can.interface, options);
    wheels_ = std::make_unique<WheelSource>(std::move(bus), std::move(*reader));
    wheels_->feed(&session_->estimator(), config_.estimator.wheels);
    outputs_.publish_wheels_of(wheels_.get());
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}; the run goes on without wheel speeds", error.what());
  }
}

std::unique_ptr<Session> LiveRun::open_session() {
  // Images of a second camera are recorded; no queue carries them to tracking.
  if (calibration_.cameras.size() > 1) config_.camera.use = CameraUse::kOne;
  const std::string second = config_.camera.has_second() ? " and " + config_.camera.second_device : "";
  spdlog::info("farpointd {}, configuration {:016x}, live from {} {}{}", build_text(), config_hash(config_),
               value_text(config_, "camera.driver"), config_.camera.device, second);
  // Memory grows with the way only where its results are asked for: a vehicle drives for hours.
  config_.estimator.capacity.whole_trajectory = wants_results();
  std::unique_ptr<Session> session =
      make_session(config_, calibration_, &outputs_, !options_.output.empty(), wants_results());
  session->reporter().set_camera(config_.camera.device);
  if (config_.realtime.deadline_ms == 0.0) session->reporter().set_deadline(1e3 / config_.camera.rate_hz);
  return session;
}

void LiveRun::open_control() {
  if (config_.control.socket == "none") return;
  try {
    control_.emplace(config_.control.socket);
  } catch (const std::runtime_error& error) {
    spdlog::warn("{}; the run goes on without commands", error.what());
  }
}

PipelineOptions LiveRun::pipeline_options() const {
  PipelineOptions o;
  o.width_px = calibration_.cameras.front().width;
  o.height_px = calibration_.cameras.front().height;
  o.rate_hz = config_.camera.rate_hz;
  o.no_camera_after_s = config_.camera.lost_after_s;
  return o;
}

PipelineParts LiveRun::pipeline_parts() {
  return {&cameras_.front(), &session_->estimator(), &session_->reporter(),
          &outputs_,         &session_->tally(),     &realtime_};
}

int LiveRun::run(const std::function<Config()>& reload, const ThreadHooks& hooks) {
  realtime_.lock_memory();
  realtime_.hold_cpu_latency();
  realtime_.check_governors();
  ThreadHooks all = hooks;
  all.on_started = [&] {
    realtime_.print();
    manager_.ready();
    if (hooks.on_started) hooks.on_started();
  };
  all.on_watch = [&] {
    tick(reload);
    if (hooks.on_watch) hooks.on_watch();
  };
  run_threads(all);
  spdlog::info("stopped by signal {}", StopOnSignal::signal());
  return conclude();
}

void LiveRun::run_threads(const ThreadHooks& hooks) {
  // Each of these threads must stop before it is joined; the recorder's after all that record.
  const StopAtEnd stop_recording(this);
  const ThreadConfig further = resolved(config_.realtime, usable_cores()).capture;
  std::deque<Thread> further_captures;
  std::deque<StopAtEnd<CameraSource>> stop_further;
  for (CameraSource& camera : cameras_) {
    if (&camera == &cameras_.front()) continue;
    further_captures.emplace_back(camera.thread_name().c_str(), config_.realtime, further, &realtime_,
                                  [&camera] { camera.run(); });
    stop_further.emplace_back(&camera);
  }
  std::optional<Thread> wheels;
  if (wheels_)
    wheels.emplace(WheelSource::kThread, config_.realtime, ThreadConfig{}, &realtime_,
                   [this] { wheels_->run(); });
  const StopAtEnd stop_wheels(wheels_.get());
  outputs_.start_writing(config_.realtime, &realtime_);
  open_recorder_aside();
  const StopAtEnd stop_side(&side_);
  side_.start(config_.realtime, nullptr);
  pipeline_.run(hooks);
  outputs_.farewell();
  manager_.stopping();
}

void LiveRun::tick(const std::function<Config()>& reload) {
  for (CameraSource& camera : cameras_)
    for (drivers::CameraEvent event; camera.take_event(&event);)
      say(event, device_of(config_.camera, camera.index()));
  if (ReloadOnSignal::take()) take_over(reload);
  if (control_) control_->serve([this](const std::string& command) { return obey(command); });
  const double now_s = steady_s();
  manager_.watch(now_s, [&] { return all_threads_alive(now_s); });
  if (const slam::State state = pipeline_.state(); state != logged_.state) {
    spdlog::info("{} -> {}", to_string(logged_.state), to_string(state));
    logged_.state = state;
  }
  if (now_s >= next_status_s_) tell_status(now_s);
}

bool LiveRun::all_threads_alive(double now_s) {
  const char* hung = pipeline_.hung_thread(now_s);
  if (hung != logged_.hung && hung != nullptr)
    spdlog::error("{} has finished nothing within its limit (section watchdog): the watchdog is not fed",
                  hung);
  if (hung != logged_.hung && hung == nullptr) spdlog::warn("{} makes progress again", logged_.hung);
  logged_.hung = hung;
  return hung == nullptr;
}

void LiveRun::tell_status(double now_s) {
  next_status_s_ = now_s + kStatusEvery_s;
  manager_.status(status_text());
  for (CameraSource& camera : cameras_)
    if (const std::string line = camera.take_troubles(now_s); !line.empty())
      spdlog::warn("camera {}: {}", device_of(config_.camera, camera.index()), line);
  const Recorder* recorder = recorder_.get();
  if (recorder == nullptr || recorder->left_out() == logged_.left_out) return;
  logged_.left_out = recorder->left_out();
  spdlog::warn("{}: {} images left out so far: the disk cannot follow, or is full", options_.record,
               logged_.left_out);
}

std::string LiveRun::status_text() const {
  return fmt::format("{}, {} frames tracked, {} dropped", to_string(pipeline_.state()),
                     pipeline_.frames_tracked(), pipeline_.frames_dropped());
}

std::string LiveRun::obey(const std::string& command) {
  if (command == "status") return "ok " + status_text();
  spdlog::info("command: {}", command.substr(0, 40));
  if (command == "reset-odom") {
    session_->reporter().reset_odom();
    return "ok the next pose is the origin of odom";
  }
  if (command == "stop") {
    StopOnSignal::ask();
    return "ok stopping";
  }
  return "error: unknown command, expected status, reset-odom or stop";
}

void LiveRun::take_over(const std::function<Config()>& reload) {
  manager_.reloading();
  try {
    const Config wanted = reload();
    const std::string restart = keys_that_need_a_restart(config_, wanted);
    config_.log.level = wanted.log.level;
    config_.lcm.status_rate_hz = wanted.lcm.status_rate_hz;
    config_.camera.exposure = wanted.camera.exposure;
    set_log_level(config_.log.level);
    session_->reporter().set_status_rate(config_.lcm.status_rate_hz);
    for (CameraSource& camera : cameras_) camera.set_exposure(exposure_options(config_.camera.exposure));
    spdlog::info("configuration read again{}", restart.empty() ? "" : "; after a restart only: " + restart);
  } catch (const std::exception& error) {
    spdlog::error("configuration not taken over: {}", error.what());
  }
  manager_.ready();
}

int LiveRun::conclude() {
  outputs_.finish_writing();
  const RunEnd& end = wants_results() ? session_->finish(pipeline_.input()) : session_->end();
  // One file that cannot be stored takes no other with it.
  std::string problems;
  const auto close = [&problems](const auto& close_files) {
    try {
      close_files();
    } catch (const std::runtime_error& error) {
      problems += (problems.empty() ? "" : "; ") + std::string(error.what());
    }
  };
  std::vector<std::string> written;
  close([&] { outputs_.close(end, &written); });
  close([&] {
    if (recorder_.get() != nullptr) recorder_.get()->close();
  });
  if (recorder_.get() != nullptr)
    for (std::string& path : recorder_.get()->files()) written.push_back(std::move(path));
  std::fprintf(
      line_stream(options_), "%s\n",
      last_line(end, pipeline_.input(), pipeline_.frames_dropped(), pipeline_.take_tracking_cpu_ms(), written)
          .c_str());
  if (!problems.empty()) throw std::runtime_error(problems);
  return 0;
}

}  // namespace

std::string keys_that_need_a_restart(const Config& running, const Config& wanted) {
  std::string names;
  for (const ConfigKey& key : config_keys()) {
    if (is_run_time_key(key.name) || key.get(running) == key.get(wanted)) continue;
    names += (names.empty() ? "" : ", ") + key.name;
  }
  return names;
}

int live(const Options& options, const Config& config, const std::function<Config()>& reload,
         LiveEnvironment environment) {
  LiveRun run(options, config, &environment);
  return run.run(reload, environment.hooks);
}

}  // namespace farpoint::daemon
