// SPDX-License-Identifier: Apache-2.0
#include "daemon/replay.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "daemon/config/build_info.h"
#include "daemon/config/errors.h"
#include "daemon/input/log_frame_source.h"
#include "daemon/input/paced_source.h"
#include "daemon/output/outputs.h"
#include "daemon/output/run_summary.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/pipeline/schedule.h"
#include "daemon/pipeline/session.h"
#include "daemon/system/logging.h"
#include "daemon/system/stop_signal.h"

namespace farpoint::daemon {
namespace {

std::unique_ptr<Session> session_of(const Config& config, const LogFrameSource& source, Outputs* outputs,
                                    const char* how, bool with_schedule) {
  spdlog::info("farpointd {}, configuration {:016x}, {} replay of {}", build_text(), config_hash(config), how,
               source.name());
  try {
    return make_session(config, source.calibration(), outputs, with_schedule);
  } catch (const InputError& error) {
    throw InputError(source.name() + ": " + error.what());
  }
}

std::string stopped_by(int signal, const char* when) {
  return fmt::format("stopped by signal {} {}", signal, when);
}

// Closes the outputs and prints the last line. Returns the exit status. A replay stopped by a signal closes
// its outputs as one at the end of its log does, and prints the signal.
int conclude(const Options& options, const LogFrameSource& source, std::int64_t frames_dropped,
             std::vector<double> cpu_ms, Session* session, Outputs* outputs) {
  outputs->farewell();
  const int signal = StopOnSignal::signal();
  if (session == nullptr) throw std::runtime_error(stopped_by(signal, "before the first image"));
  outputs->finish_writing();
  const RunEnd& end = session->finish(source.counts());
  std::vector<std::string> written;
  outputs->close(end, &written);
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
               last_line(end, source.counts(), frames_dropped, std::move(cpu_ms), written).c_str());
  if (signal != 0) {
    std::fprintf(stderr, "farpointd: %s\n",
                 stopped_by(signal, "before the end of the log; what came until then was replayed").c_str());
    return 1;
  }
  return damage.cut_off ? 2 : 0;
}

// One thread: lockstep, or in the order of `schedule`.
int replay_in_order(const Options& options, const Config& config, Schedule* schedule) {
  const StopOnSignal stop;
  LogFrameSource source(options.replay, config);
  Outputs outputs(options, config, schedule != nullptr ? schedule->boot_counter() : 0);
  std::unique_ptr<Session> session;
  std::optional<MeasurementFeed> feed;
  std::vector<double> cpu_ms;  // of decoding and tracking, a frame
  std::int64_t frames_dropped = 0;
  Progress progress;
  StageClock clock;
  SourceFrame frame;
  while (StopOnSignal::signal() == 0 && source.next(&frame, &clock)) {
    if (!session) {
      session = session_of(config, source, &outputs, schedule ? "recorded" : "lockstep", schedule != nullptr);
      source.feed_to(&feed.emplace(&session->estimator(), config.estimator.wheels));
    }
    const RecordedChance* recorded = nullptr;
    if (schedule != nullptr && (recorded = schedule->take(frame.meta.utime)) == nullptr) {
      ++frames_dropped;  // as it was then
      clock.new_frame();
      continue;
    }
    slam::FrameInput input{frame.meta.utime, frame.meta.sequence, 0, frame.view()};
    slam::CameraImage second{1, {}};
    if (frame.second != nullptr) {
      second.image = SourceFrame::view_of(*frame.second);
      input.others = std::span(&second, 1);
    }
    const FrameOutput& output = session->process(input, source.counts(), outputs.counts(), recorded, &clock);
    if (schedule != nullptr) schedule->check(output.result);
    cpu_ms.push_back(clock.cpu_ms(timing_t::STAGE_FRAME));
    show_progress(source.progress(), output.result, static_cast<std::int64_t>(cpu_ms.size()), &progress);
    clock.new_frame();
  }
  progress.clear();
  if (schedule != nullptr && StopOnSignal::signal() == 0) schedule->check_end();
  return conclude(options, source, frames_dropped, std::move(cpu_ms), session.get(), &outputs);
}

int replay_with_threads(const Options& options, const Config& config, const ThreadHooks& hooks) {
  const StopOnSignal stop;
  LogFrameSource source(options.replay, config);
  Outputs outputs(options, config);
  // The first image brings the calibration, and with it what everything is sized from.
  StageClock clock;
  SourceFrame first;
  if (!source.next(&first, &clock)) throw InputError(source.name() + ": no image");
  const std::unique_ptr<Session> session = session_of(config, source, &outputs, "threaded", true);
  MeasurementFeed feed(&session->estimator(), config.estimator.wheels);
  source.feed_to(&feed);
  PacedSource paced(&source, first, *options.speed);
  RealtimeReport realtime(config.realtime);
  realtime.lock_memory();
  PipelineOptions pipeline_options;
  pipeline_options.width_px = first.image->width_px;
  pipeline_options.height_px = first.image->height_px;
  pipeline_options.second_pixels = source.second_pixels();
  const PipelineParts parts{&paced,   &session->estimator(), &session->reporter(),
                            &outputs, &session->tally(),     &realtime};
  Pipeline pipeline(config, pipeline_options, parts);
  ThreadHooks all_hooks = hooks;
  all_hooks.on_started = [&] { realtime.print(); };
  outputs.start_writing(config.realtime, &realtime);
  pipeline.run(all_hooks);
  return conclude(options, source, pipeline.frames_dropped(), pipeline.take_tracking_cpu_ms(), session.get(),
                  &outputs);
}

}  // namespace

int replay(const Options& options, const Config& config, const ThreadHooks& hooks) {
  if (options.speed) return replay_with_threads(options, config, hooks);
  if (options.schedule_log.empty()) return replay_in_order(options, config, nullptr);
  Schedule schedule(options.schedule_log);
  return replay_in_order(options, config, &schedule);
}

}  // namespace farpoint::daemon
