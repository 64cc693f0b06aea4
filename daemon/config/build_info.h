// Which program this is: version, commit, compiler.
#pragma once

#include <string>

namespace farpoint::daemon {

// "0.1.0 d5b1904 gcc-12.2.0 Release"; the commit ends in "-dirty" where the source was changed.
[[nodiscard]] std::string build_text();

}  // namespace farpoint::daemon
