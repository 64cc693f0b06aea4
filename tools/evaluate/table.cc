// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

constexpr const char* kAbsent = "-";

std::string decimal(double value, int digits) {
  if (!std::isfinite(value)) return kAbsent;
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

template <typename T>
std::string integer(const std::optional<T>& value) {
  return value ? std::to_string(*value) : kAbsent;
}

std::string spread_text(const std::optional<DepthMetrics>& depth, Spread DepthMetrics::*which) {
  if (!depth) return kAbsent;
  const Spread& s = (*depth).*which;
  if (s.count == 0) return kAbsent;
  return decimal(s.p50, 1) + " (" + decimal(s.p10, 1) + "/" + decimal(s.p90, 1) + ")";
}

// The same keys and digits as the independent check, then the relative errors.
std::string trajectory_text(const TrajectoryMetrics& metrics) {
  std::string text = "n=" + std::to_string(metrics.paired) + " share=" + decimal(metrics.share, 4);
  if (!metrics.absolute) return text + " lost: fewer than 3 poses can be compared with truth";
  const AbsoluteError& a = *metrics.absolute;
  text += " path_m=" + decimal(a.path_m, 2) + " scale=" + decimal(a.scale, 5) +
          " ate_rmse_m=" + decimal(a.rmse_m, 4) + " ate_median_m=" + decimal(a.median_m, 4) +
          " ate_max_m=" + decimal(a.max_m, 4) + " ate_percent=" + decimal(a.percent, 3);
  if (metrics.segments) {
    text += " rpe_translation_percent=" + decimal(metrics.segments->translation_percent, 3) +
            " rpe_rotation_deg_per_m=" + decimal(metrics.segments->rotation_deg_per_m, 5);
  }
  if (metrics.one_second) {
    const OneSecondError& o = *metrics.one_second;
    text += " rpe_1s_translation_m=" + decimal(o.translation_rmse_m, 4) +
            " rpe_1s_rotation_deg=" + decimal(o.rotation_rmse_deg, 3) +
            " max_1s_translation_m=" + decimal(o.translation_max_m, 4) +
            " max_1s_rotation_deg=" + decimal(o.rotation_max_deg, 3);
  }
  return text;
}

std::string segment_text(const SegmentScale& segment) {
  std::string text = "frames " + std::to_string(segment.range.from) + ":" + std::to_string(segment.range.to) +
                     " n=" + std::to_string(segment.paired);
  text += " scale=" + (segment.scale ? decimal(*segment.scale, 5) : kAbsent);
  if (segment.ratio_to_first) text += " ratio_to_first=" + decimal(*segment.ratio_to_first, 4);
  return text;
}

std::string latency_text(const LatencyMetrics& m) {
  return "p50_ms=" + decimal(m.p50_ms, 2) + " p99_ms=" + decimal(m.p99_ms, 2) +
         " max_ms=" + decimal(m.max_ms, 1) +
         " beyond_tracking_p50_ms=" + decimal(m.beyond_tracking_p50_ms, 2) +
         " beyond_tracking_p99_ms=" + decimal(m.beyond_tracking_p99_ms, 2) +
         " frame_period_ms=" + decimal(m.frame_period_ms, 1) +
         " later_than_a_frame=" + std::to_string(m.later_than_a_frame);
}

std::string steadiness_text(const SteadinessMetrics& m) {
  return "tracking_p99_ms second twentieth " + decimal(m.second_twentieth_p99_ms, 2) + ", last " +
         decimal(m.last_twentieth_p99_ms, 2) + "; resident_mb after a tenth " + decimal(m.tenth_mb, 1) +
         ", half " + decimal(m.half_mb, 1) + ", all " + decimal(m.end_mb, 1);
}

std::string ate_text(const TrajectoryMetrics& metrics) {
  return metrics.absolute ? decimal(metrics.absolute->rmse_m, 4) : "lost";
}

struct Column {
  const char* group;
  const char* title;
};

constexpr std::array kColumns = {
    Column{"", "run"},
    Column{"", "images"},
    Column{"tracked", "%"},
    Column{"", "resets"},
    Column{"CPU time", "of"},
    Column{"mean", "ms"},
    Column{"p50", "ms"},
    Column{"p99", "ms"},
    Column{"max", "ms"},
    Column{"deadline", "misses"},
    Column{"", "align"},
    Column{"final", "share %"},
    Column{"final", "scale"},
    Column{"final", "ATE m"},
    Column{"live", "share %"},
    Column{"live", "ATE m"},
    Column{"RPE 100..800 m", "%"},
    Column{"final", "deg/m"},
    Column{"triangulation", "depth m (p10/p90)"},
    Column{"observation", "distance m (p10/p90)"},
    Column{"map", "points"},
    Column{"VMP", "%"},
};
using Row = std::vector<std::string>;

// Without truth.
constexpr std::array kOwnColumns = {
    Column{"", "run"},
    Column{"", "images"},
    Column{"tracked", "%"},
    Column{"first valid", "after s"},
    Column{"longest", "blind s"},
    Column{"times", "lost"},
    Column{"", "resets"},
    Column{"", "maps"},
    Column{"CPU time", "of"},
    Column{"mean", "ms"},
    Column{"p50", "ms"},
    Column{"p99", "ms"},
    Column{"max", "ms"},
    Column{"latency", "p99 ms"},
    Column{"deadline", "misses"},
    Column{"final", "share %"},
    Column{"final", "path"},
    Column{"of path", "unit"},
    Column{"map", "points"},
    Column{"VMP", "%"},
};

// Without a time of tracking alone the whole frame's is shown, under its name.
std::vector<std::string> time_cells(const RunMetrics& m) {
  const bool tracking_known = !m.tracking_ms.empty();
  const std::vector<double>& ms = tracking_known ? m.tracking_ms : m.frame_ms;
  const std::string slowest = ms.empty() ? kAbsent : decimal(*std::max_element(ms.begin(), ms.end()), 1);
  return {ms.empty() ? kAbsent : (tracking_known ? "tracking" : "frame"), decimal(mean(ms), 1),
          decimal(percentile(ms, 50.0), 1), decimal(percentile(ms, 99.0), 1), slowest};
}

template <typename T>
std::string decimal(const std::optional<T>& value, int digits) {
  return value ? decimal(*value, digits) : kAbsent;
}

Row own_row_of(const RunMetrics& m) {
  Row row = {m.name,
             std::to_string(m.images),
             decimal(m.tracked_percent, 1),
             decimal(m.own.first_valid_s, 2),
             decimal(m.own.longest_blind_s, 2),
             integer(m.times_lost),
             integer(m.resets),
             integer(m.maps)};
  for (std::string& cell : time_cells(m)) row.push_back(std::move(cell));
  row.push_back(m.latency ? decimal(m.latency->p99_ms, 1) : kAbsent);
  row.push_back(integer(m.deadline_misses));
  row.push_back(decimal(100.0 * m.own.final_path.share, 1));
  row.push_back(decimal(m.own.final_path.length, 1));
  row.emplace_back(m.own.length_unit);
  row.push_back(integer(m.map_points));
  row.push_back(decimal(m.vmp_percent, 2));
  return row;
}

Row row_of(const RunMetrics& m) {
  const TrajectoryMetrics& final_metrics = m.final_metrics;
  const std::optional<AbsoluteError>& absolute = final_metrics.absolute;
  const std::vector<std::string> times = time_cells(m);
  const std::optional<SegmentError>& rpe = final_metrics.segments;
  return {m.name,
          std::to_string(m.images),
          decimal(m.tracked_percent, 1),
          integer(m.resets),
          times[0],
          times[1],
          times[2],
          times[3],
          times[4],
          integer(m.deadline_misses),
          std::string(to_string(m.alignment)) + (m.planar ? " xy" : ""),
          decimal(100.0 * final_metrics.share, 1),
          absolute ? decimal(absolute->scale, 4) : kAbsent,
          ate_text(final_metrics),
          m.live_metrics ? decimal(100.0 * m.live_metrics->share, 1) : kAbsent,
          m.live_metrics ? ate_text(*m.live_metrics) : kAbsent,
          rpe ? decimal(rpe->translation_percent, 2) : kAbsent,
          rpe ? decimal(rpe->rotation_deg_per_m, 4) : kAbsent,
          spread_text(m.depth, &DepthMetrics::triangulation_m),
          spread_text(m.depth, &DepthMetrics::observation_m),
          integer(m.map_points),
          decimal(m.vmp_percent, 2)};
}

std::string truth_text(const RunMetrics& metrics) {
  if (!metrics.compared) return metrics.name + " no truth: scale of the run: " + metrics.scale_state + "\n";
  std::string text = metrics.name + " truth: compared at the " + metrics.truth_point +
                     ", scale of the run: " + metrics.scale_state + ", aligned by " +
                     to_string(metrics.alignment) + (metrics.planar ? ", x and y only" : "") + "\n";
  text += metrics.name + " final: " + trajectory_text(metrics.final_metrics) + "\n";
  if (metrics.live_metrics) text += metrics.name + " live:  " + trajectory_text(*metrics.live_metrics) + "\n";
  return text;
}

template <std::size_t N>
std::vector<Row> headed_by(const std::array<Column, N>& columns) {
  std::vector<Row> rows(2);
  for (const Column& column : columns) {
    rows[0].emplace_back(column.group);
    rows[1].emplace_back(column.title);
  }
  return rows;
}

// Names to the left, figures to the right.
std::string aligned(const std::vector<Row>& rows) {
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const Row& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  }
  std::string text;
  for (const Row& row : rows) {
    text += row[0] + std::string(width[0] - row[0].size(), ' ');
    for (std::size_t c = 1; c < row.size(); ++c)
      text += "  " + std::string(width[c] - row[c].size(), ' ') + row[c];
    text += "\n";
  }
  return text;
}

}  // namespace

std::string details_text(const RunMetrics& metrics) {
  std::string text = truth_text(metrics) + own_text(metrics.name, metrics.own);
  if (metrics.depth) {
    text += metrics.name + " depth: points=" + std::to_string(metrics.depth->triangulation_m.count) +
            " over_50_m_percent=" + decimal(metrics.depth->over_50_m_percent, 2) +
            " over_100_m_percent=" + decimal(metrics.depth->over_100_m_percent, 2) +
            " observations=" + std::to_string(metrics.depth->observation_m.count) + "\n";
  }
  if (metrics.times_lost) {
    text += metrics.name + " maps: made=" + integer(metrics.maps) +
            " times_lost=" + integer(metrics.times_lost) + "\n";
  }
  if (metrics.latency) text += metrics.name + " latency: " + latency_text(*metrics.latency) + "\n";
  if (metrics.steadiness)
    text += metrics.name + " steadiness: " + steadiness_text(*metrics.steadiness) + "\n";
  if (metrics.landmarks) text += landmarks_text(metrics.name, *metrics.landmarks);
  for (const SegmentScale& segment : metrics.segments)
    text += metrics.name + " " + segment_text(segment) + "\n";
  return text;
}

std::string table_text(const std::vector<RunMetrics>& runs) {
  const bool compared = std::any_of(runs.begin(), runs.end(), [](const RunMetrics& m) { return m.compared; });
  std::vector<Row> rows = compared ? headed_by(kColumns) : headed_by(kOwnColumns);
  for (const RunMetrics& run : runs) rows.push_back(compared ? row_of(run) : own_row_of(run));
  return aligned(rows);
}

}  // namespace farpoint::tools
