// Files that appear whole or not at all: written under a temporary name beside the target, renamed at the
// end.
#pragma once

#include <cstdio>
#include <string>

namespace farpoint::ipc {

// A target path and the temporary path to write meanwhile. commit() renames; a destructor without commit()
// removes the temporary and leaves an existing target as it was. Devices and pipes are written directly; "-"
// is standard output.
class ReplacedPath {
 public:
  // Throws std::runtime_error where the target's folder does not exist or the target is a folder.
  explicit ReplacedPath(std::string target);
  ~ReplacedPath();
  ReplacedPath(const ReplacedPath&) = delete;
  ReplacedPath& operator=(const ReplacedPath&) = delete;

  [[nodiscard]] const std::string& target() const { return target_; }
  [[nodiscard]] const std::string& writable() const { return writable_; }  // open this one
  // Throws std::runtime_error where the rename fails.
  void commit();
  // Keeps the temporary as the target's name with `suffix` instead, and gives that name; the target stays as
  // it was. Empty where there is no temporary (a device or a pipe) or it cannot be renamed.
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
  ~OutputFile();                            // without close(): nothing is left behind
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  [[nodiscard]] std::FILE* stream() { return stream_; }
  // Flushes to the disk and renames. Throws std::runtime_error naming the file where anything written so far
  // was not stored (disk full); the target is then left as it was.
  void close();

 private:
  ReplacedPath path_;
  std::FILE* stream_ = nullptr;
};

// Flushes a stream to the disk. Empty on success, else errno's text.
[[nodiscard]] std::string flush_to_disk(std::FILE* stream);

}  // namespace farpoint::ipc
