// SPDX-License-Identifier: Apache-2.0
#include "daemon/check/check.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "tests/daemon/run_daemon.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

using test::Outcome;
using test::run_daemon;
using test::Scratch;

std::size_t threads() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& task : std::filesystem::directory_iterator("/proc/self/task")) ++count;
  return count;
}

std::set<std::string> files_in(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    names.insert(entry.path().string());
  return names;
}

std::vector<std::string> subjects_of(const Outcome& outcome) {
  std::vector<std::string> subjects;
  std::istringstream lines(outcome.out);
  for (std::string line; std::getline(lines, line);) subjects.push_back(line.substr(0, line.find("  ")));
  return subjects;
}

class Check : public testing::Test {
 protected:
  Check() { test::write_synthetic_log(scratch_.path("film.lcm"), {}); }
  [[nodiscard]] std::vector<std::string> arguments(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = {"--check"};
    for (const std::string& setting :
         {std::string("camera.driver=file"), "camera.device=" + scratch_.path("film.lcm"),
          std::string("camera.calibration=log"), std::string("lcm.enabled=false"),
          "state.folder=" + scratch_.path(""), "control.socket=" + scratch_.path("control")})
      all.insert(all.end(), {"--set", setting});
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  const Scratch scratch_;
};

TEST_F(Check, ALineForEachThingAndStatus0WhereNoneIsAnError) {
  const Outcome outcome = run_daemon(arguments({"--record", scratch_.path("run.lcm")}));
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(subjects_of(outcome),
            (std::vector<std::string>{"configuration", "solver", "calibration", "mask", "camera", "LCM",
                                      "CAN", "real-time priority", "cores", "locked memory",
                                      "clock of images", "system clock", "recording", "state", "commands"}))
      << outcome.out;
}

TEST_F(Check, OfAReplayOnlyWhatThatReplayUsesIsLookedAt) {
  const Outcome outcome =
      run_daemon({"--check", "--replay", scratch_.path("film.lcm"), "--output", scratch_.path("out.lcm")});
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  EXPECT_EQ(subjects_of(outcome),
            (std::vector<std::string>{"configuration", "solver", "calibration", "log", "mask", "--output"}))
      << outcome.out;
  EXPECT_FALSE(std::filesystem::exists(scratch_.path("out.lcm")));
  EXPECT_EQ(run_daemon({"--check", "--replay", scratch_.path("none.lcm")}).status, 2);
}

TEST_F(Check, WritesNothingAndStartsNoThread) {
  const std::set<std::string> before = files_in(scratch_.path(""));
  const std::size_t threads_before = threads();
  (void)run_daemon(arguments({"--record", scratch_.path("run.lcm"), "--output", scratch_.path("out.lcm"),
                              "--set", "log.file=" + scratch_.path("x.log")}));
  EXPECT_EQ(files_in(scratch_.path("")), before);
  EXPECT_EQ(threads(), threads_before);
}

TEST_F(Check, AnErrorIsStatus2) {
  const Outcome outcome = run_daemon(arguments({"--record", scratch_.path("missing/run.lcm")}));
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.out.find("recording           error    folder "), std::string::npos) << outcome.out;
}

TEST_F(Check, AWrongConfigurationIsTheOnlyLine) {
  const Outcome outcome = run_daemon({"--check", "--set", "nosuch.key=1"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.out.find("configuration  error    --set: nosuch.key: unknown key"), 0U) << outcome.out;
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 1);
}

TEST_F(Check, JsonHoldsTheSameLines) {
  const Outcome outcome = run_daemon(arguments({"--json"}));
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out.find("{\"program\": \"farpointd 0."), 0U) << outcome.out;
  EXPECT_NE(outcome.out.find("{\"what\": \"camera\", \"verdict\": \"ok\", \"sentence\": \""),
            std::string::npos);
}

TEST(Findings, JsonEscapesWhatANameMayHold) {
  Findings findings;
  findings.warn("a \"b\"", "c\\d\ne");
  EXPECT_EQ(findings.json("p"),
            "{\"program\": \"p\", \"verdict\": \"warning\", \"checks\": [{\"what\": \"a \\\"b\\\"\", "
            "\"verdict\": \"warning\", \"sentence\": \"c\\\\d\\\\ne\"}]}\n");
}

TEST(Findings, TheWorstLineDecides) {
  Findings findings;
  EXPECT_EQ(findings.worst(), Verdict::kOk);
  findings.fail("a", "b");
  findings.warn("c", "d");
  EXPECT_EQ(findings.worst(), Verdict::kError);
}

}  // namespace
}  // namespace farpoint::daemon
