// World files (config/worlds/*.yaml), read strictly: every complaint names file, line, key and what was
// expected.
#pragma once

#include <filesystem>
#include <string>

#include "tools/simulate/world/world_description.h"

namespace farpoint::tools::simulate {

// The file that WORLD means: a path, or a name of config/worlds beside the program's source or installation.
// Throws InputError where there is none.
[[nodiscard]] std::filesystem::path find_world(const std::string& path_or_name);

// Throws InputError. `text` is the file's content and `file` its name in complaints; the world's name is the
// file's stem.
[[nodiscard]] WorldDescription parse_world(const std::string& text, const std::filesystem::path& file);

}  // namespace farpoint::tools::simulate
