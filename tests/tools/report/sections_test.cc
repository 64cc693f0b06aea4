// SPDX-License-Identifier: Apache-2.0
// The report's sections and tables on made-up runs.
#include "tools/report/sections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "ipc/channels.h"
#include "ipc/image_encoder.h"
#include "ipc/log.h"
#include "tests/tools/made_run.h"
#include "tests/tools/tool_support.h"
#include "tools/report/frame_table.h"
#include "tools/report/report.h"

namespace farpoint::tools::report {
namespace {

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

class Sections : public testing::Test {
 protected:
  Sections() {
    truth.body = random_path(&random, 401, 10.0, 100.0);
    for (const char* name : {"one", "two"}) {
      MadeRun run;
      run.final_trajectory = disturbed(truth.body, 0.5, 0.02, &random);
      write_run_log(file(name), run);
    }
  }
  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return folder / (name + ".lcm"); }
  [[nodiscard]] Runs runs(const Truth* known) const {
    Runs both;
    for (const char* name : {"one", "two"}) both.push_back(read_run_record(file(name), known));
    return both;
  }

  std::mt19937_64 random{5};
  ScratchFolder folder;
  Truth truth;
};

TEST_F(Sections, PathsAreDrawnFinalLiveAndByTheirError) {
  const std::string html = trajectory_section(runs(&truth), &truth);
  for (const char* part : {">one, final<", ">one, live<", ">two, live<", ">truth<", ">start<", ">end<",
                           "<title>one, final: position error<", "<title>two, final: position error<",
                           ">error after alignment, m<"})
    EXPECT_TRUE(has(html, part)) << part;
  EXPECT_EQ(count_of(html, ">one, live<"), 2U) << "from above and in height";
  const std::string alone = trajectory_section(runs(nullptr), nullptr);
  EXPECT_TRUE(has(alone, ">one, live<"));
  EXPECT_TRUE(has(alone, ">x, map units<"));
  EXPECT_FALSE(has(alone, "position error"));
}

TEST_F(Sections, TheLivePathIsThatOfTheMapWithMostPoses) {
  MadeRun run;
  run.final_trajectory = disturbed(truth.body, 0.5, 0.02, &random);
  run.other_map_from = 300;
  write_run_log(file("one"), run);
  const RunRecord record = read_run_record(file("one"), &truth);
  ASSERT_EQ(record.live.poses.size(), 290U);
  for (const TimedPose& p : record.live.poses) EXPECT_EQ(p.map_id, 7);
  const slam::Sim3& S = record.world_from_live_map();
  EXPECT_NEAR(S.scale, 2.0, 0.05);
  const TimedPose& last = record.live.poses.back();
  EXPECT_LT((S * last.pose.t - truth.body.poses[299].pose.t).norm(), 0.5);
}

TEST_F(Sections, ErrorsAreShownOverTheWayAndByLength) {
  const std::string html = error_section(runs(&truth), &truth);
  for (const char* title : {"Position error over the way", "Scale over the way",
                            "Relative error of position (RPE)", "Relative error of rotation (RPE)"})
    EXPECT_TRUE(has(html, std::string("<title>") + title)) << title;
  EXPECT_EQ(error_section(runs(nullptr), nullptr), "");
  Truth positions = truth;
  positions.body.has_orientation = false;
  EXPECT_FALSE(has(error_section(runs(&positions), &positions), "RPE) by"));
}

TEST_F(Sections, AttitudeAndVelocityHaveErrorsWhereThereIsTruth) {
  const std::string html = motion_section(runs(&truth), &truth);
  for (const char* title :
       {"Roll", "Pitch", "Yaw", "Forward velocity", "Velocity to the left", "Velocity upwards"}) {
    EXPECT_TRUE(has(html, std::string("<title>") + title + "<")) << title;
  }
  EXPECT_EQ(count_of(html, "<title>Error of "), 6U);
  EXPECT_TRUE(has(html, ">deg<") && has(html, ">m/s<"));
  const std::string alone = motion_section(runs(nullptr), nullptr);
  EXPECT_EQ(count_of(alone, "<title>"), 6U);
  EXPECT_FALSE(has(alone, "Error of "));
  EXPECT_TRUE(has(alone, ">map units/s<"));
}

// 1.5 odom units a second, two map units each, two metres a map unit.
TEST_F(Sections, VelocitiesAreInMapUnitsAndMetres) {
  const RunRecord run = read_run_record(file("one"), &truth);
  ASSERT_EQ(run.velocities.size(), 391U);
  EXPECT_NEAR(run.velocities[0].linear.x(), 3.0, 1e-12);
  EXPECT_NEAR(run.world_from_live_map().scale * run.velocities[0].linear.x(), 6.0, 0.1);
}

TEST_F(Sections, PositionOnlyTruthComparesSpeeds) {
  Truth positions = truth;
  positions.body.has_orientation = false;
  for (TimedPose& p : positions.body.poses) p.pose.q.setIdentity();
  const std::string html = motion_section(runs(&positions), &positions);
  EXPECT_TRUE(has(html, "<title>Error of speed<"));
  EXPECT_FALSE(has(html, "Forward velocity"));
  EXPECT_FALSE(has(html, "<title>Error of roll<"));
}

TEST_F(Sections, OverviewOfRunsWithoutTruthHasNoEmptyColumns) {
  const std::string alone = overview_section(runs(nullptr));
  for (const char* part : {"<th>valid %</th>", "<th>first valid after s</th>", "<th>longest blind s</th>",
                           "<th>final path map units</th>", "<td>1234</td>"})
    EXPECT_TRUE(has(alone, part)) << part << alone;
  for (const char* part : {"ATE", "RPE", "<td>-</td>"}) EXPECT_FALSE(has(alone, part)) << part;
  EXPECT_TRUE(has(overview_section(runs(&truth)), "<th>final ATE m</th>"));
}

TEST_F(Sections, LatencyAndTheProcessesRestAreThoseOfThreadedRuns) {
  const std::string html = timing_section(runs(nullptr));
  EXPECT_TRUE(has(html, "<title>Latency, mid-exposure to output<"));
  EXPECT_TRUE(has(html, ">one, most 407 ms<"));
  EXPECT_TRUE(has(html, ">mapping and rest<"));
  Runs lockstep = runs(nullptr);
  for (RunRecord& run : lockstep) {
    for (timing_t& t : run.timings) t.latency_ms = -1.0;
  }
  const std::string in_step = timing_section(lockstep);
  EXPECT_FALSE(has(in_step, "Latency, mid") || has(in_step, ">mapping and rest<"));
}

TEST_F(Sections, MapSizeCountsPointsAsEvaluateDoes) {
  Runs both = runs(nullptr);
  status_t later = both[0].statuses.back();
  later.utime += 1'000'000;
  both[0].statuses.push_back(later);
  // 1490 landmarks of which 300 are VMPs: the axis ends above 1190 and below 1490.
  const std::string html = health_section(both);
  const std::size_t at = html.find("<title>Size of the map<");
  ASSERT_NE(at, std::string::npos);
  const std::string head = html.substr(html.rfind("<svg", at), 400);
  std::istringstream range(head.substr(head.find("data-y=\"") + 8));
  double low = 0.0, high = 0.0;
  range >> low >> high;
  EXPECT_GT(high, 1190.0);
  EXPECT_LT(high, 1300.0);
}

TEST_F(Sections, FramesAreATableForOtherPrograms) {
  const RunRecord run = read_run_record(file("one"), &truth);
  std::istringstream lines(frame_table(run, &truth));
  std::string head, first, last;
  std::getline(lines, head);
  std::getline(lines, first);
  int rows = 1;
  for (std::string line; std::getline(lines, line); ++rows) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(head.begin(), head.end(), ',')) << line;
    last = line;
  }
  EXPECT_EQ(rows, 401);
  const auto cell = [&](const std::string& row, const std::string& name) {
    const std::size_t number = static_cast<std::size_t>(std::count(
        head.begin(), head.begin() + static_cast<std::ptrdiff_t>(("," + head + ",").find("," + name + ",")),
        ','));
    std::istringstream cells(row);
    std::string text;
    for (std::size_t i = 0; i <= number; ++i) std::getline(cells, text, ',');
    return text;
  };
  EXPECT_EQ(cell(first, "time_s"), "100.000000");
  EXPECT_EQ(cell(first, "state"), "initialising");
  EXPECT_EQ(cell(first, "live_x"), "");
  EXPECT_EQ(cell(first, "length_unit"), "m");
  EXPECT_EQ(cell(last, "state"), "tracking");
  EXPECT_NEAR(std::stod(cell(last, "velocity_x_per_s")), 6.0, 0.1);
  EXPECT_LT(std::stod(cell(last, "final_position_error")), 0.3);
  EXPECT_NEAR(std::stod(cell(last, "live_x")), std::stod(cell(last, "truth_x")), 0.3);
  EXPECT_EQ(cell(last, "latency_ms"), "407.000");
  const std::string alone = frame_table(read_run_record(file("one"), nullptr), nullptr);
  EXPECT_TRUE(has(alone, ",map units,"));
}

TEST_F(Sections, CsvStandsBesideThePage) {
  const ProgramResult result =
      run_farpoint_program("report " + file("one").string() + " " + file("two").string() + " -o " +
                           (folder / "page.html").string() + " --csv");
  ASSERT_EQ(result.status, 0) << result.err;
  for (const char* name : {"page.one.csv", "page.two.csv"})
    EXPECT_TRUE(get(folder / name).starts_with("time_s,state,")) << name;
  EXPECT_EQ(run_farpoint_program("report " + file("one").string() + " -o - --csv").status, 2);
}

// Points of a run at the given distance to every side of its way's first pose.
landmarks_t landmarks_around(const RunRecord& run, double distance) {
  landmarks_t message{};
  message.nlandmarks = 100;
  const TimedPose& first = run.run.final_trajectory.poses.front();
  for (int i = 0; i < message.nlandmarks; ++i) {
    landmark_t l{};
    l.map_id = first.map_id;
    const double angle_rad = 0.02 * 3.14159265 * i;
    l.position[0] = first.pose.t.x() + distance * std::cos(angle_rad);
    l.position[1] = first.pose.t.y() + distance * std::sin(angle_rad);
    message.landmarks.push_back(l);
  }
  return message;
}

TEST_F(Sections, DistantPointsHaveAMapOfTheirOwnWhereThereAreSome) {
  Runs both = runs(nullptr);
  both[0].run.log->landmarks = landmarks_around(both[0], 1.0);
  both[1].run.log->landmarks = landmarks_around(both[1], 800.0);
  const std::string html = map_section(both);
  for (const char* title : {"one: near the way<", "two: near the way<", "two: distant points too<"})
    EXPECT_TRUE(has(html, title)) << title;
  EXPECT_FALSE(has(html, "one: distant points too<")) << "the same picture twice";
}

// ---- tracks

// Points of one run that keyframes at the given times saw.
landmarks_t landmarks_seen(const std::vector<std::int64_t>& utimes, bool through_vmp) {
  landmarks_t message{};
  message.nlandmarks = 20;
  for (int i = 0; i < message.nlandmarks; ++i) {
    landmark_t l{};
    l.map_id = 7;
    l.through_vmp = through_vmp ? 1 : 0;
    l.distance = 1.0 + 5.0 * i;
    for (const std::int64_t utime : utimes) {
      l.sighting_utime.push_back(utime);
      l.sighting_u.push_back(static_cast<float>(3 * i));
      l.sighting_v.push_back(20.0F);
    }
    l.nsightings = static_cast<std::int32_t>(l.sighting_utime.size());
    message.landmarks.push_back(l);
  }
  return message;
}

std::vector<std::int64_t> multiples(std::int64_t step, std::int64_t first, int n) {
  std::vector<std::int64_t> utimes;
  utimes.reserve(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) utimes.push_back(first + step * i);
  return utimes;
}

void write_images(const std::filesystem::path& file) {
  ipc::LogWriter log(file.string());
  const std::string bytes = make_image(".png", 64, 48, 3);
  for (const std::int64_t utime : multiples(100'000, 0, 100)) {
    image_t image{};
    image.utime = utime;
    image.width = 64;
    image.height = 48;
    image.pixel_format = image_t::PIXEL_FORMAT_PNG;
    image.data.assign(bytes.begin(), bytes.end());
    image.size = static_cast<std::int32_t>(image.data.size());
    log.write_message("CAMERA_0", utime, image);
  }
  log.close();
}

class Tracks : public Sections {
 protected:
  std::string section_of(const std::vector<std::int64_t>& first, const std::vector<std::int64_t>& second) {
    write_images(folder / "images.lcm");
    Runs both = runs(nullptr);
    both[0].run.log->landmarks = landmarks_seen(first, false);
    both[1].run.log->landmarks = landmarks_seen(second, true);
    both[0].start_s = both[1].start_s = 0.0;
    return track_section(both, folder / "images.lcm");
  }
};

TEST_F(Tracks, RunsAreShownAtOneInstant) {
  // Keyframes at even and at every third frame: both at every sixth.
  const std::string html = section_of(multiples(200'000, 0, 50), multiples(300'000, 0, 33));
  EXPECT_EQ(count_of(html, "<title>Feature tracks<"), 6U);
  std::vector<std::string> times[2];
  for (const auto& [name, index] : {std::pair("one", 0), {"two", 1}}) {
    const std::string lead = std::string(1, '>').append(name).append(", ");
    for (std::size_t at = html.find(lead); at != std::string::npos; at = html.find(lead, at + 1))
      times[index].push_back(html.substr(at + lead.size(), html.find(" s:", at) - at - lead.size()));
  }
  EXPECT_EQ(times[0].size(), 3U);
  EXPECT_EQ(times[0], times[1]);
  EXPECT_TRUE(has(html, "made through a virtual map point")) << "the legend";
  EXPECT_FALSE(has(html, "beyond 50 m")) << "map units have no metres";
}

TEST_F(Tracks, WithoutACommonKeyframeEachRunShowsItsNearest) {
  const std::string html = section_of(multiples(200'000, 0, 50), multiples(200'000, 100'000, 49));
  EXPECT_EQ(count_of(html, "<title>Feature tracks<"), 6U);
}

TEST_F(Tracks, RecordingWithoutTruthGivesItsImages) {
  write_images(folder / "images.lcm");
  const Report made = make_report({{file("one")}, folder / "images.lcm"});
  EXPECT_TRUE(has(made.page, "Without truth: images.lcm has no GROUND_TRUTH."));
}

}  // namespace
}  // namespace farpoint::tools::report
