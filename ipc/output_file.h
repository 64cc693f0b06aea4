// SPDX-License-Identifier: Apache-2.0
// Atomic output files: written under a temporary name beside the target, renamed at the end.
#pragma once

#include <cstdio>
#include <string>

namespace farpoint::ipc {

// A target path and its temporary. commit() renames; destruction without commit() removes the temporary and
// leaves the target unchanged. Devices and pipes are written directly; "-" is standard output.
class ReplacedPath {
 public:
  // Throws std::runtime_error if the target's folder does not exist or the target is a folder.
  explicit ReplacedPath(std::string target);
  ~ReplacedPath();
  ReplacedPath(const ReplacedPath&) = delete;
  ReplacedPath& operator=(const ReplacedPath&) = delete;

  [[nodiscard]] const std::string& target() const { return target_; }
  [[nodiscard]] const std::string& writable() const { return writable_; }  // open this one
  // Renames, and flushes the folder to the disk. Throws std::runtime_error if the rename fails.
  void commit();
  // Leaves the temporary where it is, and the target unchanged.
  void leave() { committed_ = true; }
  // Renames the temporary to the target's name with `suffix`, and returns that name; the target stays
  // unchanged. Returns empty without a temporary (a device or a pipe) or on failure.
  std::string keep_as(const std::string& suffix);

 private:
  [[nodiscard]] bool has_temporary() const { return writable_.size() > target_.size() && target_ != "-"; }

  std::string target_, writable_;
  bool committed_ = false;
};

// A stream into a ReplacedPath.
class OutputFile {
 public:
  explicit OutputFile(std::string target);  // throws std::runtime_error
  ~OutputFile();                            // without close() no file remains
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  [[nodiscard]] std::FILE* stream() { return stream_; }
  // Flushes to the disk and renames. Throws std::runtime_error naming the file if anything was not stored
  // (disk full); the target is then unchanged.
  void close();

 private:
  ReplacedPath path_;
  std::FILE* stream_ = nullptr;
};

// Flushes the folder of a file to the disk, which makes a rename last.
void sync_folder_of(const std::string& path);
// Flushes a stream to the disk. Returns empty on success, else errno's text.
[[nodiscard]] std::string flush_to_disk(std::FILE* stream);

}  // namespace farpoint::ipc
