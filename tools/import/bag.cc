// SPDX-License-Identifier: Apache-2.0
#include "tools/import/bag.h"

#include <algorithm>
#include <functional>
#include <map>

#include "daemon/config/camera_file.h"
#include "tools/common/errors.h"
#include "tools/import/mcap.h"
#include "tools/import/ros_bag.h"
#include "tools/import/ros_message.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxSmallMessageBytes = 64 << 10;  // of all types except images
constexpr const char* kImage = "sensor_msgs/Image";
constexpr const char* kCompressedImage = "sensor_msgs/CompressedImage";
constexpr const char* kCameraInfo = "sensor_msgs/CameraInfo";
constexpr const char* kImu = "sensor_msgs/Imu";
constexpr const char* kOdometry = "nav_msgs/Odometry";
constexpr const char* kTwist = "geometry_msgs/TwistStamped";

using Topics = std::map<std::string, BagTopic>;
using Bytes = std::span<const std::uint8_t>;

Bytes bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

Topics topics_of(const ByteFile& file) {
  Topics topics;
  std::map<std::uint32_t, std::string> names;
  read_bag_file(
      file,
      [&](const BagConnection& connection) {
        names[connection.id] = connection.topic;
        BagTopic& topic = topics[connection.topic];
        topic.name = connection.topic;
        topic.type = connection.type;
      },
      [&](const BagMessage& message) { ++topics[names[message.connection]].messages; });
  return topics;
}

bool is_of(const BagTopic& topic, const std::vector<std::string>& types) {
  return std::find(types.begin(), types.end(), topic.type) != types.end();
}

std::string names_of(const Topics& topics, const std::vector<std::string>& types) {
  std::string names;
  for (const auto& [name, topic] : topics)
    if (is_of(topic, types)) names += (names.empty() ? "" : ", ") + name;
  return names;
}

// The topic that was asked for, checked to be of one of the types.
const BagTopic& chosen(const ByteFile& file, const Topics& topics, const std::string& name,
                       const char* option, const std::vector<std::string>& types) {
  const auto found = topics.find(name);
  if (found != topics.end() && is_of(found->second, types)) return found->second;
  const std::string names = names_of(topics, types);
  throw InputError(
      file.path().string() + ": " + option + " " + name + ": " +
      (found == topics.end() ? "no such topic" : "of type " + found->second.type) + ", expected " +
      (names.empty() ? "a topic of type " + types.front() + ", of which there is none" : "one of " + names));
}

const BagTopic& image_topic(const ByteFile& file, const Topics& topics, const std::string& name) {
  const std::vector<std::string> types = {kImage, kCompressedImage};
  if (!name.empty()) return chosen(file, topics, name, "--image", types);
  const BagTopic* only = nullptr;
  for (const auto& [key, topic] : topics) {
    if (!is_of(topic, types)) continue;
    if (only != nullptr)
      throw InputError(file.path().string() + ": several image topics, expected --image with one of " +
                       names_of(topics, types));
    only = &topic;
  }
  if (only == nullptr)
    throw InputError(file.path().string() + ": no topic of type " + kImage + " or " + kCompressedImage +
                     ", expected images of a camera (--list prints all topics)");
  return *only;
}

std::string imu_topic(const ByteFile& file, const Topics& topics, const std::string& name,
                      Recording* recording) {
  if (name == "none") return "";
  if (!name.empty()) return chosen(file, topics, name, "--imu", {kImu}).name;
  const std::string names = names_of(topics, {kImu});
  if (names.find(',') == std::string::npos) return names;
  recording->notices.push_back(file.path().string() + ": no IMU was taken, --imu chooses one of " + names);
  return "";
}

// "/cam0/image_raw/compressed" and "/cam0/image_raw" -> "/cam0/camera_info".
std::string camera_info_topic(std::string image) {
  constexpr std::string_view kSuffix = "/compressed";
  if (image.ends_with(kSuffix)) image.resize(image.size() - kSuffix.size());
  const std::size_t slash = image.rfind('/');
  return (slash == std::string::npos ? "" : image.substr(0, slash + 1)) + "camera_info";
}

// ---- messages into the recording ----

struct EncodingName {
  std::string_view name;
  RawEncoding encoding;
};
constexpr EncodingName kEncodings[] = {
    {"mono8", RawEncoding::kGrey8}, {"8UC1", RawEncoding::kGrey8},   {"rgb8", RawEncoding::kRgb8},
    {"bgr8", RawEncoding::kBgr8},   {"8UC3", RawEncoding::kBgr8},    {"rgba8", RawEncoding::kRgba8},
    {"bgra8", RawEncoding::kBgra8}, {"yuv422", RawEncoding::kUyvy8}, {"yuv422_yuy2", RawEncoding::kYuyv8},
};

class Collector {
 public:
  Collector(const ByteFile& file, const Topics& topics, const BagChoice& choice, Recording* recording)
      : file_(file), recording_(recording) {
    const BagTopic& image = image_topic(file, topics, choice.image);
    image_ = image.name;
    compressed_ = image.type == kCompressedImage;
    imu_ = imu_topic(file, topics, choice.imu, recording);
    if (!choice.wheels.empty()) {
      const BagTopic& wheels = chosen(file, topics, choice.wheels, "--wheels", {kOdometry, kTwist});
      wheels_ = wheels.name;
      wheels_are_odometry_ = wheels.type == kOdometry;
    }
    if (choice.camera_file.empty()) camera_info_ = camera_info_topic(image_);
  }

  void connect(const BagConnection& connection) { connections_[connection.id] = connection; }

  void take(const BagMessage& message) {
    const BagConnection& connection = connections_[message.connection];
    const std::string& topic = connection.topic;
    packing_ = connection.packing;
    if (topic == image_) {
      take_image(message);
    } else if (topic == imu_) {
      take_imu(message);
    } else if (topic == wheels_) {
      take_wheels(message);
    } else if (topic == camera_info_ && calibration_.empty()) {
      const std::optional<std::string> text = read_ros_camera_info(bytes_of(content(message)), packing_);
      if (!text) file_.fail(message.offset, "a damaged message on " + camera_info_);
      calibration_ = *text;
    }
  }

  // The calibration of camera_info, for an error with the topic's name.
  [[nodiscard]] const std::string& calibration() const { return calibration_; }
  [[nodiscard]] const std::string& camera_info() const { return camera_info_; }
  [[nodiscard]] const std::string& image() const { return image_; }
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }

 private:
  [[nodiscard]] std::string content(const BagMessage& message) const {
    if (message.bytes > kMaxSmallMessageBytes)
      file_.fail(message.offset,
                 "a message of " + std::to_string(message.bytes) + " bytes, expected at most 65536");
    return file_.read(message.offset, message.bytes);
  }

  [[nodiscard]] static std::int64_t time_of(std::int64_t header_utime, const BagMessage& message) {
    return header_utime != 0 ? header_utime : (message.received_ns + 500) / 1000;
  }

  void take_image(const BagMessage& message) {
    const std::string head =
        file_.read(message.offset, std::min<std::uint64_t>(message.bytes, kImageHeadBytes));
    const std::optional<RosImage> found =
        compressed_ ? read_ros_compressed_image(bytes_of(head), message.bytes, packing_)
                    : read_ros_image(bytes_of(head), message.bytes, packing_);
    if (!found) {
      ++damaged_;
      return;
    }
    RecordingImage image;
    image.utime = time_of(found->utime, message);
    image.file = file_.path();
    image.offset = message.offset + found->data_offset;
    image.bytes = found->data_bytes;
    if (!compressed_) image.raw = raw_of(*found, message);
    recording_->images.push_back(image);
  }

  [[nodiscard]] RawImage raw_of(const RosImage& found, const BagMessage& message) const {
    const auto* const known = std::find_if(std::begin(kEncodings), std::end(kEncodings),
                                           [&](const EncodingName& e) { return e.name == found.encoding; });
    if (known == std::end(kEncodings)) {
      file_.fail(message.offset,
                 image_ + ": encoding '" + found.encoding +
                     "', expected mono8, rgb8, bgr8, rgba8, bgra8 or yuv422 ('image_proc' converts)");
    }
    RawImage raw{known->encoding, found.width_px, found.height_px, found.row_bytes};
    if (raw.row_bytes < static_cast<std::size_t>(raw.width_px) * bytes_a_pixel(raw.encoding))
      file_.fail(message.offset, image_ + ": rows of " + std::to_string(raw.row_bytes) + " bytes for " +
                                     std::to_string(raw.width_px) + " pixels of " + found.encoding);
    return raw;
  }

  void take_imu(const BagMessage& message) {
    const std::optional<RosImu> found = read_ros_imu(bytes_of(content(message)), packing_);
    if (!found) {
      ++damaged_;
      return;
    }
    recording_->imu.push_back(
        {time_of(found->utime, message), found->angular_velocity_radps, found->acceleration_mps2});
  }

  void take_wheels(const BagMessage& message) {
    const std::string bytes = content(message);
    const std::optional<RosTwist> found = wheels_are_odometry_ ? read_ros_odometry(bytes_of(bytes), packing_)
                                                               : read_ros_twist(bytes_of(bytes), packing_);
    if (!found) {
      ++damaged_;
      return;
    }
    recording_->wheels.push_back({time_of(found->utime, message), found->speed_mps, found->yaw_rate_radps});
  }

  const ByteFile& file_;
  Recording* recording_;
  std::map<std::uint32_t, BagConnection> connections_;
  RosPacking packing_ = RosPacking::kRos1;          // of the message at hand
  std::string image_, imu_, wheels_, camera_info_;  // topics; empty: none
  std::string calibration_;
  bool compressed_ = false, wheels_are_odometry_ = false;
  std::uint64_t damaged_ = 0;
};

// Sorts by time and drops samples of a time that is there already.
template <typename Sample>
std::size_t order(std::vector<Sample>* samples) {
  const auto before = [](const Sample& a, const Sample& b) { return a.utime < b.utime; };
  const auto same = [](const Sample& a, const Sample& b) { return a.utime == b.utime; };
  std::stable_sort(samples->begin(), samples->end(), before);
  const std::size_t count = samples->size();
  samples->erase(std::unique(samples->begin(), samples->end(), same), samples->end());
  return count - samples->size();
}

void set_camera(const ByteFile& file, const BagChoice& choice, const Collector& collector,
                Recording* recording) {
  if (!choice.camera_file.empty()) return add_camera(choice.camera_file, "camera", recording);
  if (collector.calibration().empty())
    throw InputError(file.path().string() + ": no message on " + collector.camera_info() +
                     ", the calibration of " + collector.image() + "; expected --camera FILE");
  // Its K and distortion are of the raw image.
  if (collector.image().find("image_rect") != std::string::npos)
    throw InputError(file.path().string() + ": " + collector.image() + ": rectified images, while " +
                     collector.camera_info() +
                     " describes raw ones; expected --camera FILE, or --image of raw ones");
  const std::string name = file.path().string() + ", " + collector.camera_info();
  add_camera(daemon::parse_camera_file(collector.calibration(), name), name, "camera", recording);
}

}  // namespace

std::vector<BagTopic> list_bag(const fs::path& file) {
  std::vector<BagTopic> list;
  for (const auto& [name, topic] : topics_of(ByteFile(file))) list.push_back(topic);
  return list;
}

Recording read_bag(const fs::path& path, const BagChoice& choice) {
  const ByteFile file(path);
  Recording recording;
  Collector collector(file, topics_of(file), choice, &recording);
  read_bag_file(
      file, [&](const BagConnection& connection) { collector.connect(connection); },
      [&](const BagMessage& message) { collector.take(message); });
  if (recording.images.empty())
    throw InputError(path.string() + ": no image on " + collector.image() + " that can be read");
  set_camera(file, choice, collector, &recording);
  const std::size_t doubled = order(&recording.images) + order(&recording.imu) + order(&recording.wheels);
  std::int64_t sequence = 0;
  for (RecordingImage& image : recording.images) image.sequence = sequence++;
  if (collector.damaged() > 0)
    recording.notices.push_back(path.string() + ": " + std::to_string(collector.damaged()) +
                                " damaged messages were left out");
  if (doubled > 0)
    recording.notices.push_back(path.string() + ": " + std::to_string(doubled) +
                                " messages of a time that was there already were left out");
  complete_cameras(path, &recording);
  return recording;
}

}  // namespace farpoint::tools
