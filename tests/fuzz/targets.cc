// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/targets.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace farpoint::fuzz {

std::span<const Target> targets() {
  static const std::vector<Target> all = {
      {"log", run_log, seeds_of_log, 16384},
      {"message", run_message, seeds_of_message, 4096},
      {"image", run_image, seeds_of_image, 8192},
      {"config", run_config, seeds_of_config, 4096},
      {"camera", run_camera, seeds_of_camera, 2048},
      {"world", run_world, seeds_of_world, 4096},
      {"dbc", run_dbc, seeds_of_dbc, 2048},
      {"can", run_can, seeds_of_can, 1024},
      {"control", run_control, seeds_of_control, 512},
      {"evaluate", run_evaluate, seeds_of_run, 16384},
      {"report", run_report, seeds_of_run, 16384},
      {"bag", run_bag, seeds_of_bag, 4096},
      {"db3", run_db3, seeds_of_db3, 8192},
      {"stamps", run_stamps, seeds_of_stamps, 512},
      {"mavlink", run_mavlink, seeds_of_mavlink, 1024},
      {"layout", run_layout, seeds_of_layout, 1024},
  };
  return all;
}

const Target& target_of(std::string_view name) {
  const auto all = targets();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Target& t) { return t.name == name; });
  if (found == all.end()) throw std::out_of_range("no fuzz target " + std::string(name));
  return *found;
}

void require(bool holds, std::string_view what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: broken: %.*s\n", static_cast<int>(what.size()), what.data());
  std::abort();
}

}  // namespace farpoint::fuzz
