// SPDX-License-Identifier: Apache-2.0
// The short form: every seed, every kept input and damaged seeds once through each target, without a fuzzer.
// A target ends the program where a promise is broken, so that the test fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/fuzz/targets.h"
#include "tests/support/paths.h"

namespace farpoint::fuzz {
namespace {

class Fuzz : public testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] const Target& target() const { return target_of(GetParam()); }
};

TEST_P(Fuzz, SeedsPass) {
  const std::vector<Bytes> seeds = target().seeds();
  ASSERT_FALSE(seeds.empty());
  for (const Bytes& seed : seeds) {
    EXPECT_FALSE(seed.empty());
    target().run(seed);
  }
}

// What a fuzzer has found once: files TARGET.NAME.
TEST_P(Fuzz, KeptInputsPass) {
  const std::filesystem::path folder = test::source_dir() + "/tests/fuzz/corpus";
  ASSERT_TRUE(std::filesystem::exists(folder));
  std::vector<std::filesystem::path> files(std::filesystem::directory_iterator(folder), {});
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    if (file.stem() != GetParam()) continue;
    std::ifstream stream(file, std::ios::binary);
    const Bytes input{std::istreambuf_iterator<char>(stream), {}};
    target().run(input);
  }
}

TEST_P(Fuzz, DamagedSeedsPass) {
  constexpr int kRounds = 40;
  std::mt19937 random(11);
  target().run({});
  for (const Bytes& seed : target().seeds()) {
    for (int round = 0; round < kRounds; ++round) {
      Bytes damaged = seed;
      for (unsigned change = 0; change <= random() % 4; ++change) {
        const std::size_t at = random() % damaged.size();
        damaged[at] = round % 2 == 0 ? static_cast<std::uint8_t>(random())
                                     : static_cast<std::uint8_t>(damaged[at] ^ 1U << random() % 8);
      }
      if (round % 5 == 0) damaged.resize(random() % damaged.size());
      target().run(damaged);
    }
  }
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const Target& target : targets()) all.push_back(target.name);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Targets, Fuzz, testing::ValuesIn(names()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace farpoint::fuzz
