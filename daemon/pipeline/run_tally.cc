// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/run_tally.h"

#include "daemon/output/reasons.h"

namespace farpoint::daemon {

void RunTally::note(const slam::FrameResult& published, bool valid, const slam::EstimatorCounts& counts) {
  if (end_.frames == 0) end_.first_utime = published.utime;
  ++end_.frames;
  end_.utime = published.utime;
  end_.last = published;
  end_.counts = counts;
  if (end_.initialised_utime < 0 && counts.maps > 0) end_.initialised_utime = published.utime;
  if (!valid) {
    const auto reason = static_cast<std::size_t>(reason_of(published));
    ++end_.refused.at(reason);
    end_.refusals.at(reason) = published.refusal;
    return;
  }
  ++end_.frames_valid;
  if (keep_times_) end_.live_utimes.push_back(published.utime);
}

}  // namespace farpoint::daemon
