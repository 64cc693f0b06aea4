// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/stream/recorder.h"

#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <vector>

#include "ipc/channels.h"
#include "ipc/image_encoder.h"
#include "ipc/log.h"
#include "tools/common/errors.h"
#include "tools/common/progress.h"
#include "tools/simulate/sensors/measurements.h"
#include "tools/simulate/stream/kept_log.h"
#include "tools/simulate/stream/stop_signals.h"

namespace farpoint::tools::simulate {
namespace {

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class Recorder {
 public:
  Recorder(Simulation* simulation, const RecorderOptions& options, ipc::LogWriter* log)
      : simulation_(*simulation), options_(options), log_(*log), motion_(*simulation) {}

  bool write_head() {
    return log_.write_message(ipc::kCalibrationChannel, 0, calibration_of(simulation_)) &&
           log_.write_message(ipc::kSimulationChannel, 0, simulation_.message());
  }

  // One frame and what was measured since the one before. False where the log could not take it.
  bool write_frame(std::int64_t frame) {
    if (!write_motion(simulation_.frame_time_s(frame))) return false;
    const ground_truth_t truth = truth_of(simulation_, frame);
    if (!log_.write_message(ipc::kGroundTruthChannel, truth.utime, truth)) return false;
    for (int camera = 0; camera < simulation_.cameras(); ++camera) {
      if (!write_image(frame, camera)) return false;
    }
    return true;
  }

 private:
  bool write_motion(double until_s) {
    while (const std::optional<MotionSample> sample = motion_.next(until_s)) {
      const std::int64_t utime = to_utime(sample->time_s);
      const bool written =
          std::holds_alternative<imu_t>(sample->message)
              ? log_.write_message(ipc::kImuChannel, utime, std::get<imu_t>(sample->message))
              : log_.write_message(ipc::kWheelsChannel, utime, std::get<wheels_t>(sample->message));
      if (!written) return false;
    }
    return true;
  }

  bool write_image(std::int64_t frame, int camera) {
    simulation_.take_image(frame, camera, &image_);
    image_t message = grey_message(simulation_, frame, camera, image_);
    const ipc::GreyPixels grey{message.width, message.height, image_.grey};
    if (options_.format == ImageFormat::kMjpeg) {
      constexpr int kQuality = 92;  // about what cameras with MJPEG do
      message.data = ipc::encode_jpeg(grey, kQuality);
      message.pixel_format = image_t::PIXEL_FORMAT_MJPEG;
      message.row_stride = 0;
      message.size = static_cast<std::int32_t>(message.data.size());
    }
    if (camera == 0 && options_.picture_every > 0 && frame % options_.picture_every == 0)
      write_picture(frame, grey);
    return log_.write_message(ipc::kCameraChannelPrefix + std::to_string(camera), message.utime, message);
  }

  void write_picture(std::int64_t frame, const ipc::GreyPixels& grey) const {
    char name[32];
    std::snprintf(name, sizeof name, "%06lld.png", static_cast<long long>(frame));
    const std::filesystem::path file = options_.picture_folder / name;
    const std::vector<std::uint8_t> bytes = ipc::encode_png(grey);
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) throw RunError(file.string() + ": cannot be written");
  }

  Simulation& simulation_;
  const RecorderOptions& options_;
  ipc::LogWriter& log_;
  MotionMeasurements motion_;
  SimulatedImage image_;
};

std::unique_ptr<ipc::LogWriter> open_log(const std::string& file) {
  try {
    return std::make_unique<ipc::LogWriter>(file);
  } catch (const std::runtime_error& e) {
    throw InputError(e.what());
  }
}

// Keeps the incomplete log and throws with its name.
[[noreturn]] void give_up(const std::string& why, std::int64_t frames, const RecorderOptions& options,
                          ipc::LogWriter* log) {
  throw RunError(options.output + ": " + why + " after " + std::to_string(frames) + " frames" +
                 keep_incomplete(log));
}

}  // namespace

RecorderResult record(Simulation* simulation, const RecorderOptions& options) {
  const StopSignals signals;
  const std::unique_ptr<ipc::LogWriter> log = open_log(options.output);
  Recorder recorder(simulation, options, log.get());
  RecorderResult result;
  const double start_s = thread_cpu_s();
  const std::int64_t frames = simulation->frames();
  Progress progress(simulation->description().name, static_cast<std::size_t>(frames));
  bool good = recorder.write_head();
  while (good && result.frames < frames && StopSignals::received() == 0) {
    good = recorder.write_frame(result.frames);
    if (good) progress.advance(static_cast<std::size_t>(++result.frames));
  }
  if (!good) give_up(log->error(), result.frames, options, log.get());
  if (StopSignals::received() != 0)
    give_up("stopped by signal " + std::to_string(StopSignals::received()), result.frames, options,
            log.get());
  try {
    log->close();
  } catch (const std::runtime_error& e) {
    throw RunError(e.what());
  }
  result.cpu_s = thread_cpu_s() - start_s;
  result.simulated_s = static_cast<double>(frames) / simulation->description().camera.rate_hz;
  result.path_m = path_length_m(simulation->body(), result.simulated_s);
  return result;
}

}  // namespace farpoint::tools::simulate
