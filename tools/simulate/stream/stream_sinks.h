// SPDX-License-Identifier: Apache-2.0
// Sinks of a streamed simulation. Messages carry their due times, of CLOCK_MONOTONIC.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "drivers/can/socketcan.h"
#include "drivers/can/wheel_writer.h"
#include "farpoint/calibration_t.hpp"
#include "farpoint/ground_truth_t.hpp"
#include "farpoint/image_t.hpp"
#include "farpoint/imu_t.hpp"
#include "farpoint/wheels_t.hpp"
#include "ipc/lcm_publisher.h"
#include "ipc/log.h"

#ifdef FARPOINT_WITH_V4L2
#include "drivers/v4l2/v4l2_output.h"
#endif

namespace farpoint::tools::simulate {

// Each sink uses the messages that concern it. They throw RunError if the stream cannot continue.
class StreamSink {
 public:
  virtual ~StreamSink() = default;
  virtual void take_calibration(const calibration_t&) {}
  virtual void take_imu(const imu_t&) {}
  virtual void take_wheels(const wheels_t&) {}
  virtual void take_truth(const ground_truth_t&) {}
  // Returns false if the image cannot be accepted now; it is offered again.
  [[nodiscard]] virtual bool take_image(const image_t&) { return true; }
  // About once a second.
  virtual void maintain() {}
  // Called after the last message.
  virtual void close() {}
  // Called after an error: returns a text on the kept log for the error's message.
  [[nodiscard]] virtual std::string abandon() { return {}; }
  [[nodiscard]] virtual std::string name() const = 0;
  // Text on unsent data for the last line; empty: none.
  [[nodiscard]] virtual std::string losses() const { return {}; }
};

#ifdef FARPOINT_WITH_V4L2
class VideoSink final : public StreamSink {
 public:
  VideoSink(int camera, std::string device, const drivers::OutputFormat& format,
            std::unique_ptr<drivers::V4l2System> system = std::make_unique<drivers::LinuxV4l2System>());
  [[nodiscard]] bool take_image(const image_t& message) override;
  [[nodiscard]] std::string name() const override { return device_; }

 private:
  int camera_;
  std::string device_;
  drivers::V4l2Output output_;
};
#endif

// Everything except images, which do not go over UDP.
class LcmSink final : public StreamSink {
 public:
  explicit LcmSink(const std::string& url) : publisher_(url) {}
  void take_calibration(const calibration_t& message) override;
  void take_imu(const imu_t& message) override;
  void take_wheels(const wheels_t& message) override;
  void take_truth(const ground_truth_t& message) override;
  [[nodiscard]] std::string name() const override { return "LCM"; }
  [[nodiscard]] std::string losses() const override;

 private:
  ipc::LcmPublisher publisher_;
};

// Wheel speeds as frames of the vehicle's DBC.
class CanSink final : public StreamSink {
 public:
  CanSink(std::string interface, drivers::WheelWriter writer, std::unique_ptr<drivers::SocketCan> bus);
  void take_wheels(const wheels_t& message) override;
  void maintain() override { bus_->maintain(); }
  [[nodiscard]] std::string name() const override { return interface_; }
  [[nodiscard]] std::string losses() const override;

 private:
  std::string interface_;
  drivers::WheelWriter writer_;
  std::unique_ptr<drivers::SocketCan> bus_;
};

// All streamed data, images included. Without SIMULATION, since its times are not the clock's.
class LogSink final : public StreamSink {
 public:
  // Throws InputError if it cannot be opened.
  explicit LogSink(std::string file);
  ~LogSink() override;  // without close(): what there is is kept as <file>.incomplete
  LogSink(const LogSink&) = delete;
  LogSink& operator=(const LogSink&) = delete;
  void take_calibration(const calibration_t& message) override;
  void take_imu(const imu_t& message) override;
  void take_wheels(const wheels_t& message) override;
  void take_truth(const ground_truth_t& message) override;
  [[nodiscard]] bool take_image(const image_t& message) override;
  void close() override;
  [[nodiscard]] std::string abandon() override;
  [[nodiscard]] std::string name() const override { return file_; }

 private:
  template <typename Message>
  void write(const std::string& channel, const Message& message);

  std::string file_;
  std::unique_ptr<ipc::LogWriter> log_;
  bool has_calibration_ = false, ended_ = false;
};

}  // namespace farpoint::tools::simulate
