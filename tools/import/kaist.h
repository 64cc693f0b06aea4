// SPDX-License-Identifier: Apache-2.0
// KAIST Urban (Complex Urban Dataset) layout: ROOT/image/{stereo_left,stereo_right}/STAMP.png,
// ROOT/sensor_data/{stereo_stamp,xsens_imu,encoder}.csv, ROOT/calibration/{left.yaml, right.yaml,
// Vehicle2Stereo.txt, Vehicle2IMU.txt, EncoderParameter.txt} and ROOT/global_pose.csv. Stamps are
// nanoseconds. Only the left camera and its calibration are needed.
#pragma once

#include <filesystem>
#include <string>

#include "tools/import/recording.h"

namespace farpoint::tools {

// The body is the data set's vehicle, and truth is the vehicle's in its world. A wheel sample has the mean
// speed between two encoder counts, at the time half way. Throws InputError naming file and line; for IMU,
// wheels and truth as `damaged` has it.
[[nodiscard]] Recording read_kaist(const std::filesystem::path& root, Damaged damaged = Damaged::kLeftOut);

// An image of the recording as grey PNG: the data set's files are Bayer patterns, of which each 3x3 pixels
// give a luma of a quarter red, a half green and a quarter blue. Throws InputError naming the file.
[[nodiscard]] std::string read_kaist_image(const RecordingImage& image);

}  // namespace farpoint::tools
