// SPDX-License-Identifier: Apache-2.0
// World files: the shipped ones are right, and every kind of mistake is named with file, line and key.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/paths.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/simulate/world/world_file.h"

namespace farpoint::tools::simulate {
namespace {

namespace fs = std::filesystem;

const fs::path kWorlds = fs::path(test::source_dir()) / "config" / "worlds";

TEST(WorldFile, ShippedWorldsAreRight) {
  int count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(kWorlds)) {
    if (entry.path().extension() != ".yaml") continue;
    const WorldDescription world = parse_world(read_file(entry.path()), entry.path());
    EXPECT_EQ(world.name, entry.path().stem().string());
    ASSERT_TRUE(world.imu.has_value()) << world.name;
    EXPECT_FALSE(world.imu->part.empty());
    EXPECT_EQ(world.imu->rate_hz, 200.0);
    ++count;
  }
  EXPECT_GE(count, 6);
}

TEST(WorldFile, IsFoundByNameAndByPath) {
  EXPECT_EQ(find_world("town").filename(), "town.yaml");
  EXPECT_EQ(find_world((kWorlds / "yard.yaml").string()), kWorlds / "yard.yaml");
  EXPECT_THROW((void)find_world("no-such-world"), InputError);
  EXPECT_THROW((void)find_world("/no/such/file.yaml"), InputError);
}

struct Mistake {
  std::string name, from, to;
  std::vector<std::string> complaint;  // file and line are checked besides
  std::string at;                      // the line that must be named holds this; empty: `to`'s first line
};
void PrintTo(const Mistake& mistake, std::ostream* out) {
  *out << mistake.name;
}

class WorldMistake : public testing::TestWithParam<Mistake> {};

TEST_P(WorldMistake, IsNamedWithFileLineKeyAndWhatWasExpected) {
  const Mistake& mistake = GetParam();
  std::string text = read_file(kWorlds / "town.yaml");
  const std::size_t at = text.find(mistake.from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, mistake.from.size(), mistake.to);
  const std::string mark = mistake.at.empty() ? mistake.to.substr(0, mistake.to.find('\n')) : mistake.at;
  const auto line =
      1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(mark)), '\n');
  try {
    (void)parse_world(text, "my.yaml");
    FAIL() << "no InputError";
  } catch (const InputError& e) {
    const std::string message = e.what();
    EXPECT_TRUE(message.starts_with("my.yaml:" + std::to_string(line) + ": ")) << message;
    for (const std::string& part : mistake.complaint)
      EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' in: " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, WorldMistake,
    testing::Values(
        Mistake{"UnknownKey",
                "relief_m: 10",
                "releif_m: 10",
                {"terrain.releif_m", "unknown key", "relief_m"},
                ""},
        Mistake{"UnknownSection", "traffic:", "trafic:", {"trafic", "unknown key", "traffic"}, ""},
        Mistake{"OutOfRange", "hills_m: 160", "hills_m: -3", {"terrain.hills_m", "0 to 1000 m", "'-3'"}, ""},
        Mistake{"NoNumber",
                "speed_mps: 10",
                "speed_mps: fast",
                {"drive.speed_mps", "finite number", "'fast'"},
                ""},
        Mistake{"NotANumber", "speed_mps: 10", "speed_mps: .nan", {"drive.speed_mps", "finite number"}, ""},
        Mistake{"NoWholeNumber",
                "max_floors: 5",
                "max_floors: 5.5",
                {"town.max_floors", "whole number", "'5.5'"},
                ""},
        Mistake{"Word",
                "cover: fields",
                "cover: lawn",
                {"terrain.cover", "meadow, fields, gravel", "'lawn'"},
                ""},
        Mistake{"ListExpected",
                "rows_m: [-85, 0, 80, 175, 255, 350]",
                "rows_m: 80",
                {"town.rows_m", "list of numbers", "'80'"},
                ""},
        Mistake{"ListDescends",
                "rows_m: [-85, 0, 80, 175, 255, 350]",
                "rows_m: [0, 80, 60]",
                {"town.rows_m", "ascending"},
                ""},
        Mistake{"MapExpected",
                "wheels: {scale_error: 0.01, slip: 0.01}",
                "wheels: 4",
                {"wheels", "key: value", "'4'"},
                ""},
        Mistake{"Missing", "  fx_px: 718.856\n", "", {"camera.fx_px", "is missing"}, "model: pinhole"},
        Mistake{"Twice",
                "relief_m: 10",
                "relief_m: 10\n  relief_m: 11",
                {"terrain.relief_m", "twice"},
                "relief_m: 11"},
        Mistake{"FloorsContradict", "max_floors: 5", "max_floors: 1", {"town.max_floors", "min_floors"}, ""},
        Mistake{"CornerOutside", "[1, 3]]", "[1, 9]]", {"drive", "pair 8", "column and row"}, "drive:"},
        Mistake{"CornerOffTheGrid",
                "[4, 1], [4, 2]",
                "[4, 1], [3, 2]",
                {"drive", "pair 2", "same column or row"},
                "drive:"},
        Mistake{
            "ImpossibleCamera", "cx_px: 607.1928", "cx_px: 2000", {"camera.fx_px", "cx is 2000"}, "fx_px"},
        Mistake{"DistortionLength",
                "  rate_hz: 10",
                "  distortion: [0.1, 0.2]\n  rate_hz: 10",
                {"camera.distortion", "4 numbers", "found 2"},
                ""},
        Mistake{"DriveAndFlight",
                "drive:\n",
                "flight: {points: [[0, 0, 0, 50, 0], [5, 9, 0, 50, 0]]}\ndrive:\n",
                {"one of the sections drive and flight"},
                "drive:\n"},
        Mistake{"NoYaml", "relief_m: 10", "relief_m: [10", {"not valid YAML"}, "relief_wavelength_m"}),
    [](const testing::TestParamInfo<Mistake>& info) { return info.param.name; });

}  // namespace
}  // namespace farpoint::tools::simulate
