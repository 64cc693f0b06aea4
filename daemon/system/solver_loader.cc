// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/solver_loader.h"

#include <dlfcn.h>

#include <filesystem>
#include <system_error>

#include "daemon/config/config.h"
#include "slam/ceres_module.h"

namespace farpoint::daemon {
namespace {

template <typename Function>
Function symbol(void* module, const char* name) {
  return reinterpret_cast<Function>(dlsym(module, name));
}

[[noreturn]] void fail(const std::string& problem) {
  throw ConfigError("configuration: mapping.solver: ceres: its module cannot be loaded: " + problem +
                    "; expected mapping.solver: schur, or the module");
}

// A BLAS with threads sums in another order each time. OpenBLAS has them, the reference BLAS has none.
void make_blas_single_threaded(void* module) {
  if (const auto set_threads = symbol<void (*)(int)>(module, "openblas_set_num_threads")) set_threads(1);
}

}  // namespace

std::string ceres_module_path() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path().parent_path() / "lib/farpoint/farpoint_ceres.so").string();
}

void load_solver(const std::string& path, slam::MappingConfig* mapping) {
  if (mapping->solver != "ceres") return;
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) fail(dlerror());
  const auto interface = symbol<slam::CeresInterfaceFunction>(module, slam::kCeresInterfaceName);
  const auto solve = symbol<slam::SolveBundle>(module, slam::kSolveCeresName);
  if (interface == nullptr || solve == nullptr || interface() != slam::kCeresInterface)
    fail(path + ": of another version than this program");
  make_blas_single_threaded(module);
  mapping->solve_instead = solve;
}

}  // namespace farpoint::daemon
