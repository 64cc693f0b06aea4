// SPDX-License-Identifier: Apache-2.0
// A session over the synthetic camera, with sinks that keep what it publishes.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "daemon/config/rig.h"
#include "daemon/pipeline/session.h"
#include "ipc/image_codec.h"
#include "tests/daemon/output/published.h"
#include "tests/daemon/synthetic_log.h"

namespace farpoint::daemon {

class SessionFixture : public ::testing::Test {
 protected:
  SessionFixture() {
    config_.estimator.extractor.features = 400;
    config_.realtime.least_features = 200;
    config_.realtime.capture_queue = 3;
    publisher_.add(std::make_unique<test::KeptMessageSink>(&kept_));
    session_ = std::make_unique<Session>(config_, make_rig(test::synthetic_calibration(), 0),
                                         Session::Options{"calibration", 7, true},
                                         std::vector<PoseSink*>{&sink_}, &publisher_);
  }
  [[nodiscard]] static ipc::GreyImage grey(int number) {
    const image_t image = test::synthetic_image({}, number);
    return {image.width, image.height, image.data};
  }

  Config config_;
  test::KeptMessages kept_;
  test::KeptFrames sink_;
  Publisher publisher_;
  std::unique_ptr<Session> session_;
};

}  // namespace farpoint::daemon
