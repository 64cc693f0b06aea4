#include "tools/evaluate/run_times.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstddef>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

constexpr std::size_t kFewestFrames = 400;

double median_period_ms(const std::vector<TimedFrame>& frames) {
  std::vector<double> periods_ms;
  for (std::size_t i = 1; i < frames.size(); ++i)
    periods_ms.push_back(1e-3 * static_cast<double>(frames[i].utime - frames[i - 1].utime));
  return percentile(std::move(periods_ms), 50.0);
}

double tracking_p99_ms(const std::vector<TimedFrame>& frames, std::size_t from, std::size_t to) {
  std::vector<double> times_ms;
  for (std::size_t i = from; i < to; ++i) {
    if (frames[i].tracking_cpu_ms >= 0.0) times_ms.push_back(frames[i].tracking_cpu_ms);
  }
  return percentile(std::move(times_ms), 99.0);
}

}  // namespace

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
  metrics.second_twentieth_p99_ms = tracking_p99_ms(frames, n / 20, n / 10);
  metrics.last_twentieth_p99_ms = tracking_p99_ms(frames, n - n / 20, n);
  metrics.tenth_mb = frames[n / 10 - 1].resident_mb;
  metrics.half_mb = frames[n / 2 - 1].resident_mb;
  metrics.end_mb = frames[n - 1].resident_mb;
  return metrics;
}

std::string latency_text(const std::string& name, const LatencyMetrics& m) {
  return fmt::format(
      "{} latency: p50_ms={:.2f} p99_ms={:.2f} max_ms={:.1f} beyond_tracking_p50_ms={:.2f} "
      "beyond_tracking_p99_ms={:.2f} frame_period_ms={:.1f} later_than_a_frame={}\n",
      name, m.p50_ms, m.p99_ms, m.max_ms, m.beyond_tracking_p50_ms, m.beyond_tracking_p99_ms,
      m.frame_period_ms, m.later_than_a_frame);
}

std::string steadiness_text(const std::string& name, const SteadinessMetrics& m) {
  return fmt::format(
      "{} steadiness: tracking_p99_ms second twentieth {:.2f}, last {:.2f}; "
      "resident_mb after a tenth {:.1f}, half {:.1f}, all {:.1f}\n",
      name, m.second_twentieth_p99_ms, m.last_twentieth_p99_ms, m.tenth_mb, m.half_mb, m.end_mb);
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
