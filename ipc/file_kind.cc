// SPDX-License-Identifier: Apache-2.0
#include "ipc/file_kind.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace farpoint::ipc {
namespace {

struct Magic {
  std::size_t offset;
  std::string_view bytes;
  FileKind kind;
};

using namespace std::string_view_literals;

constexpr const char* kUnpack = "unpack it first";
constexpr const char* kPictures = "'farpoint import images' takes a folder of them";
constexpr const char* kVideo = "'farpoint import video' reads it";
constexpr const char* kRosBag = "'farpoint import bag' reads it";
constexpr const char* kNothing = "";

constexpr std::array kMagics = {
    Magic{0, "#ROSBAG V"sv, {"a ROS 1 bag", kRosBag}},
    Magic{0, "\x89MCAP0\r\n"sv, {"an MCAP recording", kRosBag}},
    Magic{0, "SQLite format 3\0"sv, {"an SQLite database (a ROS 2 bag has the name .db3)", kRosBag}},
    Magic{4, "ftyp"sv, {"an MP4 or MOV video", kVideo}},
    Magic{4, "moov"sv, {"a MOV video", kVideo}},
    Magic{0, "\x1a\x45\xdf\xa3"sv, {"a Matroska or WebM video", kVideo}},
    Magic{8, "AVI "sv, {"an AVI video", kVideo}},
    Magic{0, "\x00\x00\x01\xba"sv, {"an MPEG video", kVideo}},
    Magic{0, "\x00\x00\x00\x01\x67"sv, {"an H.264 video", kVideo}},
    Magic{0, "\xd4\xc3\xb2\xa1"sv, {"a pcap network capture", kNothing}},
    Magic{0, "\xa1\xb2\xc3\xd4"sv, {"a pcap network capture", kNothing}},
    Magic{0, "\x4d\x3c\xb2\xa1"sv, {"a pcap network capture", kNothing}},
    Magic{0, "\x0a\x0d\x0d\x0a"sv, {"a pcapng network capture", kNothing}},
    Magic{0, "PK\x03\x04"sv, {"a ZIP archive", kUnpack}},
    Magic{0, "\x1f\x8b"sv, {"a gzip file", kUnpack}},
    Magic{0, "BZh"sv, {"a bzip2 file", kUnpack}},
    Magic{0,
          "\xfd"
          "7zXZ\0"sv,
          {"an xz file", kUnpack}},
    Magic{0, "\x28\xb5\x2f\xfd"sv, {"a zstd file", kUnpack}},
    Magic{0, "7z\xbc\xaf\x27\x1c"sv, {"a 7z archive", kUnpack}},
    Magic{0, "Rar!\x1a\x07"sv, {"a RAR archive", kUnpack}},
    Magic{0, "\xff\xd8\xff"sv, {"a JPEG picture", kPictures}},
    Magic{0, "\x89PNG\r\n\x1a\n"sv, {"a PNG picture", kPictures}},
    Magic{0, "\x89HDF\r\n\x1a\n"sv, {"an HDF5 file", kNothing}},
    Magic{0, "%PDF-"sv, {"a PDF document", kNothing}},
    Magic{0,
          "\x7f"
          "ELF"sv,
          {"a program", kNothing}},
};

}  // namespace

std::optional<FileKind> recognise_file(std::span<const std::uint8_t> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), std::min(head.size(), kKindBytes));
  for (const Magic& magic : kMagics)
    if (text.size() >= magic.offset && text.substr(magic.offset).starts_with(magic.bytes)) return magic.kind;
  return {};
}

std::string wrong_kind(int fd, const std::string& file, const std::string& wanted, bool with_advice) {
  struct stat info {};
  std::array<std::uint8_t, kKindBytes> head{};
  if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) return {};
  const ssize_t got = pread(fd, head.data(), head.size(), 0);
  if (got <= 0) return {};
  const auto kind = recognise_file({head.data(), static_cast<std::size_t>(got)});
  if (!kind) return {};
  const std::string advice = with_advice ? kind->advice : "";
  return file + ": " + kind->name + ", expected " + wanted + (advice.empty() ? "" : "; " + advice);
}

std::string wrong_kind(const std::string& file, const std::string& wanted, bool with_advice) {
  // A pipe whose reader closes it ends its writer: other files than regular ones are not opened.
  struct stat info {};
  if (stat(file.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return {};
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return {};
  std::string text = wrong_kind(fd, file, wanted, with_advice);
  close(fd);
  return text;
}

}  // namespace farpoint::ipc
