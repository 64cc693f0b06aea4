// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/service_log.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "daemon/system/logging.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

// Keeps what it gets.
class Kept final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  std::vector<std::string> lines;

 protected:
  void sink_it_(const spdlog::details::log_msg& m) override {
    lines.emplace_back(m.payload.data(), m.payload.size());
  }
  void flush_() override {}
};

spdlog::details::log_msg message(double time_s, spdlog::level::level_enum level, spdlog::string_view_t text) {
  const auto time = spdlog::log_clock::time_point(
      std::chrono::duration_cast<spdlog::log_clock::duration>(std::chrono::duration<double>(time_s)));
  return {time, {}, "", level, text};
}

TEST(ServiceLog, AFloodIsCutAndSaidToBe) {
  auto kept = std::make_shared<Kept>();
  RateLimitedSink sink({kept});
  for (int i = 0; i < 10'000; ++i) sink.log(message(1000.0 + 1e-4 * i, spdlog::level::info, "x"));
  // The burst, and ten a second of one second.
  EXPECT_GE(kept->lines.size(), 100U);
  EXPECT_LE(kept->lines.size(), 125U);
  sink.log(message(1001.0, spdlog::level::err, "must pass"));
  EXPECT_EQ(kept->lines.back(), "must pass");
  sink.log(message(1010.0, spdlog::level::info, "later"));
  EXPECT_EQ(kept->lines.back(), "later");
  bool said = false;
  for (const std::string& line : kept->lines)
    said = said || line.find("messages left out") != std::string::npos;
  EXPECT_TRUE(said);
}

TEST(ServiceLog, GoesToItsFileWithTimeAndLevel) {
  const test::Scratch scratch;
  LogConfig config;
  config.file = scratch.path("farpointd.log");
  testing::internal::CaptureStderr();
  start_service_log(config);
  open_log_file(config);
  spdlog::warn("the camera is gone");
  spdlog::debug("not of this level");
  stop_service_log();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "farpointd: warning: the camera is gone\n");
  start_logging("warning");  // for the tests that follow
  std::stringstream text;
  text << std::ifstream(config.file).rdbuf();
  EXPECT_NE(text.str().find(" warning the camera is gone\n"), std::string::npos) << text.str();
  EXPECT_EQ(text.str().find("not of this level"), std::string::npos);
}

TEST(ServiceLog, ALineBreakInATextForgesNoLineOfTheJournal) {
  setenv("JOURNAL_STREAM", "8:1", 1);
  testing::internal::CaptureStderr();
  start_service_log({});
  spdlog::info("command: {}", "reset\n<0>the vehicle is on fire\x1b[2J");
  spdlog::info("{}", std::string(100'000, 'x'));
  stop_service_log();
  unsetenv("JOURNAL_STREAM");
  const std::string text = testing::internal::GetCapturedStderr();
  start_logging("warning");  // for the tests that follow
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2) << text.substr(0, 1000);
  EXPECT_TRUE(text.starts_with("<6>command: reset\\n<0>the vehicle is on fire\\x1b[2J\n<6>xxx"))
      << text.substr(0, 1000);
  EXPECT_LT(text.size(), 10'000U) << "a longer line is cut by the journal, and its rest read as a line";
}

TEST(ServiceLog, ALineBreakInATextForgesNoLineOfAReplaysLogEither) {
  testing::internal::CaptureStderr();
  start_logging("warning");
  spdlog::warn("camera \"a\nfarpointd: error: b\"");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "farpointd: warning: camera \"a\\nfarpointd: error: b\"\n");
}

TEST(ServiceLog, AFileThatCannotBeWrittenNowMayBeOpenedLater) {
  const test::Scratch scratch;
  LogConfig config;
  config.file = "/proc/nowhere/x.log";
  testing::internal::CaptureStderr();
  start_service_log(config);
  EXPECT_THROW(open_log_file(config), std::runtime_error);
  spdlog::warn("before");
  config.file = scratch.path("farpointd.log");
  open_log_file(config);
  spdlog::warn("after");
  stop_service_log();
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "farpointd: warning: before\nfarpointd: warning: after\n");
  start_logging("warning");  // for the tests that follow
  std::stringstream text;
  text << std::ifstream(config.file).rdbuf();
  EXPECT_NE(text.str().find(" warning after\n"), std::string::npos) << text.str();
}

}  // namespace
}  // namespace farpoint::daemon
