// SPDX-License-Identifier: Apache-2.0
// Recordings of other tools: ROS 1 bags, MCAP, SQLite bags, and files of stamps for a folder of pictures.
#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "daemon/config/errors.h"
#include "ipc/printable.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"
#include "tools/import/bag.h"
#include "tools/import/bag_file.h"
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

std::string bz2(std::string content) {
  constexpr int kBlock = 1, kQuiet = 0, kDefault = 0;
  std::string packed(content.size() + 1000, '\0');
  auto size = static_cast<unsigned>(packed.size());
  require(BZ2_bzBuffToBuffCompress(packed.data(), &size, content.data(),
                                   static_cast<unsigned>(content.size()), kBlock, kQuiet, kDefault) == BZ_OK,
          "bzip2");
  return packed.substr(0, size);
}

std::string lz4(const std::string& content) {
  std::string packed(LZ4F_compressFrameBound(content.size(), nullptr), '\0');
  packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), content.data(), content.size(), nullptr));
  return packed;
}

std::string zstd(const std::string& content) {
  constexpr int kLevel = 3;
  std::string packed(ZSTD_compressBound(content.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), content.data(), content.size(), kLevel));
  return packed;
}

Bytes bag_seed(const std::string& compression) {
  const std::string number = field("conn", little_endian(0, 4));
  const std::string details = counted("type=sensor_msgs/Image");
  std::string chunk = bag_record({field("op", "\7"), number, "topic=/cam/image_raw"}, details);
  chunk.append(
      bag_record({field("op", "\2"), number, field("time", little_endian(7, 4).append(little_endian(9, 4)))},
                 ros_image()));
  std::string bag = "#ROSBAG V2.0\n";
  bag.append(bag_record({field("op", "\3")}, ""));
  const std::string packed = compression == "bz2" ? bz2(chunk) : compression == "lz4" ? lz4(chunk) : chunk;
  bag.append(bag_record(
      {field("op", "\5"), field("compression", compression), field("size", little_endian(chunk.size(), 4))},
      packed));
  return bytes_of(bag);
}

std::string mcap_record(char kind, const std::string& data) {
  return std::string(1, kind).append(little_endian(data.size(), 8)).append(data);
}

Bytes mcap_seed(const std::string& compression) {
  std::string schema =
      little_endian(1, 2).append(counted("sensor_msgs/msg/Image")).append(counted("ros2msg"));
  schema.append(counted("x"));
  std::string channel = little_endian(0, 2).append(little_endian(1, 2)).append(counted("/cam/image_raw"));
  channel.append(counted("ros1")).append(little_endian(0, 4));
  std::string message = little_endian(0, 2).append(little_endian(0, 4)).append(little_endian(9, 8));
  message.append(little_endian(9, 8)).append(ros_image());
  std::string file = "\x89MCAP0\r\n";
  file.append(mcap_record(1, counted("").append(counted(""))));
  std::string records = mcap_record(3, schema);
  records.append(mcap_record(4, channel)).append(mcap_record(5, message));
  if (!compression.empty()) {
    const std::string packed = compression == "lz4" ? lz4(records) : zstd(records);
    std::string chunk = std::string(16, '\0').append(little_endian(records.size(), 8));
    chunk.append(little_endian(0, 4)).append(counted(compression)).append(little_endian(packed.size(), 8));
    records = mcap_record(6, chunk.append(packed));
  }
  file.append(records);
  return bytes_of(file.append(mcap_record(2, std::string(20, '\0'))));
}

// A sensor_msgs/Image of 4x2 as CDR.
std::string cdr_image() {
  std::string message = std::string("\0\1\0\0", 4).append(little_endian(7, 4)).append(little_endian(9, 4));
  message.append(counted(std::string("cam\0", 4))).append(little_endian(2, 4)).append(little_endian(4, 4));
  message.append(counted(std::string("mono8\0", 6))).append(2, '\0').append(little_endian(4, 4));
  return message.append(counted("abcdefgh"));
}

Bytes db3_seed() {
  sqlite3* database = nullptr;
  require(sqlite3_open(":memory:", &database) == SQLITE_OK, "a database in memory");
  constexpr const char* kTables =
      "PRAGMA page_size=512;"
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
      "INSERT INTO topics VALUES (1, '/cam/image_raw', 'sensor_msgs/msg/Image', 'cdr');";
  require(sqlite3_exec(database, kTables, nullptr, nullptr, nullptr) == SQLITE_OK, "tables");
  sqlite3_stmt* insert = nullptr;
  require(sqlite3_prepare_v2(database, "INSERT INTO messages VALUES (1, 1, 7000000009, ?)", -1, &insert,
                             nullptr) == SQLITE_OK,
          "insert");
  const std::string image = cdr_image();
  sqlite3_bind_blob(insert, 1, image.data(), static_cast<int>(image.size()), nullptr);
  require(sqlite3_step(insert) == SQLITE_DONE, "insert");
  sqlite3_finalize(insert);
  sqlite3_int64 size = 0;
  unsigned char* const content = sqlite3_serialize(database, "main", &size, 0);
  require(content != nullptr, "serialize");
  Bytes bytes(content, content + size);
  sqlite3_free(content);
  sqlite3_close(database);
  return bytes;
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

// The first two topics of images, and any topic that may be truth or wheels.
tools::BagChoice choice_of(const std::vector<tools::BagTopic>& topics) {
  tools::BagChoice choice;
  for (const tools::BagTopic& topic : topics) {
    const bool image = topic.type == "sensor_msgs/Image" || topic.type == "sensor_msgs/CompressedImage";
    if (image && choice.image.empty()) {
      choice.image = topic.name;
    } else if (image) {
      choice.second_image = topic.name;
    }
    if (topic.type == "nav_msgs/Odometry") choice.wheels = choice.truth = topic.name;
    if (topic.type.starts_with("geometry_msgs/P")) choice.truth = topic.name;
  }
  return choice;
}

void run_bag_file(const std::filesystem::path& file, std::size_t bytes) {
  tools::BagChoice choice;
  expect_refusal_or_none([&] { choice = choice_of(tools::list_bag(file)); });
  expect_refusal_or_none([&] { (void)tools::read_bag(file, choice); });
  choice.camera_file = choice.second_camera_file = pictures() / "camera.yaml";
  if (choice.second_image.empty()) choice.second_camera_file.clear();
  expect_refusal_or_none([&] {
    const tools::Recording recording = tools::read_bag(file, choice);
    require(!recording.images.empty(), "a bag that was read has images");
    const auto bag = tools::open_bag(file);
    for (const tools::RecordingImage& image : recording.images) {
      require(image.part != 0 || image.offset + image.bytes <= bytes, "pixels lie in the file");
      require(bag->read({image.part, image.offset}, image.bytes).size() == image.bytes, "pixels are read");
    }
  });
}

}  // namespace

void run_bag(ByteView input) {
  const MemoryFile file(input);
  run_bag_file(file.path(), input.size());
}

// SQLite follows a link to the file's true name, which a file in memory has not.
void run_db3(ByteView input) {
  const std::filesystem::path file = pictures() / "fuzz.db3";
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
  run_bag_file(file, input.size());
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
  return {bag_seed("none"), bag_seed("bz2"),  bag_seed("lz4"),
          mcap_seed(""),    mcap_seed("lz4"), mcap_seed("zstd")};
}

std::vector<Bytes> seeds_of_db3() {
  return {db3_seed()};
}

std::vector<Bytes> seeds_of_stamps() {
  return {bytes_of("# ns\n1403636579763555584\n1403636579813555456\n1403636579863555712\n"),
          bytes_of("1.5, 1.png\n1.6,2.png\n1.7 3.png\n"), bytes_of("0\n50\n100\n")};
}

}  // namespace farpoint::fuzz
