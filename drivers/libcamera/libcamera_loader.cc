// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera/libcamera_loader.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "drivers/camera/foreign_threads.h"

namespace farpoint::drivers {
namespace {

// What the operator asked for stays; else errors alone: it looks for a lost camera once a second, and would
// repeat its warnings as often.
void quieten_libcamera() {
  constexpr int kKeepIfSet = 0;
  (void)setenv("LIBCAMERA_LOG_LEVELS", "*:ERROR", kKeepIfSet);
}

template <typename Function>
Function symbol(void* module, const char* name) {
  return reinterpret_cast<Function>(dlsym(module, name));
}

}  // namespace

std::string libcamera_module_path() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path().parent_path() / "lib/farpoint/farpoint_libcamera.so").string();
}

std::unique_ptr<LibcameraSystem> load_libcamera(const std::string& path, std::string* problem) {
  limit_foreign_threads();
  quieten_libcamera();
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) {
    *problem = dlerror();
    return nullptr;
  }
  const auto interface = symbol<LibcameraInterfaceFunction>(module, kLibcameraInterfaceName);
  const auto make = symbol<MakeLibcameraFunction>(module, kMakeLibcameraName);
  if (interface == nullptr || make == nullptr || interface() != kLibcameraInterface) {
    *problem = path + ": of another version than this program";
    return nullptr;
  }
  return std::unique_ptr<LibcameraSystem>(make());
}

}  // namespace farpoint::drivers
