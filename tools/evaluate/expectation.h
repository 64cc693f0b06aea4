// SPDX-License-Identifier: Apache-2.0
// Conditions on evaluated runs, for tests and CI: `NAME.METRIC OP [FACTOR] NAME.METRIC` or `NAME.METRIC OP
// NUMBER`.
//
//   NAME     a run's file stem
//   METRIC   a key of --json by its dotted path (final.ate_rmse_m, tracking_ms.p99), or of `final` without it
//            (ate_rmse_m, share), or short: ate, live_ate
//   OP       <  <=  >  >=  ==
//   FACTOR   a number before the right-hand metric, with or without '*'
// A metric that the run does not have (null: a lost run has no error) breaks every condition.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/common/json.h"

namespace farpoint::tools {

struct ExpectationResult {
  bool holds = false;
  std::string text;  // the condition with its values
};

// runs: name and to_json() of each. Throws InputError for a malformed condition and for an unknown run or
// metric.
[[nodiscard]] ExpectationResult check_expectation(const std::string& condition,
                                                  const std::vector<std::pair<std::string, Json>>& runs);

}  // namespace farpoint::tools
