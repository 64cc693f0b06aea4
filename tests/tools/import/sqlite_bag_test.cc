// SPDX-License-Identifier: Apache-2.0
// Bags of ROS 2 in SQLite, as write_db3.py makes them by Python's sqlite3.
#include "tools/import/sqlite_bag.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/ipc/log_events.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/import/bag.h"
#include "tools/import/recording_log.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStart = 1'600'000'000'000'000;

class ImportDb3 : public testing::Test {
 protected:
  // A name with what an address gives a meaning to.
  [[nodiscard]] fs::path file() const { return root_ / "a drive?mode=rwc#50%.db3"; }
  void write(const std::string& options = "", const fs::path& name = {}) const {
    const std::string out = (name.empty() ? file() : name).string();
    const ProgramResult made = run_shell("/usr/bin/python3 '" + test::source_dir() +
                                         "/tests/tools/import/write_db3.py' '" + out + "' " + options);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  void write_sql(const std::string& sql) const { write("--sql \"" + sql + "\""); }
  [[nodiscard]] std::string complaint(const BagChoice& choice = {}) const {
    return complaint_of([&] { (void)read_bag(file(), choice); });
  }

  ScratchFolder root_;
};

TEST_F(ImportDb3, ReadsImagesCalibrationImuAndWheels) {
  write();
  BagChoice choice;
  choice.wheels = choice.truth = "/odom";
  const Recording r = read_bag(file(), choice);
  EXPECT_EQ(r.cameras.at(0).parameters.fx_px, 50.0);
  EXPECT_EQ(r.cameras.at(0).parameters.cy_px, 23.0);
  ASSERT_EQ(r.images.size(), 3U);
  EXPECT_EQ(r.images[1].utime, kStart + 50'000);
  ASSERT_EQ(r.imu.size(), 10U);
  EXPECT_EQ(r.imu[3].angular_velocity_radps, Eigen::Vector3d(0.1, 0.2, 3.0));
  ASSERT_EQ(r.wheels.size(), 4U);
  EXPECT_EQ(r.wheels[2].speed_mps, 3.5);
  EXPECT_EQ(r.truth.at(2).T_world_body.t, Eigen::Vector3d(1, 2, 3));
  const std::vector<BagTopic> topics = list_bag(file());
  ASSERT_EQ(topics.size(), 5U);
  EXPECT_EQ(topics[1].type, "sensor_msgs/Image");
  EXPECT_EQ(topics[1].messages, 3U);
  EXPECT_EQ(topics[3].type, "json sensor_msgs/Image");
}

TEST_F(ImportDb3, PixelsAreThoseOfTheMessage) {
  write();
  write_recording(read_bag(file(), {}), root_ / "run.lcm");
  std::size_t images = 0;
  for (const image_t& image : test::messages_of<image_t>((root_ / "run.lcm").string(), "CAMERA_0")) {
    ASSERT_EQ(image.size, 64 * 48);
    for (std::size_t i = 0; i < image.data.size(); ++i)
      ASSERT_EQ(image.data[i], (i % 64 + i / 64 + images) % 256) << i;
    ++images;
  }
  EXPECT_EQ(images, 3U);
}

TEST_F(ImportDb3, MessagesPackedOneByOneAreTheSame) {
  write();
  write_recording(read_bag(file(), {}), root_ / "run.lcm");
  write("--packed", root_ / "packed.db3");
  const Recording r = read_bag(root_ / "packed.db3", {});
  EXPECT_EQ(r.imu.size(), 10U);
  write_recording(r, root_ / "packed.lcm");
  EXPECT_EQ(get(root_ / "packed.lcm"), get(root_ / "run.lcm"));
}

TEST_F(ImportDb3, APackedMessageThatIsDamagedHugeOrOfUnknownSizeIsRefused) {
  const std::string image = "(SELECT max(id) FROM messages)", of_image = " WHERE id = " + image;
  write("--packed --sql \"UPDATE messages SET data = substr(data, 1, 100)" + of_image + "\"");
  expect_all_in(complaint_of([&] { write_recording(read_bag(file(), {}), root_ / "run.lcm"); }),
                {"db3: message ", "a damaged message (zstd)"});
  // A frame of one segment, with a size of 8 bytes.
  write_sql("UPDATE messages SET data = x'28b52ffde0ffffffffffffff7f000000'" + of_image);
  expect_all_in(complaint(),
                {"db3: message ", "a packed message of 9223372036854775807 bytes, expected at most"});
  // A window, and no size.
  write_sql("UPDATE messages SET data = x'28b52ffd005800000000000000000000'" + of_image);
  expect_all_in(complaint(), {"db3: message ", "does not name the size"});
}

TEST_F(ImportDb3, TheFilesOfAFolderAreOneRecording) {
  const fs::path folder = root_ / "drive";
  put(folder / "metadata.yaml", "rosbag2_bagfile_information: {}\n");
  expect_all_in(complaint_of([&] { (void)read_bag(folder, {}); }), {"drive: no .db3 or .mcap file"});
  write("--from 2", folder / "drive_10.db3");
  write("--to 2", folder / "drive_9.db3");
  const Recording r = read_bag(folder, {});
  ASSERT_EQ(r.images.size(), 3U);
  EXPECT_EQ(r.images[2].file.filename(), "drive_10.db3");
  EXPECT_EQ(r.images[2].sequence, 2);
  write_recording(r, root_ / "run.lcm");
  const auto images = test::messages_of<image_t>((root_ / "run.lcm").string(), "CAMERA_0");
  ASSERT_EQ(images.size(), 3U);
  EXPECT_EQ(images[2].data[5], 7);
  fs::remove(folder / "metadata.yaml");
  expect_all_in(complaint_of([&] { (void)read_bag(folder, {}); }), {"without metadata.yaml"});
}

TEST_F(ImportDb3, DatabasesThatAreNoBagAreNamed) {
  write_sql("DROP TABLE messages");
  expect_all_in(complaint(), {"50%.db3: no table 'messages'", "ROS 2 bag"});
  write_sql("ALTER TABLE topics RENAME COLUMN type TO kind");
  expect_all_in(complaint(), {"expected the tables of a ROS 2 bag", "serialization_format", "type"});
  write_sql("UPDATE topics SET name = zeroblob(3)");
  expect_all_in(complaint(), {"expected the tables of a ROS 2 bag"});
  write_sql("UPDATE topics SET name = printf('%.2000c', 'x')");
  expect_all_in(complaint(), {"a name of more than 1024 bytes"});
  write_sql("UPDATE messages SET topic_id = 77 WHERE id = 5");
  expect_all_in(complaint(), {"message 5: a message of an unknown topic"});
  write_sql("UPDATE messages SET data = 'text' WHERE id = 4");
  expect_all_in(complaint(), {"message 4: expected a blob"});
  write_sql("UPDATE messages SET timestamp = -5 WHERE id = 4");
  expect_all_in(complaint(), {"message 4: a time before 1970"});
  write_sql("UPDATE messages SET id = -4 WHERE id = 4");
  expect_all_in(complaint(), {"a message of id -4"});
}

// A schema is a program, which must neither run without end nor take all memory.
TEST_F(ImportDb3, ASchemaThatComputesIsRefused) {
  const std::string rows =
      "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 "
      "FROM n) SELECT i AS id, 1 AS topic_id, i AS timestamp, zeroblob(9) AS data FROM n";
  write_sql(rows);
  expect_all_in(complaint(), {"no table 'messages'"});
  write_sql(
      "DROP TABLE messages; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp "
      "INTEGER, data GENERATED ALWAYS AS (zeroblob(900000000))); INSERT INTO messages VALUES (1, 1, 1)");
  expect_all_in(complaint(), {".db3: "});
}

TEST_F(ImportDb3, AMessageOfAnotherLengthThanItsImageIsDamage) {
  write_sql("UPDATE messages SET data = substr(data, 1, 2000) WHERE topic_id = 1 AND id > 18");
  const Recording r = read_bag(file(), {});
  EXPECT_EQ(r.images.size(), 2U);
  expect_all_in(r.notices.at(0), {"1 damaged messages"});
  write_sql("UPDATE messages SET data = zeroblob(70000) WHERE topic_id = 2 AND id = 5");
  expect_all_in(complaint(), {"message 5: a message of 70000 bytes, expected at most 65536"});
}

TEST_F(ImportDb3, ABagThatWasNotClosedIsRefused) {
  write();
  const std::string journal = file().string() + "-wal";
  put(journal, "part");
  expect_all_in(complaint(), {"was not closed", "-wal"});
  put(journal, "");
  EXPECT_EQ(read_bag(file(), {}).images.size(), 3U);
}

TEST_F(ImportDb3, TheFileStaysAsItIs) {
  write_sql("PRAGMA journal_mode=WAL");
  const std::string before = get(file());
  fs::permissions(file(), fs::perms::owner_read);
  EXPECT_EQ(read_bag(file(), {}).images.size(), 3U);
  EXPECT_EQ(get(file()), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(root_.path()), {}), 1) << "a file beside it";
}

TEST_F(ImportDb3, APipeIsNotWaitedFor) {
  ASSERT_EQ(mkfifo(file().c_str(), 0600), 0);
  expect_all_in(complaint(), {"is no file"});
}

TEST_F(ImportDb3, DamagedBytesNeverCrash) {
  write();
  const std::string whole = get(file());
  std::mt19937 random(7);
  int read = 0;
  for (int round = 0; round < 200; ++round) {
    std::string damaged = whole;
    const std::size_t reach = round % 2 == 0 ? 9000 : damaged.size();
    for (int i = 0; i < 5; ++i) damaged[16 + random() % (reach - 16)] = static_cast<char>(random());
    if (round % 4 == 0) damaged.resize(random() % damaged.size());
    put(file(), damaged);
    if (passes_or_says_one_line([&] { write_recording(read_bag(file(), {}), root_ / "run.lcm"); })) ++read;
  }
  EXPECT_GT(read, 20);
}

}  // namespace
}  // namespace farpoint::tools
