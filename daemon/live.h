// SPDX-License-Identifier: Apache-2.0
// The daemon on the vehicle: a camera in, until it is told to stop.
#pragma once

#include <functional>
#include <memory>

#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/pipeline/pipeline.h"
#include "drivers/camera/camera.h"

namespace farpoint::daemon {

// What tests put in the machine's place.
struct LiveEnvironment {
  // Null: the one that is configured. The second is used where one is configured.
  std::unique_ptr<drivers::Camera> camera, second_camera;
  ThreadHooks hooks;
};

// Runs until SIGTERM or SIGINT. SIGHUP calls `reload` and takes over what may change meanwhile; what may not
// is said. Returns the exit status. Throws UsageError, ConfigError or InputError before the first frame,
// std::runtime_error while running.
int live(const Options& options, const Config& config, const std::function<Config()>& reload,
         LiveEnvironment environment = {});

// The driver's options of one camera: 0 the tracked one, 1 the second.
[[nodiscard]] drivers::CameraOptions camera_options(const Config& config, const calibration_t& calibration,
                                                    int index);

// Names of the keys whose values differ and that do not take effect before a restart; empty: none.
[[nodiscard]] std::string keys_that_need_a_restart(const Config& running, const Config& wanted);

}  // namespace farpoint::daemon
