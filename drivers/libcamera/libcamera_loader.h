// SPDX-License-Identifier: Apache-2.0
// Finds and loads the module that drives libcamera.
#pragma once

#include <memory>
#include <string>

#include "drivers/libcamera/libcamera_system.h"

namespace farpoint::drivers {

// Returns lib/farpoint beside the program's folder, both in a build folder and on a system.
[[nodiscard]] std::string libcamera_module_path();

// Call before other threads start and memory is locked. Returns null and fills *problem without the module,
// without libcamera, or with a module of another build. A loaded module stays loaded, since libcamera has
// threads.
[[nodiscard]] std::unique_ptr<LibcameraSystem> load_libcamera(const std::string& path, std::string* problem);

}  // namespace farpoint::drivers
