// SPDX-License-Identifier: Apache-2.0
// Finds and loads the module with the Ceres solver, for `mapping.solver: ceres`.
#pragma once

#include <string>

#include "slam/config.h"

namespace farpoint::daemon {

// The module's place: lib/farpoint beside the program's own folder, in a build folder as on a system.
[[nodiscard]] std::string ceres_module_path();

// Loads the module's solver into the options where they ask for Ceres. The module stays loaded. Call this
// before memory is locked. Throws ConfigError where the module is missing or of another build.
void load_solver(const std::string& path, slam::MappingConfig* mapping);

}  // namespace farpoint::daemon
