// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/run_summary.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

double percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

// Where the results of the run are not known: maps made so far.
std::size_t maps_of(const RunEnd& end) {
  return end.trajectories.empty() ? end.counts.maps : end.trajectories.size();
}

std::string initialised_text(const RunEnd& end) {
  if (end.initialised_utime < 0) return "";
  return fmt::format("initialised after {:.1f} s, ",
                     1e-6 * static_cast<double>(end.initialised_utime - end.first_utime));
}

const char* outcome(const RunEnd& end) {
  if (maps_of(end) == 0) return "done, never initialised";
  if (end.last.state == slam::State::kLost || end.last.state == slam::State::kRelocalising)
    return "done, lost at the end";
  return "done";
}

std::string scale_text(const slam::FrameResult& last) {
  switch (last.scale) {
    case slam::ScaleState::kUnknown:
      return "unknown";
    case slam::ScaleState::kAssumed:
      return "assumed";
    case slam::ScaleState::kMetric:
      return last.metre == slam::MetreSource::kWheels ? "metric by wheels" : "metric by two cameras";
  }
  return "unknown";
}

const char* wheels_text(const slam::FrameResult& last) {
  return last.wheels == slam::WheelTrust::kContradicted ? ", wheels contradict the images" : "";
}

// What was refused, where anything was.
std::string refused_text(const InputCounts& in, std::int64_t frames_dropped) {
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
  if (frames_dropped > 0) text += fmt::format("; dropped {} frames, tracking was behind", frames_dropped);
  return text;
}

// What a map of fixed size lost, where anything was.
std::string forgotten_text(const slam::EstimatorCounts& counts) {
  if (counts.mapping.keyframes_forgotten == 0) return "";
  return fmt::format("; the full map forgot {} keyframes and {} landmarks",
                     counts.mapping.keyframes_forgotten, counts.mapping.landmarks_forgotten);
}

// Why most poses were not valid, where the run ended without one or fewer than half were.
std::string reason_text(const RunEnd& end) {
  if (end.frames == 0 || (slam::is_valid(end.last.state) && 2 * end.frames_valid >= end.frames)) return "";
  const auto most = std::max_element(end.refused.begin(), end.refused.end());
  const auto index = static_cast<std::size_t>(most - end.refused.begin());
  std::array<char, ipc::kReasonText> buffer;
  const slam::Refusal& numbers = end.refusals.at(index);
  const std::string_view text =
      ipc::reason_text(static_cast<ipc::Reason>(index), numbers.value, numbers.wanted, buffer);
  return fmt::format("; {} frames without a valid pose: {}", *most, text);
}

const char* calibration_text(const RunEnd& end) {
  return end.counts.mapping.calibration_contradicted ? "; the images contradict the calibration" : "";
}

}  // namespace

std::string last_line(const RunEnd& end, const InputCounts& in, std::int64_t frames_dropped,
                      std::vector<double> cpu_ms, const std::vector<std::string>& written) {
  std::sort(cpu_ms.begin(), cpu_ms.end());
  double sum_ms = 0.0;
  for (const double ms : cpu_ms) sum_ms += ms;
  const std::size_t maps = maps_of(end);
  constexpr double kMegabyte = 1e6;
  return fmt::format(
      "farpointd: {}: {} frames, {} tracked ({:.1f} %), {}{} map{}, lost {} time{}, scale {}{}; {:.1f} ms a "
      "frame (CPU "
      "mean, p99 {:.1f}); peak memory {:.0f} MB{}{}{}{}{}{}",
      outcome(end), end.frames, end.frames_valid, percent(end.frames_valid, end.frames),
      initialised_text(end), maps, maps == 1 ? "" : "s", end.counts.lost, end.counts.lost == 1 ? "" : "s",
      scale_text(end.last), wheels_text(end.last),
      cpu_ms.empty() ? 0.0 : sum_ms / static_cast<double>(cpu_ms.size()), quantile(cpu_ms, 0.99),
      static_cast<double>(peak_resident_bytes()) / kMegabyte, reason_text(end), forgotten_text(end.counts),
      calibration_text(end), refused_text(in, frames_dropped), written.empty() ? "" : "; wrote ",
      fmt::join(written, " "));
}

std::FILE* line_stream(const Options& o) {
  for (const std::string* path : {&o.output, &o.trajectory, &o.live_trajectory, &o.can_log}) {
    if (*path == "-") return stderr;
  }
  return stdout;
}

void show_progress(double fraction, const slam::FrameResult& last, std::int64_t frames, Progress* progress) {
  progress->show(fraction, fmt::format("frame {}, {}, {} landmarks agree", frames,
                                       slam::to_string(last.state), last.inliers));
}

}  // namespace farpoint::daemon
