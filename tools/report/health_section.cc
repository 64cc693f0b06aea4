// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "slam/frame_result.h"
#include "tools/report/html.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

// By slam::State, from what does not count (grey) over what does (blue) to what needs help: of falling
// lightness with falling health.
constexpr std::array kFills = {"#e8e8e8", "#d0d0d0", "#a9c7e8", "#5b92cf",
                               "#e6a14a", "#a01010", "#7a3b8f", "#000000"};

const char* fill_of(std::int8_t state) {
  const auto i = static_cast<std::size_t>(std::max<int>(state, 0));
  return kFills[std::min(i, kFills.size() - 1)];
}

double end_of(const Runs& runs) {
  double end_s = 0.0;
  for (const RunRecord& run : runs) {
    if (!run.frames.empty()) end_s = std::max(end_s, run.frames.back().time_s - run.start_s);
  }
  return end_s;
}

// Counters that should stay where they are; each rise is a fault on the time line.
struct Fault {
  const char* name;
  std::int64_t status_t::*count;
};
const std::array kFaults = {Fault{"frames dropped", &status_t::frames_dropped},
                            Fault{"keyframes dropped", &status_t::keyframes_dropped},
                            Fault{"deadlines missed", &status_t::deadlines_missed},
                            Fault{"wrong size", &status_t::images_wrong_size},
                            Fault{"undecodable images", &status_t::images_undecodable},
                            Fault{"time backwards", &status_t::times_backwards},
                            Fault{"stamps of no clock", &status_t::times_unknown},
                            Fault{"undecodable messages", &status_t::messages_undecodable},
                            Fault{"log damage", &status_t::log_damages},
                            Fault{"IMU invalid", &status_t::imu_invalid},
                            Fault{"CAN send", &status_t::can_send_errors},
                            Fault{"LCM send", &status_t::lcm_send_errors},
                            Fault{"MAVLink send", &status_t::mavlink_send_errors},
                            Fault{"log write", &status_t::log_write_errors},
                            Fault{"not recorded", &status_t::images_not_recorded},
                            Fault{"lost", &status_t::times_lost}};

void draw_states(const RunRecord& run, double top, double left, double px_per_s, Svg* svg) {
  for (std::size_t i = 0; i < run.frames.size();) {
    std::size_t end = i + 1;
    while (end < run.frames.size() && run.frames[end].state == run.frames[i].state) ++end;
    const double from = run.frames[i].time_s - run.start_s;
    const double to = run.frames[std::min(end, run.frames.size() - 1)].time_s - run.start_s;
    svg->rectangle({left + px_per_s * from, top}, {std::max(px_per_s * (to - from), 1.0), 16},
                   std::string("fill=\"") + fill_of(run.frames[i].state) + "\"");
    i = end;
  }
}

// A row of the time line: when one counter rose, and by how much in all.
struct FaultLane {
  const char* name;
  double total = 0.0;  // of a damaged log any number
  std::vector<double> times_s;
};

std::vector<FaultLane> fault_lanes(const RunRecord& run) {
  std::vector<FaultLane> lanes;
  for (const Fault& fault : kFaults) {
    FaultLane lane{fault.name, 0.0, {}};
    double before = 0.0;
    for (const status_t& status : run.statuses) {
      const double count = static_cast<double>(status.*fault.count), rise = count - before;
      before = count;
      if (rise <= 0.0) continue;
      lane.total += rise;
      lane.times_s.push_back(seconds_of(status.utime) - run.start_s);
    }
    if (lane.total > 0.0) lanes.push_back(std::move(lane));
  }
  return lanes;
}

constexpr double kStateRow_px = 24, kLane_px = 15;

void draw_faults(const std::vector<FaultLane>& lanes, double top, double left, double px_per_s, Svg* svg) {
  for (const FaultLane& lane : lanes) {
    svg->text({left - 8, top + 11}, number(lane.total, 0) + " " + lane.name, Anchor::kEnd);
    for (const double t : lane.times_s) {
      const double x = left + px_per_s * t;
      svg->line({x, top + 1}, {x, top + 12}, "stroke=\"#000\" stroke-width=\"1.2\"");
    }
    top += kLane_px;
  }
}

std::string time_line(const Runs& runs) {
  constexpr double kLeft_px = 190, kWidth_px = 1080, kTop_px = 12;
  const double end_s = end_of(runs);
  if (end_s <= 0.0) return {};
  const double px_per_s = (kWidth_px - kLeft_px - 20.0) / end_s;
  std::vector<std::vector<FaultLane>> faults;
  double bottom = kTop_px;
  for (const RunRecord& run : runs) {
    faults.push_back(fault_lanes(run));
    bottom += kStateRow_px + kLane_px * static_cast<double>(faults.back().size());
  }
  Svg svg(kWidth_px, bottom + 62);
  for (const double t : ticks(0.0, end_s, 12, false)) {
    const double x = kLeft_px + px_per_s * t;
    svg.line({x, kTop_px}, {x, bottom}, "class=\"grid\"");
    svg.text({x, bottom + 13}, number(t, 1), Anchor::kMiddle);
  }
  svg.text({0.5 * (kLeft_px + kWidth_px), bottom + 29}, "time since the first frame, s", Anchor::kMiddle);
  double top = kTop_px;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    svg.text({kLeft_px - 8, top + 13}, runs[i].name, Anchor::kEnd, "class=\"title\"");
    draw_states(runs[i], top, kLeft_px, px_per_s, &svg);
    draw_faults(faults[i], top + 20, kLeft_px, px_per_s, &svg);
    top += kStateRow_px + kLane_px * static_cast<double>(faults[i].size());
  }
  double x = kLeft_px - 60;
  for (std::size_t i = 0; i < kFills.size(); ++i) {
    svg.rectangle({x, bottom + 40}, {14, 12}, std::string("fill=\"") + kFills[i] + "\" stroke=\"#333\"");
    svg.text({x + 18, bottom + 50}, slam::to_string(static_cast<slam::State>(i)), Anchor::kStart);
    x += 112;
  }
  return svg.finish("States and faults over time");
}

template <typename Message, typename Figure>
std::vector<Eigen::Vector2d> over_time(const RunRecord& run, const std::vector<Message>& messages,
                                       Figure&& figure) {
  std::vector<Eigen::Vector2d> points;
  points.reserve(messages.size());
  for (const Message& m : messages)
    points.emplace_back(seconds_of(m.utime) - run.start_s, static_cast<double>(figure(m)));
  return points;
}

std::string memory_view(const Runs& runs) {
  Plot plot({"Memory", {"time since the first frame, s"}, {"MB", false, 0.0}, false, 520, 300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto resident = over_time(runs[i], runs[i].timings, [](const timing_t& t) {
      return 1e-6 * static_cast<double>(t.resident_bytes);
    });
    if (!resident.empty()) plot.line(runs[i].name + ", resident", resident, run_style(i));
    const Style thin = thin_run_style(i);
    const auto pools = over_time(runs[i], runs[i].statuses, [](const status_t& s) {
      return 1e-6 * static_cast<double>(s.memory_pool_bytes);
    });
    if (!pools.empty()) plot.line(runs[i].name + ", pools", pools, thin);
  }
  return plot.svg();
}

std::string queue_view(const Runs& runs) {
  Plot plot({"Queues: most entries that waited so far",
             {"time since the first frame, s"},
             {"entries", false, 0.0},
             false,
             520,
             300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Style thin = thin_run_style(i);
    if (runs[i].statuses.empty() || !runs[i].is_threaded()) continue;
    plot.line(runs[i].name + ", to tracking",
              over_time(runs[i], runs[i].statuses, [](const status_t& s) { return s.capture_queue_max; }),
              run_style(i));
    plot.line(runs[i].name + ", to mapping",
              over_time(runs[i], runs[i].statuses, [](const status_t& s) { return s.mapping_queue_max; }),
              thin);
  }
  return plot.svg();
}

std::string map_size_view(const Runs& runs) {
  Plot plot({"Size of the map",
             {"time since the first frame, s"},
             {"landmarks alive, all maps", false, 0.0},
             false,
             520,
             300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].statuses.empty()) continue;
    plot.line(runs[i].name + ", points",
              over_time(runs[i], runs[i].statuses, [](const status_t& s) { return map_counts(s).points; }),
              run_style(i));
    const Style thin = thin_run_style(i);
    plot.line(runs[i].name + ", VMPs",
              over_time(runs[i], runs[i].statuses, [](const status_t& s) { return map_counts(s).vmps; }),
              thin);
  }
  return plot.svg();
}

std::string match_view(const Runs& runs) {
  Plot plot({"Matches that the pose rests on",
             {"time since the first frame, s"},
             {"inliers a frame", false, 0.0},
             false,
             520,
             300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<Eigen::Vector2d> points;
    for (const PublishedFrame& f : runs[i].frames) points.emplace_back(f.time_s - runs[i].start_s, f.inliers);
    Style style = run_style(i);
    style.width_px = 1.1;
    if (!points.empty()) plot.line(runs[i].name, points, style);
  }
  return plot.svg();
}

}  // namespace

std::string health_section(const Runs& runs) {
  const std::string states = time_line(runs);
  if (states.empty()) return {};
  return section(
      "States, faults, queues, memory",
      "State of each published frame; below it, one row a kind of fault: a black line where a status message "
      "said that its counter had risen. Points have a depth, virtual map points (VMPs) have none yet; "
      "landmarks are "
      "both. Queues are those of a threaded run.",
      row_of({states, match_view(runs), map_size_view(runs), queue_view(runs), memory_view(runs)}));
}

}  // namespace farpoint::tools::report
