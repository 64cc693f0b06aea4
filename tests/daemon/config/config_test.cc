// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/config.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <set>
#include <sstream>
#include <vector>

#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

const std::string kShipped = test::source_dir() + "/config/farpoint.yaml";

// What the user reads after loading `text` as "f.yaml", empty where it loads.
std::string error_of(const std::string& text) {
  Config config;
  ConfigOrigins origins;
  try {
    load_config_text(text, "f.yaml", &config, &origins);
    check_relations(config, origins);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string error_of_setting(const std::string& assignment) {
  Config config;
  ConfigOrigins origins;
  try {
    apply_setting(assignment, &config, &origins);
    check_relations(config, origins);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(ConfigFile, ShippedFileEqualsBuiltInDefaultsAndNamesEveryKey) {
  Config config;
  // Were a value missing from the file, a changed start value would survive the load.
  config.estimator.tracking.min_inliers = 77;
  ConfigOrigins origins;
  load_config_file(kShipped, &config, &origins);
  check_relations(config, origins);
  EXPECT_EQ(canonical_text(config), canonical_text(Config{}));
  for (const ConfigKey& key : config_keys()) {
    EXPECT_TRUE(origins.contains(key.name)) << key.name << " is missing from config/farpoint.yaml";
  }
}

// Above each key: at least one line that explains it, then unit, range and default as the table has them.
TEST(ConfigFile, ShippedFileDocumentsEveryKeyTruthfully) {
  std::ifstream in(kShipped);
  ASSERT_TRUE(in) << kShipped;
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    EXPECT_LE(line.size(), 120u) << line;
    lines.push_back(line);
  }
  for (const ConfigKey& key : config_keys()) {
    const std::string section = key.name.substr(0, key.name.find('.')) + ":";
    const std::string word = "  " + key.name.substr(key.name.find('.') + 1) + ":";
    auto line = std::find(lines.begin(), lines.end(), section);
    ASSERT_NE(line, lines.end()) << key.name;
    line = std::find_if(line, lines.end(), [&](const std::string& l) { return l.starts_with(word); });
    ASSERT_NE(line, lines.end()) << key.name;
    EXPECT_EQ(*(line - 1), "  # " + documentation_line(key)) << key.name;
    EXPECT_TRUE((line - 2)->starts_with("  # ")) << key.name << " is not explained";
  }
}

TEST(ConfigFile, ValuesReachTheEstimator) {
  Config config;
  ConfigOrigins origins;
  load_config_text("tracking:\n  min_inliers: 12\nlandmarks: {mode: baseline}\nscale:\n  assumed: 2.5e0\n",
                   "f.yaml", &config, &origins);
  EXPECT_EQ(config.estimator.tracking.min_inliers, 12);
  EXPECT_EQ(config.estimator.landmarks.mode, slam::LandmarkMode::kBaseline);
  EXPECT_EQ(config.scale.assumed, 2.5);
  EXPECT_EQ(origins.at("tracking.min_inliers"), "f.yaml:2");
}

// Every key takes another value than its default, alone, and gives it back: no two keys share a field.
TEST(ConfigKeys, EachKeySetsItsOwnFieldOnly) {
  for (const ConfigKey& key : config_keys()) {
    Config config;
    std::string other = "other";
    if (key.type == KeyType::kChoice) {
      other = key.get(config) == key.choices.front() ? key.choices.back() : key.choices.front();
    } else if (key.type != KeyType::kText) {
      std::ostringstream most;
      most << std::setprecision(15) << key.max;
      other = most.str();
    }
    ConfigOrigins origins;
    apply_setting(key.name + "=" + other, &config, &origins);
    EXPECT_EQ(key.get(config), other) << key.name;
    int changed = 0;
    for (const ConfigKey& each : config_keys()) changed += each.get(config) != each.get(Config{}) ? 1 : 0;
    EXPECT_EQ(changed, 1) << key.name;
  }
}

TEST(ConfigKeys, DefaultsLieInTheirRanges) {
  for (const ConfigKey& key : config_keys()) {
    if (key.type == KeyType::kChoice || key.type == KeyType::kText) continue;
    EXPECT_EQ(error_of_setting(key.name + "=" + key.get(Config{})), "") << key.name;
  }
}

// A table as a later version may have it.
const std::vector<DroppedKey> kDropped = {
    {"tracking.old_radius_px", "tracking.prior_search_px"}, {"lcm.verbose", ""}, {"stereo.rate_hz", ""}};

TEST(DroppedKeys, AKeptFileStartsWithAWarningThatNamesEachAndItsHeir) {
  Config config;
  ConfigOrigins origins;
  std::vector<std::string> warnings;
  load_config_text(
      "tracking:\n  old_radius_px: 12\n  min_inliers: 31\nlcm:\n  verbose: true\nstereo:\n  rate_hz: 10\n",
      "f.yaml", &config, &origins, &warnings, kDropped);
  EXPECT_EQ(config.estimator.tracking.min_inliers, 31);
  EXPECT_EQ(warnings, (std::vector<std::string>{
                          "f.yaml:2: tracking.old_radius_px: no key of this version, passed over; set "
                          "tracking.prior_search_px instead",
                          "f.yaml:5: lcm.verbose: no key of this version, passed over",
                          "f.yaml:6: stereo: no key of this version, passed over"}));
}

TEST(DroppedKeys, AKeyThatNeverWasStillStopsTheStart) {
  Config config;
  ConfigOrigins origins;
  std::vector<std::string> warnings;
  EXPECT_THROW(
      load_config_text("tracking:\n  old_radius: 12\n", "f.yaml", &config, &origins, &warnings, kDropped),
      ConfigError);
  EXPECT_THROW(
      load_config_text("stereos:\n  rate_hz: 12\n", "f.yaml", &config, &origins, &warnings, kDropped),
      ConfigError);
  EXPECT_TRUE(warnings.empty());
}

TEST(DroppedKeys, NoneIsAKeyOfThisVersionAndEachHeirIs) {
  std::set<std::string> names;
  for (const ConfigKey& key : config_keys()) names.insert(key.name);
  for (const DroppedKey& key : dropped_keys()) {
    EXPECT_FALSE(names.contains(key.name)) << key.name;
    if (!key.heir.empty()) {
      EXPECT_TRUE(names.contains(key.heir)) << key.heir;
    }
  }
}

TEST(ConfigMistakes, AMavlinkLinkThatIsNoneIsRefusedWithItsPlace) {
  const std::string expected =
      ", expected udp:ADDRESS:PORT, udp:ADDRESS:PORT:LOCAL_PORT (IPv4 numbers) or serial:DEVICE:BAUD, like "
      "serial:/dev/ttyS1:921600";
  EXPECT_EQ(error_of("mavlink:\n  link: tcp:127.0.0.1:5760\n"),
            "f.yaml:2: mavlink.link: 'tcp:127.0.0.1:5760'" + expected);
  EXPECT_EQ(error_of_setting("mavlink.link=serial:/dev/ttyS1"),
            "--set: mavlink.link: 'serial:/dev/ttyS1'" + expected);
  EXPECT_EQ(error_of("mavlink:\n  link: udp:10.1.2.3:14550:14540\n"), "");
}

TEST(ConfigMistakes, UnknownKeySaysFileLineAndTheNearestKey) {
  EXPECT_EQ(error_of("log:\n  level: info\ntracking:\n  min_inlier: 30\n"),
            "f.yaml:4: tracking.min_inlier: unknown key, did you mean 'tracking.min_inliers'?");
  EXPECT_EQ(error_of("traking:\n  min_inliers: 30\n"),
            "f.yaml:1: traking: unknown key, did you mean 'tracking'?");
  EXPECT_EQ(error_of("tracking:\n  max_interval_s: 3\n"),
            "f.yaml:2: tracking.max_interval_s: unknown key, did you mean 'keyframes.max_interval_s'?");
  EXPECT_EQ(error_of("zzzzzzzzzz: 1\n"),
            "f.yaml:1: zzzzzzzzzz: unknown key, expected a key of config/farpoint.yaml");
}

TEST(ConfigMistakes, WrongTypeSaysWhatWasExpected) {
  EXPECT_EQ(error_of("tracking:\n  min_inliers: many\n"),
            "f.yaml:2: tracking.min_inliers: 'many', expected an integer from 4 to 20000 (landmarks)");
  EXPECT_EQ(error_of("tracking:\n  min_inliers: 3.5\n"),
            "f.yaml:2: tracking.min_inliers: '3.5', expected an integer from 4 to 20000 (landmarks)");
  EXPECT_EQ(error_of("tracking:\n  min_inliers: \"30\"\n"),
            "f.yaml:2: tracking.min_inliers: text '30', expected an integer from 4 to 20000 (landmarks) "
            "without quotes");
  EXPECT_EQ(error_of("tracking:\n  min_inliers: 30px\n"),
            "f.yaml:2: tracking.min_inliers: '30px', expected an integer from 4 to 20000 (landmarks)");
  EXPECT_EQ(error_of("tracking:\n  min_inliers: [30]\n"),
            "f.yaml:2: tracking.min_inliers: a list, expected an integer from 4 to 20000 (landmarks)");
  EXPECT_EQ(error_of("tracking:\n  min_inliers:\n"),
            "f.yaml:2: tracking.min_inliers: nothing, expected an integer from 4 to 20000 (landmarks)");
  EXPECT_EQ(error_of("tracking:\n  min_inliers: {a: 1}\n"),
            "f.yaml:2: tracking.min_inliers: a section, expected an integer from 4 to 20000 (landmarks)");
  EXPECT_EQ(error_of("tracking: 3\n"), "f.yaml:1: tracking: expected a section with keys below it");
  EXPECT_EQ(error_of("landmarks:\n  mode: vpm\n"),
            "f.yaml:2: landmarks.mode: 'vpm', expected one of baseline | vmp");
  EXPECT_EQ(error_of("lcm:\n  url: ''\n"), "f.yaml:2: lcm.url: '', expected text");
}

// Found by a fuzzer: the library's LoadAll() never came back.
TEST(ConfigMistakes, TextThatIsNoYamlIsRefusedAndEnds) {
  EXPECT_EQ(error_of(",trackingP.\n  min_inliers: 12\n"), "f.yaml:1: a second document, expected one");
  EXPECT_NE(error_of(","), "");
}

TEST(ConfigMistakes, OutOfRange) {
  EXPECT_EQ(error_of("pyramid:\n  levels: 0\n"),
            "f.yaml:2: pyramid.levels: '0', expected an integer from 1 to 16 (levels)");
  EXPECT_EQ(error_of("pyramid:\n  scale_factor: 1\n"),
            "f.yaml:2: pyramid.scale_factor: '1', expected a number from 1.05 to 2");
  for (const char* odd :
       {"nan", ".nan", "inf", ".inf", "1e400", "-1", "99999999999999999999", "0x10", "1_000", ""}) {
    EXPECT_NE(error_of(std::string("scale:\n  assumed: ") + odd + "\n"), "") << odd;
    EXPECT_NE(error_of_setting(std::string("tracking.min_inliers=") + odd), "") << odd;
  }
}

TEST(ConfigMistakes, DuplicateKeysAndSections) {
  EXPECT_EQ(error_of("log:\n  level: info\n  level: debug\n"),
            "f.yaml:3: log.level: duplicate key, expected it once (first in line 2)");
  EXPECT_EQ(error_of("log:\n  level: info\nscale:\n  assumed: 0\nlog:\n  level: debug\n"),
            "f.yaml:5: log: duplicate key, expected it once (first in line 1)");
}

TEST(ConfigMistakes, MalformedYaml) {
  EXPECT_TRUE(error_of("log:\n  level: [info\nscale:\n").starts_with("f.yaml:"))
      << error_of("log:\n  level: [info\n");
  EXPECT_NE(error_of("log:\n  level: [info\n").find("not YAML"), std::string::npos);
  EXPECT_TRUE(error_of("log:\n\tlevel: info\n").starts_with("f.yaml:2: not YAML"))
      << error_of("log:\n\tlevel: info\n");
  EXPECT_EQ(error_of("- a\n- b\n"), "f.yaml:1: not a map, expected 'section:' and 'key: value' lines");
  EXPECT_EQ(error_of("log:\n  level: info\n---\nlog:\n  level: info\n"),
            "f.yaml:3: a second document, expected one");
  EXPECT_EQ(error_of("? [a, b]\n: 1\n"), "f.yaml:1: a key is not a word, expected 'section: key: value'");
  EXPECT_NE(error_of("log: &a\n  level: *b\n"), "");
  EXPECT_NE(error_of(std::string(100000, '[')), "");
  EXPECT_NE(error_of(std::string("log:\n  level: \0info\n", 20)), "");
}

TEST(ConfigMistakes, OneLineEachWhateverTheText) {
  for (const char* text :
       {"log:\n  level: |\n    a\n    b\n", "\"a\\nb\": 1\n", "log:\n  \"x\\ty\\n\": 1\n"}) {
    const std::string error = error_of(text);
    EXPECT_FALSE(error.empty()) << text;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST(ConfigMistakes, RelationsNameThePlaceOfTheKeyThatWasSet) {
  EXPECT_EQ(error_of("tracking:\n  min_inliers: 60\n"),
            "f.yaml:2: tracking.min_inliers: 60, expected at most tracking.degraded_inliers (50)");
  EXPECT_EQ(error_of_setting("tracking.degraded_inliers=10"),
            "--set: tracking.min_inliers: 30, expected at most tracking.degraded_inliers (10)");
}

TEST(ConfigMistakes, TheSecondCameraFitsTheFirst) {
  const std::string second = "camera:\n  second_device: /dev/video2\n";
  EXPECT_EQ(error_of(second), "");
  EXPECT_EQ(error_of(second + "  device: /dev/video2\n"),
            "f.yaml:2: camera.second_device: '/dev/video2', expected another camera than camera.device");
  EXPECT_EQ(error_of(second + "  driver: libcamera\n"),
            "f.yaml:2: camera.second_device: '/dev/video2', expected 'none' with camera.driver libcamera");
  EXPECT_EQ(error_of(second + "  driver: file\n"),
            "f.yaml:2: camera.second_device: '/dev/video2', expected 'none' with camera.driver file");
  EXPECT_EQ(error_of(second + "  driver: lcm\n"), "");
  EXPECT_EQ(error_of(second + "  pair_tolerance_us: 16667\n"),
            "f.yaml:3: camera.pair_tolerance_us: 16667, expected less than half a frame period of "
            "camera.rate_hz (30)");
  EXPECT_EQ(error_of(second + "  pair_tolerance_us: 16666\n"), "");
  EXPECT_EQ(error_of(second + "  rate_hz: 100\n"),
            "built-in defaults: camera.pair_tolerance_us: 5000, expected less than half a frame period of "
            "camera.rate_hz (100)");
  // Where there is no rate, or no second camera, there is nothing to hold it against.
  EXPECT_EQ(error_of(second + "  rate_hz: 0\n  pair_tolerance_us: 90000\n"), "");
  EXPECT_EQ(error_of("camera:\n  driver: libcamera\n  pair_tolerance_us: 90000\n"), "");
}

TEST(ConfigMistakes, Settings) {
  EXPECT_EQ(error_of_setting("tracking.min_inliers"),
            "--set: 'tracking.min_inliers', expected dotted.key=value, like tracking.min_inliers=30");
  EXPECT_EQ(error_of_setting("=3"), "--set: '=3', expected dotted.key=value, like tracking.min_inliers=30");
  EXPECT_EQ(error_of_setting("tracking=3"),
            "--set: tracking: a section, expected one of its keys, like tracking.key=value");
  EXPECT_EQ(error_of_setting("tracking.min_inlers=30"),
            "--set: tracking.min_inlers: unknown key, did you mean 'tracking.min_inliers'?");
  EXPECT_EQ(error_of_setting("log.level=loud"),
            "--set: log.level: 'loud', expected one of debug | info | warning | error");
}

TEST(ConfigMistakes, MissingFileAndFolder) {
  Config config;
  ConfigOrigins origins;
  try {
    load_config_file("/nonexistent/f.yaml", &config, &origins);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "/nonexistent/f.yaml: cannot be opened (No such file or directory), expected a YAML file");
  }
  EXPECT_THROW(load_config_file("/tmp", &config, &origins), ConfigError);
}

TEST(ConfigFile, EmptyFilesAndSectionsKeepDefaults) {
  EXPECT_EQ(error_of(""), "");
  EXPECT_EQ(error_of("# nothing\n"), "");
  EXPECT_EQ(error_of("tracking:\n  # min_inliers: 3\nlog:\n  level: info\n"), "");
}

TEST(CanonicalText, ReadsBackToTheSameConfigurationAndHashTellsDifferences) {
  Config config;
  config.estimator.tracking.prior_search_px = 1.0 / 3.0 + 10.0;
  config.lcm.url = "udpm://x?a=\"b\\c\"";
  Config again;
  ConfigOrigins origins;
  load_config_text(canonical_text(config), "f.yaml", &again, &origins);
  EXPECT_EQ(canonical_text(again), canonical_text(config));
  EXPECT_EQ(again.estimator.tracking.prior_search_px, config.estimator.tracking.prior_search_px);
  EXPECT_EQ(config_hash(again), config_hash(config));
  EXPECT_NE(config_hash(config), config_hash(Config{}));
  // Reference values of FNV-1a 64.
  EXPECT_EQ(fnv1a_64(""), 0xcbf29ce484222325ULL);
  EXPECT_EQ(fnv1a_64("a"), 0xaf63dc4c8601ec8cULL);
  EXPECT_EQ(fnv1a_64("foobar"), 0x85944171f73967e8ULL);
}

}  // namespace
}  // namespace farpoint::daemon
