// SPDX-License-Identifier: Apache-2.0
// The report's parts, and the whole of it on a simulated run.
#include "tools/report/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"
#include "tools/evaluate/log_input.h"
#include "tools/report/histogram.h"
#include "tools/report/html.h"
#include "tools/report/plot.h"
#include "tools/report/work_figures.h"

namespace farpoint::tools::report {
namespace {

TEST(Svg, TextIsEscapedAndNumbersAreShort) {
  EXPECT_EQ(escaped("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
  EXPECT_EQ(number(1.5, 3), "1.5");
  EXPECT_EQ(number(-0.001, 2), "0");
  EXPECT_EQ(number(1200.0, 0), "1200");
  EXPECT_EQ(number(NAN, 2), "-");
}

TEST(Plot, TicksAreRoundAndInside) {
  EXPECT_EQ(ticks(0.0, 10.0, 5, false), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(ticks(1.0, 100.0, 7, true), (std::vector<double>{1, 2, 5, 10, 20, 50, 100}));
  for (const auto& [low, high] : {std::pair(-3.3, 17.1), {0.002, 0.0031}, {1e5, 7e5}}) {
    const std::vector<double> values = ticks(low, high, 6, false);
    EXPECT_GE(values.size(), 3U);
    EXPECT_LE(values.size(), 13U);
    for (const double v : values) {
      EXPECT_GE(v, low - 1e-9);
      EXPECT_LE(v, high + 1e-9);
    }
  }
}

TEST(Plot, TicksOfImpossibleRangesAreFew) {
  for (const bool is_log : {false, true}) {
    for (const auto& [low, high] : {std::pair(1e17, 1e17 + 100.0),
                                    {5e-324, 1e300},
                                    {-1e300, 1e300},
                                    {1.0, INFINITY},
                                    {NAN, NAN},
                                    {1e300, 1.0000001e300},
                                    {0.0, 5e-324}})
      EXPECT_LE(ticks(low, high, 6, is_log).size(), 4000U) << low << " " << high;
  }
}

TEST(Plot, NamesAxesAndLines) {
  Plot plot({"Title & more", {"x, m"}, {"y, s"}, false, 400, 300});
  EXPECT_EQ(plot.svg(), "") << "nothing to show";
  plot.line("run<1>", {{0, 1}, {2, NAN}, {3, 4}}, run_style(0));
  plot.dots("points", {{1, 1}}, "#333");
  const std::string svg = plot.svg();
  for (const char* part : {"Title &amp; more", ">x, m<", ">y, s<", ">run&lt;1&gt;<", ">points<"})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(Plot, RunsDifferInDashNotInColourAlone) {
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(run_style(i).dash, run_style(k).dash);
  }
}

TEST(Histogram, SharesAreOfAllValues) {
  const std::vector<double> shares = shares_percent({0.5, 1.5, 1.6, 9.0}, edges(0.0, 2.0, 2));
  ASSERT_EQ(shares.size(), 2U);
  EXPECT_NEAR(shares[0], 25.0, 1e-9);
  EXPECT_NEAR(shares[1], 50.0, 1e-9);
  const std::vector<double> decades = edges(1.0, 100.0, 2, true);
  EXPECT_NEAR(decades[1], 10.0, 1e-9);
}

// Every element that is opened is closed, in order.
void expect_well_formed(const std::string& html) {
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    const std::size_t end = html.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const bool closes = html[at + 1] == '/', is_alone = html[end - 1] == '/' || html[at + 1] == '!';
    const std::size_t begin = at + (closes ? 2 : 1);
    const std::string name = html.substr(begin, html.find_first_of(" />", begin) - begin);
    if (is_alone || name == "meta") continue;
    if (!closes) {
      open.push_back(name);
      continue;
    }
    ASSERT_FALSE(open.empty()) << name;
    ASSERT_EQ(open.back(), name) << "at " << at;
    open.pop_back();
  }
  EXPECT_TRUE(open.empty());
}

std::string without_images(const std::string& html) {
  std::string out;
  for (std::size_t i = 0; i < html.size();) {
    const std::size_t image = std::min(html.find("base64,", i), html.size());
    out += html.substr(i, image - i);
    i = std::min(html.find('"', image), html.size());
  }
  return out;
}

// A short drive, replayed once.
class ReportOfARun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new ScratchFolder;
    const std::string bin = test::binary_dir() + "/bin/";
    const std::string drive = (*folder / "drive.lcm").string(), out = (*folder / "vmp.lcm").string();
    std::string script = bin + "farpoint simulate town --size 620x188 --duration 9 -o " + drive;
    script += " && " + bin + "farpointd --replay " + drive +
              " --lockstep --set landmarks.mode=vmp --set wheels.use=false --output " + out;
    made = run_shell(script);
  }
  static void TearDownTestSuite() {
    delete folder;
    folder = nullptr;
  }
  static std::string report(const std::string& arguments) {
    const std::string file = (*folder / "report.html").string();
    const ProgramResult result =
        run_farpoint_program("report " + (*folder / "vmp.lcm").string() + " " + arguments + " -o " + file);
    EXPECT_EQ(result.status, kExitDone) << result.err;
    return get(file);
  }
  static ScratchFolder* folder;
  static ProgramResult made;
};
ScratchFolder* ReportOfARun::folder = nullptr;
ProgramResult ReportOfARun::made;

TEST_F(ReportOfARun, ShowsEverySectionAndNeedsNothingElse) {
  ASSERT_EQ(made.status, 0) << made.err;
  const std::string whole = report("--truth " + (*folder / "drive.lcm").string());
  EXPECT_NE(whole.find("data:image/jpeg;base64,/9j/"), std::string::npos) << "tracks on images of the drive";
  const std::string html = without_images(whole);
  expect_well_formed(html);
  for (const char* title :
       {"Overview", "Trajectory", "Errors", "Attitude and velocity", "Landmarks", "Virtual map points", "Map",
        "Feature tracks", "Timing", "Work", "States, faults, queues, memory", "Configuration and build"})
    EXPECT_NE(html.find(std::string("<h2>") + title), std::string::npos) << title;
  // No network, one script of its own, no number that is none.
  const std::size_t script = html.find("<script>");
  ASSERT_NE(script, std::string::npos);
  EXPECT_EQ(html.find("<script", script + 1), std::string::npos);
  std::string no_namespace = html;
  const std::string name_space = "xmlns=\"http://www.w3.org/2000/svg\"";  // a name, never fetched
  for (std::size_t at = 0; (at = no_namespace.find(name_space, at)) != std::string::npos;)
    no_namespace.erase(at, name_space.size());
  for (const char* part :
       {"http", "fetch(", "XMLHttp", "import(", "<script ", "src=", "<link", "nan", "inf\""})
    EXPECT_EQ(no_namespace.find(part), std::string::npos) << part;
}

TEST_F(ReportOfARun, WorksWithoutTruth) {
  const std::string html = report("");
  expect_well_formed(html);
  EXPECT_NE(html.find("map units"), std::string::npos);
  EXPECT_EQ(html.find("Position error"), std::string::npos);
  EXPECT_EQ(html.find("<h2>Feature tracks"), std::string::npos) << "no images without the recording";
}

TEST_F(ReportOfARun, WhatIsNoRunIsRefused) {
  put(*folder / "path.tum", "0 0 0 0 0 0 0 1\n");
  const ProgramResult result = run_farpoint_program("report " + (*folder / "path.tum").string() + " -o " +
                                                    (*folder / "none.html").string());
  EXPECT_EQ(result.status, kExitMisused);
  EXPECT_NE(result.err.find("path.tum: expected an output log"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(*folder / "none.html"));
}

// The figures of the section "Work", by names; frames and memory beside them.
TEST_F(ReportOfARun, FiguresAreThereForMachines) {
  ASSERT_EQ(made.status, 0) << made.err;
  const Json figures = make_figures({*folder / "vmp.lcm", *folder / "vmp.lcm"});
  const std::string text = figures.dump();
  EXPECT_EQ(run_farpoint_program("report " + (*folder / "vmp.lcm").string() + " " +
                                 (*folder / "vmp.lcm").string() + " --json")
                .out,
            text + "\n");
  const Json run = run_figures(read_run_record(*folder / "vmp.lcm", nullptr));
  EXPECT_EQ(run.find("work.features")->number(), 1500.0);
  EXPECT_GT(run.find("work.matches")->number(), 50.0);
  EXPECT_LE(run.find("work.inliers")->number(), run.find("work.matches")->number());
  EXPECT_GE(run.find("work.keyframes_a_point")->number(), 2.0);
  EXPECT_GT(run.find("work.seconds_a_point")->number(), 0.0);
  EXPECT_GT(run.find("work.mapping_ms")->number(), run.find("work.local_ba_ms")->number());
  EXPECT_EQ(run.find("frames.tracked")->number(), 90.0);
  EXPECT_LE(run.find("frames.valid")->number(), 90.0);
  EXPECT_EQ(run.find("frames.dropped")->number(), 0.0);
  EXPECT_GT(run.find("memory.peak_mb")->number(), run.find("memory.pool_mb")->number());
  EXPECT_FALSE(run.find("memory.steadiness")->is_object()) << "90 frames are too few";
}

TEST_F(ReportOfARun, AReportHasOneForm) {
  const std::string run = "report " + (*folder / "vmp.lcm").string();
  const ProgramResult none = run_farpoint_program(run);
  EXPECT_EQ(none.status, kExitMisused);
  EXPECT_NE(none.err.find("expected -o FILE or --json"), std::string::npos) << none.err;
  EXPECT_EQ(run_farpoint_program(run + " --json -o " + (*folder / "none.html").string()).status,
            kExitMisused);
}

// What the estimator tells about its landmarks is consistent, and near the truth.
TEST_F(ReportOfARun, LandmarksOfARealRunAreNearTheTruth) {
  const RunLog run = read_run_log(*folder / "vmp.lcm");
  ASSERT_TRUE(run.landmarks.has_value());
  EXPECT_GT(run.landmarks->nlandmarks, 500);
  for (const landmark_t& l : run.landmarks->landmarks) {
    EXPECT_GE(l.created_utime, l.anchor_utime);
    EXPECT_EQ(l.anchor_utime % 100'000, 0) << "a frame of 10 Hz";
    ASSERT_GE(l.nsightings, 2);
    EXPECT_TRUE(std::is_sorted(l.sighting_utime.begin(), l.sighting_utime.end()));
    const Eigen::Vector3d line =
        Eigen::Map<const Eigen::Vector3d>(l.position) - Eigen::Map<const Eigen::Vector3d>(l.anchor_position);
    EXPECT_NEAR(line.norm() / l.distance, 1.0, 1e-6);
  }
  const std::string condition =
      "--expect 'vmp.landmarks.from_10_to_20_m.error_p50_percent <= 3' "
      "--expect 'vmp.landmarks.from_20_to_50_m.error_p50_percent <= 4'";
  const ProgramResult judged =
      run_farpoint_program("evaluate " + (*folder / "vmp.lcm").string() + " --truth " +
                           (*folder / "drive.lcm").string() + " " + condition);
  EXPECT_EQ(judged.status, kExitDone) << judged.err << judged.out;
  EXPECT_NE(judged.out.find("vmp landmarks:  true distance m"), std::string::npos) << judged.out;
}

}  // namespace
}  // namespace farpoint::tools::report
