// SPDX-License-Identifier: Apache-2.0
// Where the sources and the build lie. The paths are compiled into one file of their own, so that the objects
// of all other tests are the same in every clone and ccache finds them.
#pragma once

#include <string>

namespace farpoint::test {

// Absolute paths without a slash at the end.
[[nodiscard]] std::string source_dir();
[[nodiscard]] std::string binary_dir();

}  // namespace farpoint::test
