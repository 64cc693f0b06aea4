// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/bench.h"

#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <span>
#include <stdexcept>
#include <vector>

#include "daemon/config/mask_file.h"
#include "daemon/config/rig.h"
#include "daemon/input/log_frame_source.h"
#include "daemon/system/solver_loader.h"
#include "slam/estimator.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

// As ORB-SLAM3 is set up for KITTI; the other parameters are the same by default (8 levels of 1.2, FAST 20).
constexpr int kYardstickFeatures = 2000;

class Yardstick {
 public:
  // Thread-CPU milliseconds.
  double measure(const ipc::GreyImage& image) {
    const cv::Mat view(image.height_px, image.width_px, CV_8U, const_cast<std::uint8_t*>(image.data()));
    const double began_s = daemon::thread_cpu_s();
    orb_->detectAndCompute(view, cv::noArray(), points_, descriptors_);
    return 1e3 * (daemon::thread_cpu_s() - began_s);
  }

 private:
  cv::Ptr<cv::ORB> orb_ = cv::ORB::create(kYardstickFeatures);
  std::vector<cv::KeyPoint> points_;
  cv::Mat descriptors_;
};

FrameTimes times_of(const daemon::StageClock& clock) {
  FrameTimes times;
  for (int s = 0; s < daemon::StageClock::kStages; ++s) {
    times.cpu_ms[static_cast<std::size_t>(s)] = clock.cpu_ms(s);
    times.wall_ms[static_cast<std::size_t>(s)] = clock.wall_ms(s);
  }
  return times;
}

BenchPass run_pass(const BenchOptions& options, const daemon::Config& config,
                   const std::function<void(double)>& progress) {
  daemon::LogFrameSource source(options.log, config);
  std::unique_ptr<slam::Estimator> estimator;
  Yardstick yardstick;
  daemon::StageClock clock;
  daemon::SourceFrame frame;
  BenchPass pass;
  for (;;) {
    clock.new_frame();
    const double began_s = daemon::process_cpu_s();
    if (!source.next(&frame, &clock)) break;
    if (!estimator) {
      slam::Rig rig = daemon::make_rig(source.calibration(), config.camera);
      daemon::read_masks(config.camera, source.calibration(), &rig);
      estimator = std::make_unique<slam::Estimator>(config.estimator, rig);
      estimator->listen(&clock);
    }
    slam::FrameInput input{frame.meta.utime, frame.meta.sequence, 0, frame.view()};
    slam::CameraImage second{1, {}};
    if (frame.second != nullptr) {
      second.image = daemon::SourceFrame::view_of(*frame.second);
      input.others = std::span(&second, 1);
    }
    const bool followed = estimator->process(input).followed();
    const double ended_s = daemon::process_cpu_s();
    if (!followed) clock.forget(timing_t::STAGE_TRACKING);
    FrameTimes times = times_of(clock);
    // The first frame's share holds the setting up of all memory.
    times.process_cpu_ms = 1e3 * (ended_s - began_s);
    times.yardstick_ms = yardstick.measure(*frame.image);
    pass.frames.push_back(times);
    progress(source.progress());
  }
  return pass;
}

}  // namespace

BenchReport run_bench(const BenchOptions& options, const daemon::Config& given,
                      const BenchProgress& progress) {
  cv::setNumThreads(1);
  std::vector<BenchPass> passes;
  daemon::Config config = given;
  try {
    daemon::load_solver(daemon::ceres_module_path(), &config.estimator.mapping);
    const std::size_t most = 2 * options.passes;
    while (passes.size() < options.passes ||
           (passes.size() < most && !enough_calm_passes(passes, options.passes))) {
      const std::size_t number = passes.size() + 1;
      passes.push_back(run_pass(options, config, [&](double share) { progress(number, share); }));
    }
  } catch (const daemon::InputError& error) {
    throw InputError(error.what());
  } catch (const daemon::ConfigError& error) {
    throw InputError(error.what());
  } catch (const std::invalid_argument& error) {
    throw InputError(options.log + ": " + error.what());
  }
  return make_report(passes, options.passes);
}

}  // namespace farpoint::tools
