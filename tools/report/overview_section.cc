// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tools/evaluate/statistics.h"
#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/svg.h"

namespace farpoint::tools::report {
namespace {

constexpr char kNone[] = "-";

std::string text(const std::optional<double>& value, int digits) {
  return value ? number(*value, digits) : kNone;
}

std::string ate(const std::optional<TrajectoryMetrics>& metrics) {
  return metrics && metrics->absolute ? number(metrics->absolute->rmse_m, 3) : kNone;
}

std::optional<double> tracked_percent(const RunRecord& run) {
  const summary_t* s = run.summary();
  if (s == nullptr || s->frames <= 0) return std::nullopt;
  return 100.0 * static_cast<double>(s->frames_valid) / static_cast<double>(s->frames);
}

std::string peak_memory(const RunRecord& run) {
  std::int64_t peak = 0;
  for (const timing_t& t : run.timings) peak = std::max(peak, t.peak_resident_bytes);
  return peak > 0 ? number(static_cast<double>(peak) / 1e6, 0) : kNone;
}

std::vector<std::string> row(const RunRecord& run) {
  const RunMetrics* m = run.metrics ? &*run.metrics : nullptr;
  const summary_t* s = run.summary();
  const std::vector<double> tracking_ms =
      run.run.log ? tracking_times_ms(run.run.log->timed_frames) : std::vector<double>{};
  const auto depth = [&](auto&& figure) { return m && m->depth ? number(figure(*m->depth), 1) : kNone; };
  const auto rpe = [&](auto&& figure, int digits) {
    return m && m->final_metrics.segments ? number(figure(*m->final_metrics.segments), digits) : kNone;
  };
  return {
      run.name,
      s ? s->landmark_mode : kNone,
      s ? std::to_string(s->frames) : kNone,
      text(tracked_percent(run), 1),
      text(run.own.first_valid_s, 1),
      text(run.own.longest_blind_s, 2),
      s ? std::to_string(s->times_lost) : kNone,
      s ? std::to_string(s->reset_counter) : kNone,
      number(run.scale() * run.own.final_path.length, 1),
      m ? number(100.0 * m->final_metrics.share, 1) : kNone,
      m ? ate(m->final_metrics) : kNone,
      m ? ate(m->live_metrics) : kNone,
      rpe([](const SegmentError& e) { return e.translation_percent; }, 2),
      rpe([](const SegmentError& e) { return e.rotation_deg_per_m; }, 4),
      m && m->final_metrics.absolute ? number(m->final_metrics.absolute->scale, 4) : kNone,
      depth([](const DepthMetrics& d) { return d.triangulation_m.p50; }),
      depth([](const DepthMetrics& d) { return d.triangulation_m.p90; }),
      depth([](const DepthMetrics& d) { return d.over_100_m_percent; }),
      s && s->landmarks_made > 0
          ? number(100.0 * static_cast<double>(s->vmp_promoted) / static_cast<double>(s->landmarks_made), 1)
          : kNone,
      s && !s->maps.empty() ? std::to_string(s->maps.front().landmarks) : kNone,
      number(percentile(tracking_ms, 50.0), 1),
      number(percentile(tracking_ms, 99.0), 1),
      peak_memory(run)};
}

// Without the columns in which no run has a figure.
std::vector<std::vector<std::string>> without_empty_columns(
    const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::vector<std::string>> kept(rows.size());
  for (std::size_t c = 0; c < rows.front().size(); ++c) {
    const bool has_figure =
        std::any_of(rows.begin() + 1, rows.end(), [c](const auto& row) { return row[c] != kNone; });
    for (std::size_t r = 0; has_figure && r < rows.size(); ++r) kept[r].push_back(rows[r][c]);
  }
  return kept;
}

}  // namespace

std::string overview_section(const Runs& runs) {
  if (runs.empty()) return {};
  std::vector<std::vector<std::string>> rows = {{"run",
                                                 "mode",
                                                 "frames",
                                                 "valid %",
                                                 "first valid after s",
                                                 "longest blind s",
                                                 "lost",
                                                 "resets",
                                                 "final path " + runs[0].length_unit(),
                                                 "final share %",
                                                 "final ATE m",
                                                 "live ATE m",
                                                 "RPE %",
                                                 "RPE deg/m",
                                                 "scale",
                                                 "depth p50 m",
                                                 "depth p90 m",
                                                 "> 100 m %",
                                                 "VMP %",
                                                 "points",
                                                 "tracking p50 ms",
                                                 "p99 ms",
                                                 "peak MB"}};
  for (const RunRecord& run : runs) rows.push_back(row(run));
  std::string how =
      "final: every frame's pose after the last optimisation; live: as published when the frame came. blind: "
      "without a new valid pose, after the first one. points: landmarks with a depth, of the map with most "
      "frames; "
      "VMP %: of all points made, those made through a virtual map point. Tracking: CPU time of the tracking "
      "thread, image to pose.";
  if (runs[0].metrics)
    how += std::string(" ATE is the RMS position error after alignment by ") +
           to_string(runs[0].metrics->alignment) +
           ", RPE the relative error over 100 to 800 m. depth: of points when they were made, claimed sigma "
           "under "
           "30 %.";
  return section("Overview", how, table(without_empty_columns(rows)));
}

}  // namespace farpoint::tools::report
