#include "tools/simulate/recorder.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "daemon/calibration_message.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tools/common/errors.h"
#include "tools/common/progress.h"
#include "tools/simulate/motion_sensors.h"

namespace farpoint::tools::simulate {
namespace {

volatile std::sig_atomic_t stop_signal = 0;

// Ctrl-C and SIGTERM end the run in order; a reader that goes away (SIGPIPE) or a file size limit (SIGXFSZ)
// becomes an error of the write.
class SignalsAsErrors {
 public:
  SignalsAsErrors() {
    stop_signal = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      stopping_[i] = std::signal(kStopping[i], [](int signal) { stop_signal = signal; });
      writing_[i] = std::signal(kWriting[i], SIG_IGN);
    }
  }
  ~SignalsAsErrors() {
    for (std::size_t i = 0; i < 2; ++i) {
      std::signal(kStopping[i], stopping_[i]);
      std::signal(kWriting[i], writing_[i]);
    }
  }
  SignalsAsErrors(const SignalsAsErrors&) = delete;
  SignalsAsErrors& operator=(const SignalsAsErrors&) = delete;

 private:
  static constexpr int kStopping[2] = {SIGINT, SIGTERM}, kWriting[2] = {SIGPIPE, SIGXFSZ};
  void (*stopping_[2])(int);
  void (*writing_[2])(int);
};

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::int64_t to_utime(double time_s) {
  return std::llround(time_s * 1e6);
}

calibration_t calibration_of(const Simulation& simulation) {
  const WorldDescription& world = simulation.description();
  calibration_t message{};
  message.body_name = world.drive ? "vehicle" : "drone";
  for (int i = 0; i < simulation.cameras(); ++i) {
    const char* name = simulation.cameras() == 1 ? "camera" : i == 0 ? "left" : "right";
    message.cameras.push_back(daemon::camera_message(name, simulation.camera(i).parameters(),
                                                     simulation.T_body_camera(i), world.camera.rate_hz,
                                                     simulation.row_time_s()));
  }
  message.ncameras = simulation.cameras();
  message.imu_orientation[0] = 1.0;
  if (!world.imu) return message;
  message.has_imu = 1;
  daemon::set_pose(world.imu->T_body_imu, message.imu_position, message.imu_orientation);
  message.imu_rate_hz = world.imu->rate_hz;
  message.gyro_noise_density = world.imu->gyro_noise_density;
  message.gyro_random_walk = world.imu->gyro_random_walk;
  message.accel_noise_density = world.imu->accel_noise_density;
  message.accel_random_walk = world.imu->accel_random_walk;
  return message;
}

class Recorder {
 public:
  Recorder(Simulation* simulation, const RecorderOptions& options, ipc::LogWriter* log)
      : simulation_(*simulation), options_(options), log_(*log) {
    const WorldDescription& world = simulation_.description();
    if (world.imu) imu_ = std::make_unique<ImuSensor>(*world.imu, simulation_.seed());
    if (world.wheels) wheels_ = std::make_unique<WheelSensor>(*world.wheels, simulation_.seed());
  }

  bool write_head() {
    return log_.write_message(ipc::kCalibrationChannel, 0, calibration_of(simulation_)) &&
           log_.write_message(ipc::kSimulationChannel, 0, simulation_.message());
  }

  // One frame and what was measured since the one before. False where the log could not take it.
  bool write_frame(std::int64_t frame) {
    const double time_s = simulation_.frame_time_s(frame);
    if (!write_motion(time_s)) return false;
    ground_truth_t truth{};
    truth.utime = to_utime(time_s);
    truth.has_orientation = 1;
    daemon::set_pose(simulation_.body().pose_at(time_s), truth.position, truth.orientation);
    if (!log_.write_message(ipc::kGroundTruthChannel, truth.utime, truth)) return false;
    for (int camera = 0; camera < simulation_.cameras(); ++camera) {
      if (!write_image(frame, camera)) return false;
    }
    return log_.flush();
  }

 private:
  bool write_motion(double until_s) {
    const WorldDescription& world = simulation_.description();
    while (true) {
      const double imu_s = imu_ ? static_cast<double>(imu_samples_) / world.imu->rate_hz : 1e18;
      const double wheels_s = wheels_ ? static_cast<double>(wheel_samples_) / world.wheels->rate_hz : 1e18;
      if (std::min(imu_s, wheels_s) > until_s + 1e-9) return true;
      const bool is_imu = imu_s <= wheels_s;
      is_imu ? ++imu_samples_ : ++wheel_samples_;
      const double time_s = std::min(imu_s, wheels_s);
      const bool written = is_imu ? log_.write_message(ipc::kImuChannel, to_utime(time_s),
                                                       imu_->sample(simulation_.body(), time_s))
                                  : log_.write_message(ipc::kWheelsChannel, to_utime(time_s),
                                                       wheels_->sample(simulation_.body(), time_s));
      if (!written) return false;
    }
  }

  bool write_image(std::int64_t frame, int camera) {
    simulation_.take_image(frame, camera, &image_);
    const slam::Camera& model = simulation_.camera(camera);
    const cv::Mat grey(model.height_px(), model.width_px(), CV_8UC1, image_.grey.data());
    image_t message{};
    message.utime = to_utime(simulation_.frame_time_s(frame));
    message.sequence = frame;
    message.camera = camera;
    message.exposure_us = static_cast<std::int32_t>(std::lround(image_.exposure.time_s * 1e6));
    message.gain = static_cast<float>(image_.exposure.gain);
    message.width = model.width_px();
    message.height = model.height_px();
    if (options_.format == ImageFormat::kMjpeg) {
      constexpr int kQuality = 92;  // about what cameras with MJPEG do
      cv::imencode(".jpg", grey, message.data, {cv::IMWRITE_JPEG_QUALITY, kQuality});
      message.pixel_format = image_t::PIXEL_FORMAT_MJPEG;
    } else {
      message.data = image_.grey;
      message.row_stride = message.width;
      message.pixel_format = image_t::PIXEL_FORMAT_GREY;
    }
    message.size = static_cast<std::int32_t>(message.data.size());
    if (camera == 0 && options_.picture_every > 0 && frame % options_.picture_every == 0)
      write_picture(frame, grey);
    return log_.write_message(ipc::kCameraChannelPrefix + std::to_string(camera), message.utime, message);
  }

  void write_picture(std::int64_t frame, const cv::Mat& grey) const {
    char name[32];
    std::snprintf(name, sizeof name, "%06lld.png", static_cast<long long>(frame));
    const std::filesystem::path file = options_.picture_folder / name;
    if (!cv::imwrite(file.string(), grey)) throw RunError(file.string() + ": cannot be written");
  }

  Simulation& simulation_;
  const RecorderOptions& options_;
  ipc::LogWriter& log_;
  std::unique_ptr<ImuSensor> imu_;
  std::unique_ptr<WheelSensor> wheels_;
  std::int64_t imu_samples_ = 0, wheel_samples_ = 0;
  SimulatedImage image_;
};

std::unique_ptr<ipc::LogWriter> open_log(const std::string& file) {
  try {
    return std::make_unique<ipc::LogWriter>(file);
  } catch (const std::runtime_error& e) {
    throw InputError(e.what());
  }
}

// Keeps what there is and says so.
[[noreturn]] void give_up(const std::string& why, std::int64_t frames, const RecorderOptions& options,
                          ipc::LogWriter* log) {
  const std::string kept = log->keep_incomplete();
  throw RunError(options.output + ": " + why + " after " + std::to_string(frames) + " frames" +
                 (kept.empty() ? "" : "; the log so far is kept as " + kept));
}

double path_length_m(const BodyPath& body, double duration_s) {
  constexpr double kStep_s = 0.1;
  double length = 0.0;
  for (double t = 0.0; t + kStep_s <= duration_s; t += kStep_s)
    length += (body.pose_at(t + kStep_s).t - body.pose_at(t).t).norm();
  return length;
}

}  // namespace

RecorderResult record(Simulation* simulation, const RecorderOptions& options) {
  const SignalsAsErrors signals;
  const std::unique_ptr<ipc::LogWriter> log = open_log(options.output);
  Recorder recorder(simulation, options, log.get());
  RecorderResult result;
  const double start_s = thread_cpu_s();
  const std::int64_t frames = simulation->frames();
  Progress progress(simulation->description().name, static_cast<std::size_t>(frames));
  bool good = recorder.write_head();
  while (good && result.frames < frames && stop_signal == 0) {
    good = recorder.write_frame(result.frames);
    if (good) progress.advance(static_cast<std::size_t>(++result.frames));
  }
  if (!good) give_up(log->error(), result.frames, options, log.get());
  if (stop_signal != 0)
    give_up("stopped by signal " + std::to_string(stop_signal), result.frames, options, log.get());
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
