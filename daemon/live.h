// SPDX-License-Identifier: Apache-2.0
// The daemon on the vehicle: from a camera, until a signal.
#pragma once

#include <functional>
#include <memory>

#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/pipeline/pipeline.h"
#include "drivers/camera/camera.h"

namespace farpoint::daemon {

// What tests replace of the machine.
struct LiveEnvironment {
  // Null: the configured one. The second is used where one is configured.
  std::unique_ptr<drivers::Camera> camera, second_camera;
  ThreadHooks hooks;
};

// Runs until SIGTERM or SIGINT. SIGHUP calls `reload` and takes over the keys that may change meanwhile; the
// others are logged. A file or network that cannot be used does not stop the run (SideFunctions). Returns the
// exit status. Throws UsageError, ConfigError or InputError before the first frame, std::runtime_error while
// running.
int live(const Options& options, const Config& config, const std::function<Config()>& reload,
         LiveEnvironment environment = {});

// Names of the keys whose values differ and that do not take effect before a restart; empty: none.
[[nodiscard]] std::string keys_that_need_a_restart(const Config& running, const Config& wanted);

}  // namespace farpoint::daemon
