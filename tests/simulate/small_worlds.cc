// SPDX-License-Identifier: Apache-2.0
#include "tests/simulate/small_worlds.h"

#include <gtest/gtest.h>

#include "tests/support/paths.h"
#include "tools/common/text_file.h"
#include "tools/simulate/world/world_file.h"

namespace farpoint::tools::simulate {

SimulationRequest request_for(const std::string& world, int width_px, int height_px, double duration_s,
                              const std::vector<Change>& changes) {
  SimulationRequest request;
  request.world_name = world;
  request.world_file = test::source_dir() + "/config/worlds/" + world + ".yaml";
  request.world_text = read_file(request.world_file);
  for (const Change& change : changes) {
    const std::size_t at =
        change.from.empty() ? request.world_text.size() : request.world_text.find(change.from);
    EXPECT_NE(at, std::string::npos) << "'" << change.from << "' is not in " << request.world_file;
    request.world_text.replace(at, change.from.size(), change.to);
  }
  request.duration_s = duration_s;
  request.width_px = width_px;
  request.height_px = height_px;
  return request;
}

}  // namespace farpoint::tools::simulate
