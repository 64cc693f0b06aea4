// SPDX-License-Identifier: Apache-2.0
// Identity of this program: version, commit, compiler.
#pragma once

#include <string>

namespace farpoint::daemon {

// "0.1.0 d5b1904 gcc-12.2.0 Release"; the commit of a changed source ends in "-dirty".
[[nodiscard]] std::string build_text();

}  // namespace farpoint::daemon
