// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/stream/stream_sinks.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "ipc/channels.h"
#include "tools/common/errors.h"
#include "tools/simulate/stream/kept_log.h"

namespace farpoint::tools::simulate {

// --- V4L2

#ifdef FARPOINT_WITH_V4L2
VideoSink::VideoSink(int camera, std::string device, const drivers::OutputFormat& format,
                     std::unique_ptr<drivers::V4l2System> system)
    : camera_(camera), device_(std::move(device)), output_(device_, format, std::move(system)) {}

bool VideoSink::take_image(const image_t& message) {
  if (message.camera != camera_) return true;
  const int status = output_.send(message.data, message.utime);
  if (status == -EAGAIN) return false;
  if (status == -ENODEV || status == -ENXIO) throw RunError(device_ + ": was unplugged while streaming");
  if (status < 0) throw RunError(device_ + ": takes no more images (" + std::strerror(-status) + ")");
  return true;
}
#endif

// --- LCM

void LcmSink::take_calibration(const calibration_t& message) {
  publisher_.publish(ipc::kCalibrationChannel, message);
}

void LcmSink::take_imu(const imu_t& message) {
  publisher_.publish(ipc::kImuChannel, message);
}

void LcmSink::take_wheels(const wheels_t& message) {
  publisher_.publish(ipc::kWheelsChannel, message);
}

void LcmSink::take_truth(const ground_truth_t& message) {
  publisher_.publish(ipc::kGroundTruthChannel, message);
}

std::string LcmSink::losses() const {
  const std::uint64_t lost = publisher_.counts().failed + publisher_.counts().too_large;
  return lost == 0 ? "" : std::to_string(lost) + " LCM messages were not sent";
}

// --- CAN

CanSink::CanSink(std::string interface, drivers::WheelWriter writer, std::unique_ptr<drivers::SocketCan> bus)
    : interface_(std::move(interface)), writer_(std::move(writer)), bus_(std::move(bus)) {}

// A frame that the bus does not take is counted: the next speeds are newer.
void CanSink::take_wheels(const wheels_t& message) {
  (void)bus_->send(writer_.frames(message));
}

std::string CanSink::losses() const {
  std::string text;
  if (const std::uint64_t lost = bus_->counts().not_sent; lost > 0)
    text =
        std::to_string(lost) + " CAN frames were not sent (" + std::strerror(bus_->counts().last_errno) + ")";
  if (writer_.limited() > 0)
    text += (text.empty() ? "" : ", ") + std::to_string(writer_.limited()) +
            " wheel speeds were beyond their signal, and sent as its limit";
  return text;
}

// --- log

LogSink::LogSink(std::string file) : file_(std::move(file)) {
  try {
    log_ = std::make_unique<ipc::LogWriter>(file_);
  } catch (const std::runtime_error& error) {
    throw InputError(error.what());
  }
}

LogSink::~LogSink() {
  (void)LogSink::abandon();
}

template <typename Message>
void LogSink::write(const std::string& channel, const Message& message) {
  if (log_->write_message(channel, message.utime, message)) return;
  const std::string why = log_->error();
  throw RunError(file_ + ": " + why + abandon());
}

void LogSink::take_calibration(const calibration_t& message) {
  if (!has_calibration_) write(ipc::kCalibrationChannel, message);
  has_calibration_ = true;
}

void LogSink::take_imu(const imu_t& message) {
  write(ipc::kImuChannel, message);
}

void LogSink::take_wheels(const wheels_t& message) {
  write(ipc::kWheelsChannel, message);
}

void LogSink::take_truth(const ground_truth_t& message) {
  write(ipc::kGroundTruthChannel, message);
}

bool LogSink::take_image(const image_t& message) {
  write(ipc::kCameraChannelPrefix + std::to_string(message.camera), message);
  return true;
}

std::string LogSink::abandon() {
  if (ended_) return {};
  ended_ = true;
  return keep_incomplete(log_.get());
}

void LogSink::close() {
  ended_ = true;
  try {
    log_->close();
  } catch (const std::runtime_error& error) {
    throw RunError(error.what());
  }
}

}  // namespace farpoint::tools::simulate
