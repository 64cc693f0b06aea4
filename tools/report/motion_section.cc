// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "tools/report/html.h"
#include "tools/report/motion.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

// A quantity of a body: what runs and truth give of it, and the difference.
struct Quantity {
  std::vector<TimedVector> values, errors;
  std::string name;
  Style style;
};

struct Component {
  int index;
  const char* title;
  const char* error_title;
};
constexpr std::array kAngles = {Component{0, "Roll", "Error of roll"},
                                Component{1, "Pitch", "Error of pitch"}, Component{2, "Yaw", "Error of yaw"}};
constexpr std::array kVelocities = {Component{0, "Forward velocity", "Error of forward velocity"},
                                    Component{1, "Velocity to the left", "Error of velocity to the left"},
                                    Component{2, "Velocity upwards", "Error of velocity upwards"}};
constexpr std::array kSpeeds = {Component{0, "Speed", "Error of speed"}};

// One diagram of each component, and beside it that of its error where there is truth.
template <std::size_t N>
std::string charts(const std::array<Component, N>& components, const std::vector<Quantity>& quantities,
                   const std::string& unit, double start_s, double end_s) {
  std::vector<std::string> pictures;
  for (const Component& c : components) {
    Plot values({c.title, {"time since the first frame, s"}, {unit}, false, 520, 280});
    Plot errors({c.error_title, {"time since the first frame, s"}, {unit}, false, 520, 280});
    for (const Quantity& q : quantities) {
      values.line(q.name, component_over_time(q.values, c.index, start_s, end_s), q.style);
      if (!q.errors.empty())
        errors.line(q.name, component_over_time(q.errors, c.index, start_s, end_s), q.style);
    }
    pictures.push_back(values.svg());
    pictures.push_back(errors.svg());
  }
  return row_of(pictures);
}

// Angles within half a turn of the first curve's mean, so that one about 180 degrees does not jump.
std::vector<Quantity> attitudes(const Runs& runs, const Truth* truth) {
  std::vector<Quantity> quantities;
  const bool has_truth = truth != nullptr && truth->body.has_orientation;
  if (has_truth) quantities.push_back({attitudes_deg(truth->body), {}, "truth", truth_style()});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto add = [&](const Trajectory& in_world, const char* which, const Style& style) {
      quantities.push_back(
          {attitudes_deg(in_world),
           has_truth ? attitude_errors_deg(truth->body, in_world) : std::vector<TimedVector>{},
           runs[i].name + which, style});
    };
    add(moved_by(runs[i].world_from_map(), runs[i].run.final_trajectory), ", final", run_style(i));
    if (runs[i].run.log)
      add(moved_by(runs[i].world_from_live_map(), runs[i].live), ", live", thin_run_style(i));
  }
  const Eigen::Vector3d centre_deg = mean_angles_deg(quantities.front().values);
  for (Quantity& q : quantities) q.values = angles_around(centre_deg, std::move(q.values));
  return quantities;
}

std::vector<TimedVector> sizes_of(std::vector<TimedVector> vectors) {
  for (TimedVector& v : vectors) v.value = {v.value.norm(), 0.0, 0.0};
  return vectors;
}

// Velocities as published; in metres by the live trajectory's alignment. `as_speed`: their sizes.
std::vector<Quantity> velocities(const Runs& runs, const Truth* truth, bool as_speed) {
  std::vector<Quantity> quantities;
  const auto wanted = [&](std::vector<TimedVector> v) { return as_speed ? sizes_of(std::move(v)) : v; };
  std::vector<TimedVector> known;
  if (truth != nullptr && !runs.empty()) {
    known = wanted(velocities_of(truth_for(runs[0], *truth)));
    quantities.push_back({known, {}, "truth", truth_style()});
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<TimedVector> published;
    published.reserve(runs[i].velocities.size());
    const double scale = runs[i].world_from_live_map().scale;
    for (const PublishedVelocity& v : runs[i].velocities) published.push_back({v.time_s, scale * v.linear});
    published = wanted(std::move(published));
    quantities.push_back({published, differences(known, published), runs[i].name + ", live", run_style(i)});
  }
  return quantities;
}

}  // namespace

std::string motion_section(const Runs& runs, const Truth* truth) {
  if (runs.empty()) return {};
  double end_s = runs[0].start_s;
  for (const RunRecord& run : runs) end_s = std::max(end_s, run.end_s());
  const bool as_speed = truth != nullptr && !truth->body.has_orientation;
  const std::string unit = runs[0].length_unit() + "/s";
  std::string content = charts(kAngles, attitudes(runs, truth), "deg", runs[0].start_s, end_s);
  const std::vector<Quantity> moving = velocities(runs, truth, as_speed);
  content += as_speed ? charts(kSpeeds, moving, unit, runs[0].start_s, end_s)
                      : charts(kVelocities, moving, unit, runs[0].start_s, end_s);
  std::string how =
      "Roll, pitch and yaw turn the world's axes into the body's, about z, then y, then x. Velocities are in "
      "body "
      "axes, as published.";
  if (truth != nullptr)
    how +=
        " An error of attitude is the rotation from truth to estimate about the body's axes, after alignment "
        "of "
        "the positions. True velocities are differences of true positions over 0.2 s.";
  return section("Attitude and velocity", how, content);
}

}  // namespace farpoint::tools::report
