// Finds and loads the module that drives libcamera.
#pragma once

#include <memory>
#include <string>

#include "drivers/libcamera/libcamera_system.h"

namespace farpoint::drivers {

// Where it lies: lib/farpoint beside the program's own folder, in a build folder as on a system.
[[nodiscard]] std::string libcamera_module_path();

// Before other threads are started and memory is locked. Null with *problem filled where there is no such
// module, libcamera is not there, or they are not of one build. Once loaded it stays: libcamera has threads.
[[nodiscard]] std::unique_ptr<LibcameraSystem> load_libcamera(const std::string& path, std::string* problem);

}  // namespace farpoint::drivers
