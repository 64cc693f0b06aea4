// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/options.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace farpoint::daemon {
namespace {

CommandLine parse(std::initializer_list<const char*> arguments) {
  std::vector<const char*> argv{"farpointd"};
  argv.insert(argv.end(), arguments);
  return parse_command_line(static_cast<int>(argv.size()), argv.data());
}

std::string error_of(std::initializer_list<const char*> arguments) {
  try {
    (void)parse(arguments);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(CommandLine, EveryOptionOfTheDesign) {
  const Options o =
      parse({"--config", "c.yaml",    "--replay",     "run.lcm",   "--lockstep",
             "--output", "out.lcm",   "--trajectory", "final.tum", "--live-trajectory",
             "live.tum", "--can-log", "out.candump",  "--lcm-url", "udpm://239.0.0.1:7667?ttl=0",
             "--can",    "vcan0",     "--set",        "a.b=1",     "--set",
             "c.d=2"})
          .options;
  EXPECT_EQ(o.config_path, "c.yaml");
  EXPECT_EQ(o.replay, "run.lcm");
  EXPECT_EQ(o.output, "out.lcm");
  EXPECT_EQ(o.trajectory, "final.tum");
  EXPECT_EQ(o.live_trajectory, "live.tum");
  EXPECT_EQ(o.can_log, "out.candump");
  EXPECT_EQ(o.lcm_url, "udpm://239.0.0.1:7667?ttl=0");
  EXPECT_EQ(o.can_interface, "vcan0");
  EXPECT_EQ(o.settings, (std::vector<std::string>{"a.b=1", "c.d=2"}));
}

TEST(CommandLine, NothingGoesOutUnasked) {
  const Options o = parse({"--replay", "-", "--lockstep"}).options;
  EXPECT_EQ(o.replay, "-");
  EXPECT_FALSE(o.lcm_url.has_value());
  EXPECT_FALSE(o.can_interface.has_value());
  EXPECT_FALSE(o.config_path.has_value());
  EXPECT_TRUE(o.output.empty());
}

TEST(CommandLine, NetworkAndBusWithoutAValueUseTheConfiguration) {
  const Options o = parse({"--replay", "run.lcm", "--lcm-url", "--can", "--lockstep"}).options;
  EXPECT_EQ(o.lcm_url, "");
  EXPECT_EQ(o.can_interface, "");
}

TEST(CommandLine, ThreadsAndTheirRepetition) {
  Options o = parse({"--replay", "run.lcm", "--speed", "1.5"}).options;
  EXPECT_EQ(o.speed, 1.5);
  EXPECT_EQ(o.schedule_log, "");
  o = parse({"--replay", "run.lcm", "--schedule", "recorded"}).options;
  EXPECT_FALSE(o.speed);
  EXPECT_EQ(o.schedule_log, "run.lcm");
  o = parse({"--replay", "run.lcm", "--schedule", "recorded", "--schedule-log", "live.lcm"}).options;
  EXPECT_EQ(o.schedule_log, "live.lcm");
  // The order is the recorded one, whatever the pace.
  EXPECT_FALSE(parse({"--replay", "run.lcm", "--speed", "2", "--schedule", "recorded"}).options.speed);
}

TEST(CommandLine, AReplayAloneRunsAsOnTheVehicle) {
  EXPECT_EQ(parse({"--replay", "run.lcm"}).options.speed, 1.0);
  EXPECT_FALSE(parse({"--replay", "run.lcm", "--lockstep"}).options.speed);
  EXPECT_FALSE(parse({"--replay", "run.lcm", "--schedule", "recorded"}).options.speed);
  EXPECT_FALSE(parse({}).options.speed);
}

TEST(CommandLine, ChecksInsteadOfARun) {
  EXPECT_FALSE(parse({}).options.check);
  const Options o = parse({"--check", "--json", "--config", "c.yaml", "--record", "run.lcm"}).options;
  EXPECT_TRUE(o.check && o.json);
  EXPECT_EQ(parse({"--check", "--replay", "run.lcm"}).options.replay, "run.lcm");
  EXPECT_EQ(error_of({"--check", "--replay", "-"}), "--check --replay -: expected a log that is a file");
  EXPECT_EQ(error_of({"--json"}), "--json without --check, expected both");
}

TEST(CommandLine, WithoutAReplayItRunsLive) {
  EXPECT_EQ(parse({}).options.replay, "");
  const Options o = parse({"--record", "run.lcm", "--output", "out.lcm"}).options;
  EXPECT_EQ(o.record, "run.lcm");
  EXPECT_EQ(o.replay, "");
}

TEST(CommandLine, HelpTeaches) {
  const std::string help = parse({"--help"}).text_and_leave;
  for (const char* word :
       {"--config", "--check", "--replay", "--lockstep", "--speed", "--schedule", "--output", "--trajectory",
        "--live-trajectory", "--can-log", "--lcm-url", "--can", "--set", "Exit status", "Examples"}) {
    EXPECT_NE(help.find(word), std::string::npos) << word;
  }
  EXPECT_NE(parse({"--version"}).text_and_leave.find("farpointd "), std::string::npos);
}

TEST(CommandLineMistakes, SayWhatWasExpectedInOneLine) {
  for (const auto& wrong : {error_of({"--lockstep"}), error_of({"--speed", "1"}),
                            error_of({"--schedule", "recorded"}), error_of({"--schedule-log", "a.lcm"})}) {
    EXPECT_EQ(wrong, "--lockstep, --speed and --schedule are of a replay, expected --replay LOG with them");
  }
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--record", "again.lcm"}),
            "--record is of a live run, expected --replay or --record");
  EXPECT_EQ(error_of({"--record", "run.lcm", "--output", "run.lcm"}),
            "--output run.lcm: the same file as --record, expected another");
  for (const char* speed : {"0", "-1", "nan", "1001"}) {
    EXPECT_EQ(error_of({"--replay", "run.lcm", "--speed", speed}),
              "--speed: expected a number above 0, at most 1000");
  }
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--speed", "2"}),
            "--lockstep and --speed exclude each other, expected one");
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--schedule", "live"}),
            "--schedule live: unknown, expected recorded");
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--schedule-log", "live.lcm"}),
            "--schedule-log without --schedule recorded, expected both");
  for (const auto& wrong : {error_of({"--replay", "run.lcm", "--lockstep", "--sped"}), error_of({"--replay"}),
                            error_of({"--replay", "run.lcm", "--lockstep", "stray"}),
                            error_of({"--replay", "a", "--replay", "b", "--lockstep"}),
                            error_of({"--replay", "a", "--lockstep", "--set"})}) {
    EXPECT_FALSE(wrong.empty());
    EXPECT_EQ(wrong.find('\n'), std::string::npos) << wrong;
    EXPECT_NE(wrong.find("--help"), std::string::npos) << wrong;
  }
}

TEST(CommandLineMistakes, OneFileForTwoPurposes) {
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--output", "./run.lcm"}),
            "--output ./run.lcm: the same file as --replay, expected another");
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--trajectory", "a/../t.tum", "--live-trajectory",
                      "t.tum"}),
            "--live-trajectory t.tum: the same file as --trajectory, expected another");
  EXPECT_NE(error_of({"--replay", "run.lcm", "--lockstep", "--trajectory", "t.tum", "--live-trajectory",
                      "t.map2.tum"}),
            "");
  EXPECT_EQ(error_of({"--replay", "run.lcm", "--lockstep", "--trajectory", "t.tum", "--live-trajectory",
                      "t.mapped.tum"}),
            "");
  EXPECT_EQ(
      error_of({"--replay", "run.lcm", "--lockstep", "--output", "/dev/null", "--can-log", "/dev/null"}), "");
}

}  // namespace
}  // namespace farpoint::daemon
