// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/evaluate/statistics.h"
#include "tools/report/histogram.h"
#include "tools/report/html.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

// No stage of the messages: what the process used besides the stages that a threaded run measures.
constexpr int kAllElse = -1;

struct Stage {
  int index;
  const char* name;
};
constexpr std::array kStages = {
    Stage{timing_t::STAGE_DECODE, "decode"},        Stage{timing_t::STAGE_TRACKING, "tracking, all"},
    Stage{timing_t::STAGE_PYRAMID, "  pyramid"},    Stage{timing_t::STAGE_EXTRACTION, "  extraction"},
    Stage{timing_t::STAGE_MATCHING, "  matching"},  Stage{timing_t::STAGE_ALIGNMENT, "  alignment"},
    Stage{timing_t::STAGE_POSE, "  pose"},          Stage{timing_t::STAGE_KEYFRAME, "  keyframe"},
    Stage{timing_t::STAGE_MAPPING, "mapping, all"}, Stage{timing_t::STAGE_TRIANGULATION, "  triangulation"},
    Stage{timing_t::STAGE_FUSING, "  fusing"},      Stage{timing_t::STAGE_LOCAL_BA, "  local BA"},
    Stage{timing_t::STAGE_CULLING, "  culling"},    Stage{kAllElse, "mapping and rest"},
    Stage{timing_t::STAGE_OUTPUT, "output"}};

// CPU of the process from one frame's output to the next, without decoding, tracking and output. Empty in
// lockstep, where mapping is measured itself.
std::vector<Eigen::Vector2d> all_else_ms(const RunRecord& run) {
  std::vector<Eigen::Vector2d> points;
  if (!run.is_threaded()) return points;
  for (std::size_t i = 1; i < run.timings.size(); ++i) {
    const timing_t& t = run.timings[i];
    double ms = 1e3 * (t.process_cpu_s - run.timings[i - 1].process_cpu_s);
    for (const int stage :
         std::array<int, 3>{timing_t::STAGE_DECODE, timing_t::STAGE_TRACKING, timing_t::STAGE_OUTPUT})
      ms -= std::max(t.cpu_ms[stage], 0.0);
    points.emplace_back(seconds_of(t.utime) - run.start_s, std::max(ms, 0.0));
  }
  return points;
}

std::vector<double> times_ms(const RunRecord& run, int stage) {
  std::vector<double> values;
  if (stage == kAllElse) {
    const std::vector<Eigen::Vector2d> points = all_else_ms(run);
    values.reserve(points.size());
    for (const Eigen::Vector2d& p : points) values.push_back(p.y());
    return values;
  }
  for (const timing_t& t : run.timings) {
    if (t.cpu_ms[stage] >= 0.0) values.push_back(t.cpu_ms[stage]);
  }
  return values;
}

double deadline_ms(const Runs& runs) {
  for (const RunRecord& run : runs) {
    for (const timing_t& t : run.timings) {
      if (t.deadline_ms > 0.0) return t.deadline_ms;
    }
  }
  return 0.0;
}

void mark_deadline(const Runs& runs, double high_ms, Plot* plot) {
  const double deadline = deadline_ms(runs);
  if (deadline > 0.0 && deadline < 4.0 * high_ms)
    plot->mark_x("deadline, " + number(deadline, 0) + " ms", deadline, {"#000", "3 3", 1.5});
}

std::vector<Eigen::Vector2d> tracking_points(const RunRecord& run) {
  std::vector<Eigen::Vector2d> points;
  for (const timing_t& t : run.timings) {
    const double ms = t.cpu_ms[timing_t::STAGE_TRACKING];
    if (ms >= 0.0) points.emplace_back(seconds_of(t.utime) - run.start_s, ms);
  }
  return points;
}

// One line of steps a run; the axis ends near the longest time. `label`: text of a run, from its times.
template <typename Times, typename Label>
std::string time_histogram(const Runs& runs, const char* title, const char* axis, Times&& times_of,
                           Label&& label) {
  std::vector<std::vector<double>> times;
  double high_ms = 0.0;
  for (const RunRecord& run : runs) {
    times.push_back(times_of(run));
    if (!times.back().empty()) high_ms = std::max(high_ms, percentile(times.back(), 99.8));
  }
  if (high_ms <= 0.0) return {};
  const std::vector<double> bins = edges(0.0, 1.05 * high_ms, 60);
  Plot plot({title, {axis}, {"frames, %"}, false, 520, 320});
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (!times[i].empty())
      plot.steps(label(runs[i], times[i]), bins, shares_percent(times[i], bins), run_style(i));
  mark_deadline(runs, high_ms, &plot);
  return plot.svg();
}

std::string tracking_histogram(const Runs& runs) {
  return time_histogram(
      runs, "Tracking, CPU time a frame", "CPU time, ms",
      [](const RunRecord& run) { return times_ms(run, timing_t::STAGE_TRACKING); },
      [](const RunRecord& run, const std::vector<double>& /*ms*/) { return run.name; });
}

std::string latency_histogram(const Runs& runs) {
  const auto latencies_ms = [](const RunRecord& run) {
    std::vector<double> latencies;
    for (const timing_t& t : run.timings)
      if (t.latency_ms >= 0.0) latencies.push_back(t.latency_ms);
    return latencies;
  };
  return time_histogram(runs, "Latency, mid-exposure to output", "latency, ms", latencies_ms,
                        [](const RunRecord& run, const std::vector<double>& ms) {
                          const double most = *std::max_element(ms.begin(), ms.end());
                          return run.name + ", most " + number(most, 1) + " ms";
                        });
}

// Means of about a second, so that frames with a keyframe and those without do not make a band.
std::vector<Eigen::Vector2d> means_of_a_second(const std::vector<Eigen::Vector2d>& points) {
  std::vector<Eigen::Vector2d> means;
  for (std::size_t begin = 0; begin < points.size();) {
    std::size_t end = begin;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (; end < points.size() && points[end].x() < points[begin].x() + 1.0; ++end) sum += points[end];
    if (end == begin) break;  // not a time
    means.emplace_back(sum / static_cast<double>(end - begin));
    begin = end;
  }
  return means;
}

std::string load_over_time(const Runs& runs) {
  Plot plot({"CPU time a frame, mean of a second",
             {"time since the first frame, s"},
             {"CPU time, ms a frame", false, 0.0},
             false,
             520,
             320});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::vector<Eigen::Vector2d> all_else = means_of_a_second(all_else_ms(runs[i]));
    if (all_else.empty()) continue;
    plot.line(runs[i].name + ", tracking", means_of_a_second(tracking_points(runs[i])), run_style(i));
    plot.line(runs[i].name + ", mapping and rest", all_else, thin_run_style(i));
  }
  return plot.svg();
}

// Times in their own order: CPU time of tracking frame by frame.
std::string tracking_over_time(const Runs& runs) {
  Plot plot({"Tracking over time", {"time since the first frame, s"}, {"CPU time, ms"}, false, 520, 320});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::vector<Eigen::Vector2d> points = tracking_points(runs[i]);
    Style style = run_style(i);
    style.width_px = 1.0;
    if (!points.empty()) plot.line(runs[i].name, points, style);
  }
  return plot.svg();
}

// Bars from 0 to the median, a whisker to the 99th percentile; one group a stage, one bar a run.
std::string stage_bars(const Runs& runs) {
  constexpr double kLeft_px = 120, kWidth_px = 1080, kBar_px = 8, kGap_px = 8, kTop_px = 30;
  double high = 0.0;
  std::size_t stages = 0;
  for (const Stage& stage : kStages) {
    bool ran = false;
    for (const RunRecord& run : runs) {
      const std::vector<double> ms = times_ms(run, stage.index);
      if (ms.empty()) continue;
      high = std::max(high, percentile(ms, 99.0));
      ran = true;
    }
    stages += ran ? 1U : 0U;
  }
  if (stages == 0) return {};
  const double deadline = deadline_ms(runs);
  // The deadline belongs into the picture as long as it does not flatten the bars.
  if (deadline > 0.0 && deadline < 2.0 * high) high = std::max(high, deadline);
  high *= 1.04;
  const double group = kBar_px * static_cast<double>(runs.size()) + kGap_px;
  const double bottom = kTop_px + group * static_cast<double>(stages);
  const auto at = [&](double ms) { return kLeft_px + (kWidth_px - kLeft_px - 20.0) * std::sqrt(ms / high); };
  Svg svg(kWidth_px, bottom + 46.0 + 17.0 * std::ceil(static_cast<double>(runs.size()) / 4.0));
  svg.text({kLeft_px, 18}, "Stages: bar to the median, line to the 99th percentile (square-root axis)",
           Anchor::kStart, "class=\"title\"");
  for (const double ms : {0.0, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0}) {
    if (ms > high) break;
    svg.line({at(ms), kTop_px}, {at(ms), bottom}, "class=\"grid\"");
    svg.text({at(ms), bottom + 15}, number(ms, 1), Anchor::kMiddle);
  }
  svg.text({0.5 * (kLeft_px + kWidth_px), bottom + 32}, "CPU time, ms", Anchor::kMiddle);
  double y = kTop_px;
  for (const Stage& stage : kStages) {
    bool ran = false;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::vector<double> ms = times_ms(runs[i], stage.index);
      if (ms.empty()) continue;
      ran = true;
      const double middle = y + 0.5 * kGap_px + (static_cast<double>(i) + 0.5) * kBar_px;
      const Style style = run_style(i);
      svg.rectangle({kLeft_px, middle - 0.5 * kBar_px + 1.0},
                    {std::max(at(percentile(ms, 50.0)) - kLeft_px, 0.8), kBar_px - 2.0},
                    "fill=\"" + style.colour + "\" fill-opacity=\"" + (i % 2 == 0 ? "0.95" : "0.55") + "\"");
      svg.line({at(percentile(ms, 50.0)), middle}, {at(percentile(ms, 99.0)), middle},
               stroke({style.colour, style.dash, 1.4}));
    }
    if (!ran) continue;
    svg.text({stage.name[0] == ' ' ? 22.0 : 6.0, y + 0.5 * group + 4.0}, stage.name, Anchor::kStart);
    y += group;
  }
  if (deadline > 0.0 && deadline <= high) {
    svg.line({at(deadline), kTop_px}, {at(deadline), bottom}, stroke({"#000", "3 3", 1.5}));
    svg.text({at(deadline) - 4, kTop_px + 10}, "deadline", Anchor::kEnd);
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::size_t row = i / 4, column = i % 4;
    const Eigen::Vector2d corner(kLeft_px + 230.0 * static_cast<double>(column),
                                 bottom + 42.0 + 17.0 * static_cast<double>(row));
    svg.rectangle(
        corner, {22, 8},
        "fill=\"" + run_style(i).colour + "\" fill-opacity=\"" + (i % 2 == 0 ? "0.95" : "0.55") + "\"");
    svg.text(corner + Eigen::Vector2d(28, 8), runs[i].name, Anchor::kStart);
  }
  return svg.finish("CPU time of each stage");
}

}  // namespace

std::string timing_section(const Runs& runs) {
  const std::string histogram = tracking_histogram(runs), bars = stage_bars(runs);
  if (histogram.empty() && bars.empty()) return {};
  return section(
      "Timing",
      "CPU time of the thread that did the work. Tracking runs from the grey image to the pose handed to the "
      "output. In a threaded run mapping works beside it: its stages are of one keyframe as a rule, of those "
      "that were done since the frame before; 'mapping and rest' is the CPU time of the process without "
      "decoding, tracking and output.",
      row_of({histogram, tracking_over_time(runs), latency_histogram(runs), load_over_time(runs), bars}));
}

}  // namespace farpoint::tools::report
