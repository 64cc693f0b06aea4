// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/build_info.h"

#include "farpoint_build.h"  // made at build time: FARPOINT_VERSION, FARPOINT_COMMIT, FARPOINT_BUILD_TYPE

namespace farpoint::daemon {

std::string build_text() {
  return std::string(FARPOINT_VERSION " " FARPOINT_COMMIT " gcc-") + std::to_string(__GNUC__) + "." +
         std::to_string(__GNUC_MINOR__) + "." + std::to_string(__GNUC_PATCHLEVEL__) + " " FARPOINT_BUILD_TYPE;
}

}  // namespace farpoint::daemon
