// SPDX-License-Identifier: Apache-2.0
// Axes, lines and colours of the report's diagrams.
#include "tools/report/plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "tools/report/colours.h"
#include "tools/report/histogram.h"

namespace farpoint::tools::report {
namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

Plot small_plot() {
  return Plot({"Title", {"x, m"}, {"y, m"}, false, 400, 300});
}

TEST(Axis, ShortLogarithmicAxisHasTicksToReadBy) {
  const std::vector<double> values = ticks(0.29, 1.5, 6, true);  // 1, 2, 5 would give 0.5 and 1
  EXPECT_GE(values.size(), 5U);
  EXPECT_GE(values.front(), 0.29);
  EXPECT_LE(values.back(), 1.5);
  EXPECT_EQ(tick_text(0.4, 0.2, true), "0.4");
  EXPECT_EQ(tick_text(1.2, 0.2, true), "1.2");
  EXPECT_EQ(tick_text(500, 300, true), "500");
  EXPECT_EQ(tick_text(0.0002, 0.0003, true), "0.0002");
  EXPECT_EQ(tick_text(0.25, 0.05, false), "0.25");
  EXPECT_EQ(tick_text(20, 10, false), "20");
}

TEST(Axis, LabelsOfALogarithmicAxisHaveRoom) {
  for (const auto& [low, high] : {std::pair(6.5, 80.0), {0.7, 1.5}, {15.0, 60.0}, {0.9, 8.0}}) {
    const std::vector<double> values = ticks(low, high, 7, true);
    EXPECT_GE(values.size(), 4U) << low << " " << high;
    for (std::size_t i = 1; i < values.size(); ++i)
      EXPECT_GT(std::log(values[i] / values[i - 1]) / std::log(high / low), 0.065) << values[i];
  }
}

TEST(Axis, TicksOfOneAxisHaveDifferentTexts) {
  for (const auto& [low, high] :
       {std::pair(0.29, 1.5), {15.0, 60.0}, {1.1, 1.9}, {0.001, 0.004}, {3.0, 900.0}}) {
    const std::vector<double> values = ticks(low, high, 6, true);
    for (std::size_t i = 1; i < values.size(); ++i) {
      EXPECT_NE(tick_text(values[i], values[1] - values[0], true),
                tick_text(values[i - 1], values[1] - values[0], true))
          << low << " " << high;
    }
  }
}

TEST(Axis, LinesFarAboveZeroKeepOffTheFrame) {
  for (const Axis& axis : {Axis{"MB", false, 0.0}, Axis{"MB"}}) {
    const Scale scale = scale_around(axis, {20.0, 150.0, 160.0}, true);
    EXPECT_EQ(scale.low, 0.0);
    EXPECT_NEAR(scale.high, 1.04 * 160.0, 1e-9);
  }
  EXPECT_NEAR(scale_around({"MB", false, 0.0}, {150.0, 160.0}, true).high, 1.04 * 160.0, 1e-9);
}

TEST(Plot, MissingPointsBreakALine) {
  Plot plot = small_plot();
  plot.line("run", {{0, 1}, {1, 2}, {NAN, NAN}, {5, 1}, {6, 2}}, run_style(0));
  EXPECT_EQ(count_of(plot.svg(), "<polyline"), 2U);
}

TEST(Plot, WithoutLinesOrDotsThereAreNoAxes) {
  Plot marks = small_plot();
  marks.mark_x("deadline", 3.0, run_style(0));
  marks.mark_y("", 1.0, run_style(0));
  marks.label_point("start", {1, 1});
  EXPECT_EQ(marks.svg(), "");
  Plot unknown = small_plot();
  unknown.line("run", {{NAN, 1}, {2, NAN}}, run_style(0));
  EXPECT_EQ(unknown.svg(), "");
  Plot one = small_plot();
  one.line("run", {{1, 1}}, run_style(0));
  EXPECT_EQ(one.svg(), "");
  Plot outside({"Title", {"x", false, 0.0, 1.0}, {"y"}, false, 400, 300});
  outside.line("run", {{5, 1}, {6, 1}}, run_style(0));
  EXPECT_EQ(outside.svg(), "");
  Plot negative({"Title", {"x", true}, {"y"}, false, 400, 300});
  negative.line("run", {{-5, 1}, {-6, 1}}, run_style(0));
  EXPECT_EQ(negative.svg(), "");
}

TEST(Plot, ThinningKeepsPeaksAndBreaks) {
  std::vector<Eigen::Vector2d> points;
  points.reserve(30'000);
  for (int i = 0; i < 30'000; ++i) points.emplace_back(i, i == 17'003 ? 99.0 : std::sin(i));
  points[8'001] = {NAN, NAN};
  const std::vector<Eigen::Vector2d> kept = thinned(points, 1500);
  EXPECT_LE(kept.size(), 2100U);
  const auto is_peak = [](const Eigen::Vector2d& p) { return p.y() == 99.0; };
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), is_peak), 1);
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [](const Eigen::Vector2d& p) { return !p.allFinite(); }),
            1);
  EXPECT_EQ(kept.back(), points.back());
  EXPECT_EQ(thinned({{1, 2}, {3, 4}}, 1500).size(), 2U);
}

TEST(Plot, ColouredLineShowsItsValuesAndABar) {
  Plot plot = small_plot();
  std::vector<Eigen::Vector2d> points;
  ColouredValues values{{}, 0.0, 2.0, "error, m"};
  for (int i = 0; i < 40; ++i) {
    points.emplace_back(i, 0.1 * i);
    values.values.push_back(i < 20 ? 0.0 : 5.0);
  }
  plot.coloured_line(points, values);
  plot.label_point("start", points.front());
  const std::string svg = plot.svg();
  EXPECT_EQ(count_of(svg, "<polyline"), 2U) << "one piece a colour";
  EXPECT_EQ(count_of(svg, "stroke=\"" + level_colour(0) + "\""), 1U);
  EXPECT_EQ(count_of(svg, "stroke=\"" + level_colour(kColourLevels - 1) + "\""), 1U);
  for (const char* part :
       {">start<", ">error, m<", ">2 and more<", "data-name=\"error, m\" data-values=\"0 0 ",
        "data-values=\"5 5 ", "class=\"label\" data-at=\""})
    EXPECT_NE(svg.find(part), std::string::npos) << part << svg;
}

TEST(Plot, TellsTheScriptItsAxesAndNames) {
  Plot plot({"Title", {"x", true, 1.0, 100.0}, {"y", false, 0.0, 4.0}, false, 400, 300});
  plot.line("run <1>", {{2, 1}, {50, 2}}, run_style(0));
  const std::string svg = plot.svg();
  EXPECT_NE(svg.find("data-x=\"1 100 log\""), std::string::npos) << svg;
  EXPECT_NE(svg.find("data-y=\"0 4 linear\""), std::string::npos);
  EXPECT_NE(svg.find("data-name=\"run &lt;1&gt;\""), std::string::npos);
  EXPECT_EQ(svg.find("data-equal"), std::string::npos);
}

TEST(Plot, LinesHaveHundredthsOfAPixelToZoomInto) {
  Plot plot = small_plot();
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= 1000; ++i) points.emplace_back(0.3 * i, std::sin(i));
  plot.line("run", points, run_style(0));
  plot.dots("points", points, "#333");
  const std::string svg = plot.svg();
  const std::regex of_line(R"( \d+\.\d\d,\d+\.\d\d )"), of_dots(R"(M\d+\.\d\d,\d+\.\d\dh0)");
  EXPECT_TRUE(std::regex_search(svg, of_line));
  EXPECT_TRUE(std::regex_search(svg, of_dots));
}

TEST(Plot, LegendNamesOnlyWhatIsDrawn) {
  Plot plot = small_plot();
  plot.dots("points", {{1, 1}, {2, 2}}, "#333");
  plot.dots("none of these", {}, "#d8702a");
  plot.line("nor this", {{NAN, NAN}}, run_style(0));
  plot.mark_x("limit", 1.5, run_style(1));
  const std::string svg = plot.svg();
  for (const char* name : {">points<", ">limit<"}) EXPECT_NE(svg.find(name), std::string::npos) << name;
  for (const char* name : {">none of these<", ">nor this<"})
    EXPECT_EQ(svg.find(name), std::string::npos) << name;
}

TEST(Plot, LongNamesStayWithinThePicture) {
  Plot plot = small_plot();
  const std::string name(200, 'n');
  plot.line(name, {{0, 1}, {1, 2}}, run_style(0));
  plot.line("short", {{0, 1}, {1, 2}}, run_style(1));
  const std::string svg = plot.svg();
  EXPECT_EQ(svg.find(">" + name + "<"), std::string::npos);
  EXPECT_NE(svg.find("nn..<"), std::string::npos);
}

TEST(Colours, RiseInLightness) {
  const auto lightness = [](const std::string& colour) {
    const auto part = [&](std::size_t at) { return std::stoi(colour.substr(at, 2), nullptr, 16); };
    return 0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5);
  };
  for (int i = 1; i < kColourLevels; ++i)
    EXPECT_GT(lightness(level_colour(i)), lightness(level_colour(i - 1)) + 1.0);
  EXPECT_EQ(colour_level(-1.0, 0.0, 2.0), 0);
  EXPECT_EQ(colour_level(1.0, 0.0, 2.0), kColourLevels / 2);
  EXPECT_EQ(colour_level(1e300, 0.0, 2.0), kColourLevels - 1);
  EXPECT_EQ(colour_level(NAN, 0.0, 2.0), 0);
  EXPECT_EQ(colour_level(1.0, 1.0, 1.0), 0);
}

// Life times are whole frames: bins of unequal numbers of frames would be a comb.
TEST(Histogram, BinsOfKeyframesHoldAsManyFramesEach) {
  for (const auto& [high_s, frame_s, frames_a_keyframe] :
       {std::tuple(7.0, 0.1, 2), {3.0, 0.1, 1}, {40.0, 0.05, 3}, {0.9, 1.0 / 30.0, 4}}) {
    const std::vector<double> bins = keyframe_edges(high_s, frame_s, frames_a_keyframe, 40);
    EXPECT_LE(bins.size(), 41U);
    EXPECT_GE(bins.back(), high_s);
    std::vector<double> lives_s;
    const auto frames = static_cast<int>(std::lround((bins.back() + 0.5 * frame_s) / frame_s));
    lives_s.reserve(static_cast<std::size_t>(frames));
    for (int i = 0; i < frames; ++i) lives_s.push_back(frame_s * i);
    const std::vector<double> shares = shares_percent(lives_s, bins);
    for (const double share : shares) EXPECT_NEAR(share, shares.front(), 1e-6) << high_s << " " << frame_s;
    // And at every keyframe only.
    std::vector<double> keyframes_s;
    for (int i = 0; i < frames; i += frames_a_keyframe) keyframes_s.push_back(frame_s * i);
    const std::vector<double> keyframe_shares = shares_percent(keyframes_s, bins);
    for (const double share : keyframe_shares) EXPECT_NEAR(share, keyframe_shares.front(), 1e-6);
  }
}

}  // namespace
}  // namespace farpoint::tools::report
