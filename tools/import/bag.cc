// SPDX-License-Identifier: Apache-2.0
#include "tools/import/bag.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "daemon/config/camera_file.h"
#include "tools/common/errors.h"
#include "tools/common/numbers.h"
#include "tools/import/bag_file.h"
#include "tools/import/ros_message.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxSmallMessageBytes = 64 << 10;  // of all types except images
constexpr std::int64_t kPairTolerance_us = 5'000;          // as drivers/camera pairs live images
constexpr const char* kImage = "sensor_msgs/Image";
constexpr const char* kCompressedImage = "sensor_msgs/CompressedImage";
constexpr const char* kCameraInfo = "sensor_msgs/CameraInfo";
constexpr const char* kImu = "sensor_msgs/Imu";
constexpr const char* kOdometry = "nav_msgs/Odometry";
constexpr const char* kTransform = "geometry_msgs/TransformStamped";
constexpr const char* kPoint = "geometry_msgs/PointStamped";

const TopicTypes& image_types() {
  static const TopicTypes kTypes = {kImage, kCompressedImage};
  return kTypes;
}
const TopicTypes& wheel_types() {
  static const TopicTypes kTypes = {kOdometry, "geometry_msgs/TwistStamped",
                                    "geometry_msgs/TwistWithCovarianceStamped"};
  return kTypes;
}
const TopicTypes& truth_types() {
  static const TopicTypes kTypes = {kOdometry, "geometry_msgs/PoseStamped",
                                    "geometry_msgs/PoseWithCovarianceStamped", kTransform, kPoint};
  return kTypes;
}

using Bytes = std::span<const std::uint8_t>;

Bytes bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// "/cam0/image_raw/compressed" and "/cam0/image_raw" -> "/cam0/camera_info".
std::string camera_info_topic(std::string image) {
  constexpr std::string_view kSuffix = "/compressed";
  if (image.ends_with(kSuffix)) image.resize(image.size() - kSuffix.size());
  const std::size_t slash = image.rfind('/');
  return (slash == std::string::npos ? "" : image.substr(0, slash + 1)) + "camera_info";
}

// ---- the topics that are taken ----

struct Topic {
  std::string name, type;  // empty: none
  [[nodiscard]] bool is(const BagConnection& connection) const {
    return !name.empty() && connection.topic == name && connection.type == type;
  }
};

struct ChosenTopics {
  std::vector<Topic> images, infos;  // one for each camera
  Topic imu, wheels, truth;
};

Topic topic_of(const BagTopic& topic) {
  return {topic.name, topic.type};
}

Topic choose_imu(const BagTopics& topics, const std::string& name, const std::string& bag,
                 Recording* recording) {
  const std::size_t count = topics.count_of({kImu});
  if (name == "none" || (name.empty() && count == 0)) return {};
  if (!name.empty() || count == 1) return topic_of(topics.require(name, "--imu", {kImu}));
  recording->notices.push_back(bag + ": no IMU was taken, --imu chooses one of " + topics.names_of({kImu}));
  return {};
}

ChosenTopics choose(const BagTopics& topics, const BagChoice& choice, const std::string& bag,
                    Recording* recording) {
  ChosenTopics chosen;
  chosen.images = {topic_of(topics.require(choice.image, "--image", image_types()))};
  if (!choice.second_image.empty())
    chosen.images.push_back(topic_of(topics.require(choice.second_image, "--second-image", image_types())));
  if (chosen.images.size() == 2 && chosen.images[0].name == chosen.images[1].name)
    throw InputError(bag + ": --second-image " + choice.second_image +
                     ": is the first camera's topic, expected another");
  for (const Topic& image : chosen.images)
    chosen.infos.push_back({camera_info_topic(image.name), kCameraInfo});
  chosen.imu = choose_imu(topics, choice.imu, bag, recording);
  if (!choice.wheels.empty())
    chosen.wheels = topic_of(topics.require(choice.wheels, "--wheels", wheel_types()));
  if (!choice.truth.empty()) chosen.truth = topic_of(topics.require(choice.truth, "--truth", truth_types()));
  return chosen;
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

std::int64_t time_of(std::int64_t header_utime, const BagMessage& message) {
  return header_utime != 0 ? header_utime : microseconds_of(message.received_ns);
}

class Collector {
 public:
  Collector(const ChosenTopics& topics, Recording* recording)
      : topics_(topics), recording_(recording), infos_(topics.images.size()) {}

  // Takes all that was chosen of one file.
  void take_all(BagFile* bag) {
    bag_ = bag;
    connections_.clear();
    bag->read_all([&](const BagConnection& connection) { connections_[connection.id] = connection; },
                  [&](const BagMessage& message) { take(message, connections_[message.connection]); });
  }

  // Of each camera; empty where there was no message.
  [[nodiscard]] const std::vector<std::optional<RosCameraInfo>>& infos() const { return infos_; }
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }

 private:
  void take(const BagMessage& message, const BagConnection& connection) {
    for (std::size_t camera = 0; camera < topics_.images.size(); ++camera) {
      if (topics_.images[camera].is(connection)) take_image(message, connection, static_cast<int>(camera));
      if (topics_.infos[camera].is(connection)) take_info(message, connection, &infos_[camera]);
    }
    // One topic of odometry may give wheels and truth.
    if (topics_.imu.is(connection)) take_imu(message, connection);
    if (topics_.wheels.is(connection)) take_wheels(message, connection);
    if (topics_.truth.is(connection)) take_truth(message, connection);
  }

  [[nodiscard]] std::string content(const BagMessage& message) const {
    if (message.bytes > kMaxSmallMessageBytes)
      bag_->fail(message.place,
                 "a message of " + std::to_string(message.bytes) + " bytes, expected at most 65536");
    return bag_->read(message.place, message.bytes);
  }

  void take_info(const BagMessage& message, const BagConnection& connection,
                 std::optional<RosCameraInfo>* info) {
    if (info->has_value()) return;
    *info = read_ros_camera_info(bytes_of(content(message)), connection.packing);
    if (!info->has_value()) bag_->fail(message.place, "a damaged message on " + connection.topic);
  }

  void take_image(const BagMessage& message, const BagConnection& connection, int camera) {
    const std::string head =
        bag_->read(message.place, std::min<std::uint64_t>(message.bytes, kImageHeadBytes));
    const bool compressed = connection.type == kCompressedImage;
    const std::optional<RosImage> found =
        compressed ? read_ros_compressed_image(bytes_of(head), message.bytes, connection.packing)
                   : read_ros_image(bytes_of(head), message.bytes, connection.packing);
    if (!found) {
      ++damaged_;
      return;
    }
    RecordingImage image;
    image.utime = time_of(found->utime, message);
    image.camera = camera;
    image.file = bag_->path();
    image.part = message.place.part;
    image.offset = message.place.offset + found->data_offset;
    image.bytes = found->data_bytes;
    if (!compressed) image.raw = raw_of(*found, message, connection.topic);
    recording_->images.push_back(image);
  }

  [[nodiscard]] RawImage raw_of(const RosImage& found, const BagMessage& message,
                                const std::string& topic) const {
    const auto* const known = std::find_if(std::begin(kEncodings), std::end(kEncodings),
                                           [&](const EncodingName& e) { return e.name == found.encoding; });
    if (known == std::end(kEncodings)) {
      bag_->fail(message.place,
                 topic + ": encoding '" + found.encoding +
                     "', expected mono8, rgb8, bgr8, rgba8, bgra8 or yuv422 ('image_proc' converts)");
    }
    RawImage raw{known->encoding, found.width_px, found.height_px, found.row_bytes};
    if (raw.row_bytes < static_cast<std::size_t>(raw.width_px) * bytes_a_pixel(raw.encoding))
      bag_->fail(message.place, topic + ": rows of " + std::to_string(raw.row_bytes) + " bytes for " +
                                    std::to_string(raw.width_px) + " pixels of " + found.encoding);
    return raw;
  }

  void take_imu(const BagMessage& message, const BagConnection& connection) {
    const std::optional<RosImu> found = read_ros_imu(bytes_of(content(message)), connection.packing);
    if (!found) {
      ++damaged_;
      return;
    }
    recording_->imu.push_back(
        {time_of(found->utime, message), found->angular_velocity_radps, found->acceleration_mps2});
  }

  void take_wheels(const BagMessage& message, const BagConnection& connection) {
    const std::string bytes = content(message);
    const std::optional<RosTwist> found = connection.type == kOdometry
                                              ? read_ros_odometry(bytes_of(bytes), connection.packing)
                                              : read_ros_twist(bytes_of(bytes), connection.packing);
    if (!found) {
      ++damaged_;
      return;
    }
    recording_->wheels.push_back({time_of(found->utime, message), found->speed_mps, found->yaw_rate_radps});
  }

  void take_truth(const BagMessage& message, const BagConnection& connection) {
    const bool point = connection.type == kPoint;
    const bool of_child = connection.type == kOdometry || connection.type == kTransform;
    const RosPoseLayout layout = point      ? RosPoseLayout::kPoint
                                 : of_child ? RosPoseLayout::kOfChild
                                            : RosPoseLayout::kPose;
    const std::optional<RosPose> found =
        read_ros_pose(bytes_of(content(message)), connection.packing, layout);
    if (!found) {
      ++damaged_;
      return;
    }
    if (point) recording_->truth_has_orientation = false;
    recording_->truth.push_back({time_of(found->utime, message), found->T_world_body});
  }

  const ChosenTopics& topics_;
  Recording* recording_;
  BagFile* bag_ = nullptr;  // being read
  std::map<std::uint32_t, BagConnection> connections_;
  std::vector<std::optional<RosCameraInfo>> infos_;
  std::uint64_t damaged_ = 0;
};

// ---- order ----

int camera_of(const RecordingImage& image) {
  return image.camera;
}
template <typename Sample>
int camera_of(const Sample& /*unused*/) {
  return 0;
}

// Sorts by time, camera 0 first, and drops samples of a time that is there already.
template <typename Sample>
std::size_t order(std::vector<Sample>* samples) {
  const auto key = [](const Sample& sample) { return std::pair(sample.utime, camera_of(sample)); };
  std::stable_sort(samples->begin(), samples->end(),
                   [&](const Sample& a, const Sample& b) { return key(a) < key(b); });
  const std::size_t count = samples->size();
  const auto same = [&](const Sample& a, const Sample& b) { return key(a) == key(b); };
  samples->erase(std::unique(samples->begin(), samples->end(), same), samples->end());
  return count - samples->size();
}

// Images of a pair have one number. Precondition: ordered.
void number_images(std::size_t cameras, Recording* recording) {
  std::array<std::vector<RecordingImage*>, 2> of_camera;
  for (RecordingImage& image : recording->images)
    of_camera[static_cast<std::size_t>(image.camera)].push_back(&image);
  std::int64_t number = 0;
  std::size_t left = 0, right = 0;
  while (left < of_camera[0].size() || right < of_camera[1].size()) {
    RecordingImage* const first = left < of_camera[0].size() ? of_camera[0][left] : nullptr;
    RecordingImage* const second = right < of_camera[1].size() ? of_camera[1][right] : nullptr;
    const bool both = first != nullptr && second != nullptr;
    const bool first_comes = !both || first->utime <= second->utime + kPairTolerance_us;
    const bool second_comes = !both || second->utime <= first->utime + kPairTolerance_us;
    if (first != nullptr && first_comes) of_camera[0][left++]->sequence = number;
    if (second != nullptr && second_comes) of_camera[1][right++]->sequence = number;
    const bool alone = !both || !first_comes || !second_comes;
    if (cameras == 2 && alone) ++recording->missing_images;
    ++number;
  }
}

// ---- cameras ----

class Cameras {
 public:
  Cameras(const std::string& bag, const ChosenTopics& topics, const BagChoice& choice, Recording* recording)
      : bag_(bag), topics_(topics), choice_(choice), recording_(recording) {}

  void add(const std::vector<std::optional<RosCameraInfo>>& infos) {
    const bool pair = topics_.images.size() == 2;
    if (pair && choice_.camera_file.empty() != choice_.second_camera_file.empty())
      throw InputError(bag_ + ": expected --camera and --second-camera for two cameras, or neither of them");
    if (!pair && !choice_.second_camera_file.empty())
      throw InputError(bag_ + ": --second-camera: expected with --second-image");
    if (!choice_.camera_file.empty()) {
      add_files(pair);
    } else {
      for (std::size_t camera = 0; camera < infos.size(); ++camera) add_info(camera, infos[camera]);
      if (pair) place_second(*infos[0], *infos[1]);
    }
  }

 private:
  [[nodiscard]] std::string name_of(std::size_t camera) const {
    return topics_.images.size() == 1 ? "camera" : "camera" + std::to_string(camera);
  }

  void add_files(bool pair) {
    if (!pair) return add_camera(choice_.camera_file, name_of(0), recording_);
    std::size_t camera = 0;
    for (const fs::path& file : {choice_.camera_file, choice_.second_camera_file}) {
      const daemon::CameraFile content = daemon::read_camera_file(file);
      if (!content.T_body_camera)
        throw InputError(
            file.string() +
            ": no T_body_camera, expected it (or mount) in both cameras' files: where one stands "
            "relative to the other");
      add_camera(content, file.string(), name_of(camera++), recording_);
    }
  }

  void add_info(std::size_t camera, const std::optional<RosCameraInfo>& info) {
    const std::string &image = topics_.images[camera].name, &topic = topics_.infos[camera].name;
    if (!info)
      throw InputError(bag_ + ": no message on " + topic + ", the calibration of " + image +
                       "; expected --camera FILE");
    // Its K and distortion are of the raw image.
    if (image.find("image_rect") != std::string::npos)
      throw InputError(bag_ + ": " + image + ": rectified images, while " + topic +
                       " describes raw ones; expected --camera FILE, or --image of raw ones");
    const std::string origin = bag_ + ", " + topic;
    add_camera(daemon::parse_camera_file(info->calibration, origin), origin, name_of(camera), recording_);
  }

  void place_second(const RosCameraInfo& first, const RosCameraInfo& second) {
    const std::optional<slam::SE3> T_first_second = second_camera(first.rectification, second.rectification);
    if (!T_first_second)
      throw InputError(bag_ + ": " + topics_.infos[1].name +
                       " has no rectification of a pair (R, and fx * baseline in P), expected --camera and "
                       "--second-camera with T_body_camera");
    recording_->cameras[1].T_body_camera = recording_->cameras[0].T_body_camera * *T_first_second;
  }

  const std::string& bag_;
  const ChosenTopics& topics_;
  const BagChoice& choice_;
  Recording* recording_;
};

void note_left_out(const std::string& bag, std::uint64_t damaged, std::size_t doubled, Recording* recording) {
  if (damaged > 0)
    recording->notices.push_back(bag + ": " + std::to_string(damaged) + " damaged messages were left out");
  if (doubled > 0)
    recording->notices.push_back(bag + ": " + std::to_string(doubled) +
                                 " messages of a time that was there already were left out");
}

}  // namespace

std::vector<BagTopic> list_bag(const fs::path& path) {
  return BagTopics(files_of_bag(path)).all();
}

Recording read_bag(const fs::path& path, const BagChoice& choice) {
  const std::vector<fs::path> files = files_of_bag(path);
  const std::string bag = path.string();
  Recording recording;
  const ChosenTopics topics = choose(BagTopics(files), choice, bag, &recording);
  Collector collector(topics, &recording);
  for (const fs::path& file : files) collector.take_all(open_bag(file).get());
  std::size_t doubled = order(&recording.images);
  for (std::size_t camera = 0; camera < topics.images.size(); ++camera) {
    const auto is_its = [&](const RecordingImage& image) { return image.camera == static_cast<int>(camera); };
    if (std::none_of(recording.images.begin(), recording.images.end(), is_its))
      throw InputError(bag + ": no image on " + topics.images[camera].name + " that can be read");
  }
  doubled += order(&recording.imu) + order(&recording.wheels) + order(&recording.truth);
  number_images(topics.images.size(), &recording);
  Cameras(bag, topics, choice, &recording).add(collector.infos());
  note_left_out(bag, collector.damaged(), doubled, &recording);
  if (!recording.truth.empty() && recording.body_name.empty())
    recording.notices.push_back(bag + ": " + topics.truth.name +
                                " is taken as the camera's place, since no --camera names the body");
  complete_cameras(path, &recording);
  return recording;
}

}  // namespace farpoint::tools
