// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/run_times.h"

#include <algorithm>
#include <cstddef>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

constexpr std::size_t kFewestFrames = 400;

double median_period_ms(const std::vector<TimedFrame>& frames) {
  std::vector<double> periods_ms;
  for (std::size_t i = 1; i < frames.size(); ++i)
    periods_ms.push_back(1e-3 *
                         (static_cast<double>(frames[i].utime) - static_cast<double>(frames[i - 1].utime)));
  return percentile(std::move(periods_ms), 50.0);
}

double tracking_p99_ms(std::span<const TimedFrame> frames) {
  return percentile(tracking_times_ms(frames), 99.0);
}

}  // namespace

std::vector<double> tracking_times_ms(std::span<const TimedFrame> frames) {
  std::vector<double> times_ms;
  for (const TimedFrame& frame : frames) {
    if (frame.tracking_cpu_ms >= 0.0) times_ms.push_back(frame.tracking_cpu_ms);
  }
  return times_ms;
}

std::optional<LatencyMetrics> measure_latency(const std::vector<TimedFrame>& frames) {
  LatencyMetrics metrics;
  metrics.frame_period_ms = median_period_ms(frames);
  std::vector<double> latency_ms, beyond_ms;
  for (const TimedFrame& frame : frames) {
    if (frame.latency_ms < 0.0) continue;
    latency_ms.push_back(frame.latency_ms);
    if (frame.tracking_wall_ms >= 0.0) beyond_ms.push_back(frame.latency_ms - frame.tracking_wall_ms);
    if (frame.latency_ms > metrics.frame_period_ms) ++metrics.later_than_a_frame;
  }
  if (latency_ms.empty()) return std::nullopt;
  metrics.p50_ms = percentile(latency_ms, 50.0);
  metrics.p99_ms = percentile(latency_ms, 99.0);
  metrics.max_ms = *std::max_element(latency_ms.begin(), latency_ms.end());
  metrics.beyond_tracking_p50_ms = percentile(beyond_ms, 50.0);
  metrics.beyond_tracking_p99_ms = percentile(beyond_ms, 99.0);
  return metrics;
}

std::optional<SteadinessMetrics> measure_steadiness(const std::vector<TimedFrame>& frames) {
  const std::size_t n = frames.size();
  if (n < kFewestFrames) return std::nullopt;
  SteadinessMetrics metrics;
  metrics.second_twentieth_p99_ms = tracking_p99_ms(std::span(frames).subspan(n / 20, n / 10 - n / 20));
  metrics.last_twentieth_p99_ms = tracking_p99_ms(std::span(frames).last(n / 20));
  metrics.tenth_mb = frames[n / 10 - 1].resident_mb;
  metrics.half_mb = frames[n / 2 - 1].resident_mb;
  metrics.end_mb = frames[n - 1].resident_mb;
  return metrics;
}

Json to_json(const LatencyMetrics& metrics) {
  Json json = Json::object();
  json.set("p50_ms", metrics.p50_ms);
  json.set("p99_ms", metrics.p99_ms);
  json.set("max_ms", metrics.max_ms);
  json.set("beyond_tracking_p50_ms", metrics.beyond_tracking_p50_ms);
  json.set("beyond_tracking_p99_ms", metrics.beyond_tracking_p99_ms);
  json.set("frame_period_ms", metrics.frame_period_ms);
  json.set("later_than_a_frame", metrics.later_than_a_frame);
  return json;
}

Json to_json(const SteadinessMetrics& metrics) {
  Json json = Json::object();
  json.set("second_twentieth_p99_ms", metrics.second_twentieth_p99_ms);
  json.set("last_twentieth_p99_ms", metrics.last_twentieth_p99_ms);
  json.set("tenth_mb", metrics.tenth_mb);
  json.set("half_mb", metrics.half_mb);
  json.set("end_mb", metrics.end_mb);
  return json;
}

}  // namespace farpoint::tools
