// SPDX-License-Identifier: Apache-2.0
#include <system_error>
#include <vector>

#include "tools/common/errors.h"
#include "tools/simulate/world/world_file.h"

namespace farpoint::tools::simulate {

namespace fs = std::filesystem;

// A name is looked up in config/worlds of the tree that the program was built or installed in, and of the
// current folder.
fs::path find_world(const std::string& path_or_name) {
  std::error_code error;
  if (fs::is_regular_file(path_or_name, error)) return path_or_name;
  const bool is_name = path_or_name.find('/') == std::string::npos && !path_or_name.ends_with(".yaml");
  if (!is_name || path_or_name.empty()) {
    throw InputError(path_or_name +
                     ": no such file, expected a world file or the name of one in config/worlds");
  }
  std::vector<fs::path> folders;
  fs::path at = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up < 5 && !at.empty() && at != at.root_path(); ++up, at = at.parent_path()) {
    folders.push_back(at / "config" / "worlds");
    folders.push_back(at / "share" / "farpoint" / "worlds");
  }
  folders.emplace_back("config/worlds");
  for (const fs::path& folder : folders) {
    const fs::path file = folder / (path_or_name + ".yaml");
    if (fs::is_regular_file(file, error)) return file;
  }
  throw InputError("no world '" + path_or_name +
                   "', expected a world file or the name of one in config/worlds");
}

}  // namespace farpoint::tools::simulate
