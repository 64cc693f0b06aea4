// SPDX-License-Identifier: Apache-2.0
// farpointd --check: would a live run work here?
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/check/findings.h"
#include "daemon/config/config.h"
#include "daemon/config/options.h"

namespace farpoint::daemon {

// Reads a configuration; *warnings gets what it says of a kept file. Throws ConfigError.
using ReadConfiguration = std::function<Config(std::vector<std::string>* warnings)>;

// Looks at everything that a live run with these options needs. A configuration that cannot be read is the
// only line then.
[[nodiscard]] Findings check_everything(const Options& options, const std::string& configuration,
                                        const ReadConfiguration& read);

// Prints the table, or JSON. Returns the exit status: 0, or 2 with an error among the lines.
int check(const Options& options, const std::string& configuration, const ReadConfiguration& read);

}  // namespace farpoint::daemon
