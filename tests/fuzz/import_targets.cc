// SPDX-License-Identifier: Apache-2.0
// Recordings of other tools: ROS 1 bags, MCAP, and files of stamps for a folder of pictures.
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "daemon/config/errors.h"
#include "ipc/printable.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"
#include "tools/import/bag.h"
#include "tools/import/images.h"

namespace farpoint::fuzz {
namespace {

std::string little_endian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(value >> (8 * i)));
  return text;
}

std::string counted(const std::string& text) {
  std::string all = little_endian(text.size(), 4);
  return all.append(text);
}

std::string bag_record(const std::vector<std::string>& fields, const std::string& data) {
  std::string header;
  for (const std::string& field : fields) header.append(counted(field));
  return counted(header).append(counted(data));
}

std::string field(std::string name, const std::string& value) {
  return name.append("=").append(value);
}

// Header, size, encoding and pixels of a sensor_msgs/Image of 4x2.
std::string ros_image() {
  std::string message = little_endian(1, 4).append(little_endian(7, 4)).append(little_endian(9, 4));
  message.append(counted("cam")).append(little_endian(2, 4)).append(little_endian(4, 4));
  message.append(counted("mono8")).append(1, '\0').append(little_endian(4, 4));
  return message.append(counted("abcdefgh"));
}

Bytes bag_seed() {
  const std::string number = field("conn", little_endian(0, 4));
  const std::string details = counted("type=sensor_msgs/Image");
  std::string chunk = bag_record({field("op", "\7"), number, "topic=/cam/image_raw"}, details);
  chunk.append(
      bag_record({field("op", "\2"), number, field("time", little_endian(7, 4).append(little_endian(9, 4)))},
                 ros_image()));
  std::string bag = "#ROSBAG V2.0\n";
  bag.append(bag_record({field("op", "\3")}, ""));
  bag.append(bag_record({field("op", "\5"), "compression=none"}, chunk));
  return bytes_of(bag);
}

std::string mcap_record(char kind, const std::string& data) {
  return std::string(1, kind).append(little_endian(data.size(), 8)).append(data);
}

Bytes mcap_seed() {
  std::string schema =
      little_endian(1, 2).append(counted("sensor_msgs/msg/Image")).append(counted("ros2msg"));
  schema.append(counted("x"));
  std::string channel = little_endian(0, 2).append(little_endian(1, 2)).append(counted("/cam/image_raw"));
  channel.append(counted("ros1")).append(little_endian(0, 4));
  std::string message = little_endian(0, 2).append(little_endian(0, 4)).append(little_endian(9, 8));
  message.append(little_endian(9, 8)).append(ros_image());
  std::string file = "\x89MCAP0\r\n";
  file.append(mcap_record(1, counted("").append(counted(""))));
  file.append(mcap_record(3, schema)).append(mcap_record(4, channel)).append(mcap_record(5, message));
  return bytes_of(file.append(mcap_record(2, std::string(20, '\0'))));
}

template <typename Function>
void expect_refusal_or_none(Function&& function) {
  try {
    function();
  } catch (const daemon::InputError&) {  // refused; the program escapes what it prints
  }
}

// A folder with a camera file and three pictures, made once a process.
const std::filesystem::path& pictures() {
  static const std::filesystem::path kFolder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "farpoint_fuzz_XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr, "mkdtemp");
    for (const char* picture : {"1.png", "2.png", "3.png"})
      std::ofstream(std::filesystem::path(name) / picture);
    std::ofstream(std::filesystem::path(name) / "camera.yaml")
        << "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 50\ncx_px: 31\ncy_px: 23\n"
           "distortion: []\n";
    return std::filesystem::path(name);
  }();
  return kFolder;
}

}  // namespace

void run_bag(ByteView input) {
  const MemoryFile file(input);
  expect_refusal_or_none([&] { (void)tools::list_bag(file.path()); });
  tools::BagChoice choice;
  choice.camera_file = pictures() / "camera.yaml";
  expect_refusal_or_none([&] {
    const tools::Recording recording = tools::read_bag(file.path(), choice);
    require(!recording.images.empty(), "a bag that was read has images");
    for (const tools::RecordingImage& image : recording.images)
      require(image.offset + image.bytes <= input.size(), "pixels lie in the file");
  });
  expect_refusal_or_none([&] { (void)tools::read_bag(file.path(), {}); });
}

void run_stamps(ByteView input) {
  const MemoryFile file(input);
  tools::PictureTimes times;
  times.stamps = file.path();
  expect_refusal_or_none([&] {
    const tools::Recording recording = tools::read_images(pictures(), pictures() / "camera.yaml", times);
    std::int64_t last = -1;
    for (const tools::RecordingImage& image : recording.images) {
      require(image.utime > last, "times of pictures rise");
      last = image.utime;
      require(image.file.parent_path() == pictures(), "pictures lie in the folder");
    }
  });
}

std::vector<Bytes> seeds_of_bag() {
  return {bag_seed(), mcap_seed()};
}

std::vector<Bytes> seeds_of_stamps() {
  return {bytes_of("# ns\n1403636579763555584\n1403636579813555456\n1403636579863555712\n"),
          bytes_of("1.5, 1.png\n1.6,2.png\n1.7 3.png\n"), bytes_of("0\n50\n100\n")};
}

}  // namespace farpoint::fuzz
