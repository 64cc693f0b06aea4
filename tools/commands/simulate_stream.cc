// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/simulate_stream.h"

#include <cstdio>
#include <memory>

#include "ipc/channels.h"
#include "tools/common/errors.h"
#include "tools/common/progress.h"
#include "tools/simulate/sensors/measurements.h"
#include "tools/simulate/stream/stop_signals.h"
#include "tools/simulate/stream/stream.h"

namespace farpoint::tools {
namespace {

using simulate::StreamSinks;

// Frames that are rendered before they are due: what one that takes longer may be late by.
constexpr std::size_t kFramesAhead = 4;

void add_video(const std::string& device, int camera, const StreamRequest& request,
               const simulate::Simulation& simulation, StreamSinks* sinks) {
  if (device.empty()) return;
#ifdef FARPOINT_WITH_V4L2
  const slam::Camera& model = simulation.camera(camera);
  const double rate_hz = simulation.description().camera.rate_hz * request.pace;
  sinks->push_back(std::make_unique<simulate::VideoSink>(
      camera, device, drivers::OutputFormat{model.width_px(), model.height_px(), rate_hz}));
#else
  (void)camera, (void)request, (void)simulation, (void)sinks;
  throw InputError(device + ": this build has no V4L2 (FARPOINT_V4L2)");
#endif
}

drivers::WheelWriter make_wheels(const StreamRequest& request) {
  try {
    return {request.wheels_dbc, request.wheel_signals};
  } catch (const std::runtime_error& error) {
    throw InputError(std::string("--can: ") + error.what());
  }
}

void add_can(const StreamRequest& request, const simulate::Simulation& simulation, StreamSinks* sinks) {
  if (request.can_interface.empty()) return;
  if (!simulation.description().wheels)
    throw InputError("--can: the world " + simulation.description().name + " has no wheels");
  drivers::WheelWriter wheels = make_wheels(request);
  drivers::CanOptions options;
  options.fd = wheels.needs_fd();
  auto bus = std::make_unique<drivers::SocketCan>(request.can_interface, options);
  sinks->push_back(
      std::make_unique<simulate::CanSink>(request.can_interface, std::move(wheels), std::move(bus)));
}

StreamSinks open_sinks(const StreamRequest& request, const simulate::Simulation& simulation) {
  StreamSinks sinks;
  add_video(request.video, 0, request, simulation, &sinks);
  add_video(request.second_video, 1, request, simulation, &sinks);
  if (request.lcm_url) {
    const std::string url = request.lcm_url->empty() ? ipc::kDefaultLcmUrl : *request.lcm_url;
    sinks.push_back(std::make_unique<simulate::LcmSink>(url));
  }
  add_can(request, simulation, &sinks);
  if (!request.output.empty()) sinks.push_back(std::make_unique<simulate::LogSink>(request.output));
  return sinks;
}

void print_start(std::FILE* out, const simulate::Simulation& simulation, double pace, std::int64_t start_us) {
  std::fprintf(out, "%s: frame 0 at %lld us of CLOCK_MONOTONIC, %.6g frames a second\n",
               simulation.description().name.c_str(), static_cast<long long>(start_us),
               simulation.description().camera.rate_hz * pace);
  std::fflush(out);
}

void print_end(std::FILE* out, const simulate::Simulation& simulation, const simulate::StreamResult& result,
               const StreamSinks& sinks) {
  const slam::Camera& camera = simulation.camera(0);
  const double simulated_s = static_cast<double>(result.frames) / simulation.description().camera.rate_hz;
  std::string to, losses;
  for (const auto& sink : sinks) {
    to += (to.empty() ? "" : ", ") + sink->name();
    if (const std::string lost = sink->losses(); !lost.empty()) losses += "; " + lost;
  }
  const int signal = simulate::StopSignals::received();
  const std::string stopped = signal == 0 ? "" : ", stopped by signal " + std::to_string(signal);
  std::fprintf(
      out,
      "%s: world %s, seed %llu, %lld of %lld frames of %dx%d%s, %.1f s, path %.1f m%s; %lld late (by more "
      "than %lld ms), by %.1f ms at most; %.1f %% of the pace reached%s\n",
      to.c_str(), simulation.description().name.c_str(), static_cast<unsigned long long>(simulation.seed()),
      static_cast<long long>(result.frames), static_cast<long long>(simulation.frames()), camera.width_px(),
      camera.height_px(), simulation.cameras() > 1 ? " (stereo)" : "", simulated_s,
      simulate::path_length_m(simulation.body(), simulated_s), stopped.c_str(),
      static_cast<long long>(result.late), static_cast<long long>(simulate::kLate_us / 1000),
      1e-3 * static_cast<double>(result.latest_us), 100.0 * result.reached, losses.c_str());
}

}  // namespace

void check(const StreamRequest& request, bool stereo) {
  if (request.video.empty() && request.second_video.empty() && !request.lcm_url &&
      request.can_interface.empty())
    throw InputError("--stream: expected where to: --video, --lcm-url or --can");
  if (!request.second_video.empty() && !stereo)
    throw InputError("--second-video: expected --stereo with it, which makes a second camera");
  if (!request.second_video.empty() && request.video == request.second_video)
    throw InputError("--second-video " + request.second_video +
                     ": the same device as --video, expected another");
  const bool names_wheels = !request.wheels_dbc.empty() && !request.wheel_signals.empty();
  if (!request.can_interface.empty() && !names_wheels)
    throw InputError("--can: expected --wheels-dbc and --wheel-signals with it, which say what to send");
  if (request.can_interface.empty() && (!request.wheels_dbc.empty() || !request.wheel_signals.empty()))
    throw InputError("--wheels-dbc, --wheel-signals: expected --can with them");
}

void run_stream(const StreamRequest& request, simulate::Simulation* simulation) {
  const simulate::StopSignals signals;
  const StreamSinks sinks = open_sinks(request, *simulation);
  std::FILE* const out = request.output == "-" ? stderr : stdout;  // standard output may be the log
  simulate::FramesAhead frames(simulate::renderer_of(simulation), simulation->frames(), kFramesAhead);
  simulate::MonotonicClock clock;
  simulate::StreamResult result;
  {
    Progress progress(simulation->description().name, static_cast<std::size_t>(simulation->frames()));
    simulate::StreamOptions options;
    options.pace = request.pace;
    options.stop = [] { return simulate::StopSignals::received() != 0; };
    options.started = [&](std::int64_t start_us) { print_start(out, *simulation, request.pace, start_us); };
    options.progress = [&](std::int64_t done) { progress.advance(static_cast<std::size_t>(done)); };
    try {
      result = simulate::stream(*simulation, &frames, sinks, &clock, options);
    } catch (const RunError& error) {
      std::string text = error.what();
      for (const auto& sink : sinks) text += sink->abandon();
      throw RunError(text);
    }
  }
  print_end(out, *simulation, result, sinks);
}

}  // namespace farpoint::tools
