// SPDX-License-Identifier: Apache-2.0
// Strict world files (config/worlds/*.yaml): every error names file, line, key and what was expected.
#pragma once

#include <filesystem>
#include <string>

#include "tools/simulate/world/world_description.h"

namespace farpoint::tools::simulate {

// Returns the file of WORLD: a path, or a name of config/worlds beside the program's source or installation.
// Throws InputError without such a file.
[[nodiscard]] std::filesystem::path find_world(const std::string& path_or_name);

// Throws InputError. `text` is the file's content and `file` its name in errors; the world's name is the
// file's stem.
[[nodiscard]] WorldDescription parse_world(const std::string& text, const std::filesystem::path& file);

}  // namespace farpoint::tools::simulate
