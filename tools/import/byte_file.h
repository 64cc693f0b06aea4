// SPDX-License-Identifier: Apache-2.0
// A file read at any place, with errors that name file and byte. Nothing of its content is trusted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace farpoint::tools {

class ByteFile {
 public:
  // Throws InputError for what is no regular file that can be read.
  explicit ByteFile(std::filesystem::path path);
  ~ByteFile();
  ByteFile(const ByteFile&) = delete;
  ByteFile& operator=(const ByteFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  // Bytes from `offset` on. Throws InputError, before any memory is taken, where the file ends earlier.
  [[nodiscard]] std::string read(std::uint64_t offset, std::uint64_t bytes) const;
  // A little-endian number of 4 or 8 bytes.
  [[nodiscard]] std::uint32_t read_u32(std::uint64_t offset) const;
  // Throws InputError unless all of the range is in the file.
  void require(std::uint64_t offset, std::uint64_t bytes) const;
  // Throws InputError "FILE: byte OFFSET: message".
  [[noreturn]] void fail(std::uint64_t offset, const std::string& message) const;

 private:
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
  int fd_ = -1;
};

}  // namespace farpoint::tools
