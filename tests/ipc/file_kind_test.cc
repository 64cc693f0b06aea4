// SPDX-License-Identifier: Apache-2.0
#include "ipc/file_kind.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <string_view>

#include "ipc/log.h"
#include "tests/ipc/scratch.h"

namespace farpoint::ipc {
namespace {

using namespace std::string_view_literals;

std::string name_of(std::string_view head) {
  const auto kind = recognise_file({reinterpret_cast<const std::uint8_t*>(head.data()), head.size()});
  return kind ? kind->name : "";
}

std::string advice_of(std::string_view head) {
  const auto kind = recognise_file({reinterpret_cast<const std::uint8_t*>(head.data()), head.size()});
  return kind ? kind->advice : "";
}

TEST(FileKind, EachBagIsForTheSameImport) {
  for (const std::string_view head : {"#ROSBAG V2.0\n"sv, "\x89MCAP0\r\n"sv, "SQLite format 3\0\x10"sv})
    EXPECT_EQ(advice_of(head), "'farpoint import bag' reads it");
}

TEST(FileKind, RecordersAndVideosAreRecognised) {
  EXPECT_EQ(name_of("#ROSBAG V2.0\nx"), "a ROS 1 bag");
  EXPECT_EQ(name_of("\x89MCAP0\r\n\x01"), "an MCAP recording");
  EXPECT_EQ(name_of("SQLite format 3\0\x10"sv).substr(0, 18), "an SQLite database");
  EXPECT_EQ(name_of("\0\0\0\x20"
                    "ftypisom"sv),
            "an MP4 or MOV video");
  EXPECT_EQ(name_of("\x1a\x45\xdf\xa3\x01"), "a Matroska or WebM video");
  EXPECT_EQ(name_of("RIFF\x24\0\0\0AVI LIST"sv), "an AVI video");
  EXPECT_EQ(name_of("\xd4\xc3\xb2\xa1\x02\x00"), "a pcap network capture");
  EXPECT_EQ(name_of("PK\x03\x04\x14"), "a ZIP archive");
  EXPECT_EQ(name_of("\x28\xb5\x2f\xfd\x24"), "a zstd file");
}

TEST(FileKind, LogsTextAndShortFilesAreNot) {
  EXPECT_EQ(name_of("\xed\xa1\xda\x01\0\0\0\0"sv), "");
  EXPECT_EQ(name_of("1305031102.1758 0 0 0 0 0 0 1\n"), "");
  EXPECT_EQ(name_of("%YAML:1.0\n"), "");
  for (std::size_t n = 0; n < 8; ++n) EXPECT_EQ(name_of("#ROSBAG V2.0\n"sv.substr(0, n)), "");
}

TEST(FileKind, TheErrorSaysWhatWhereAndWhatToDo) {
  const test::Scratch scratch;
  const std::string file = scratch.path("drive.zip");
  std::ofstream(file) << "PK\x03\x04rest";
  EXPECT_EQ(wrong_kind(file, "an LCM log"), file + ": a ZIP archive, expected an LCM log; unpack it first");
  EXPECT_EQ(wrong_kind(file, "a camera file", false), file + ": a ZIP archive, expected a camera file");
  EXPECT_EQ(wrong_kind(scratch.path("none"), "an LCM log"), "");
  EXPECT_EQ(wrong_kind("/dev/zero", "an LCM log"), "");
  try {
    LogReader reader(file);
    FAIL() << "accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), wrong_kind(file, "an LCM log"));
  }
}

TEST(FileKind, APipeIsNotWaitedFor) {
  const test::Scratch scratch;
  const std::string pipe = scratch.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(wrong_kind(pipe, "an LCM log"), "");
}

// Its writer would be ended by the reader that goes.
TEST(FileKind, APipeIsNotOpened) {
  const test::Scratch scratch;
  const std::string pipe = scratch.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int watch = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  ASSERT_GE(watch, 0);
  ASSERT_GE(inotify_add_watch(watch, pipe.c_str(), IN_OPEN), 0);
  EXPECT_EQ(wrong_kind(pipe, "an LCM log"), "");
  std::array<char, 4096> events{};
  EXPECT_LT(read(watch, events.data(), events.size()), 0) << "it was opened";
  const int opened = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  EXPECT_GT(read(watch, events.data(), events.size()), 0) << "an opening is seen";
  close(opened);
  close(watch);
}

}  // namespace
}  // namespace farpoint::ipc
