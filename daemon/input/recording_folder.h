// SPDX-License-Identifier: Apache-2.0
// File names of one recording (--record FOLDER/STEM.EXT):
//   STEM.EXT               a recording in one file
//   STEM-000017.EXT        file 17 of a recording in numbered files
//   STEM-recovered-1.EXT   what a killed run left, where its own name is in use
//   NAME.partPID           any of them while process PID writes it
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace farpoint::daemon {

class RecordingFolder {
 public:
  explicit RecordingFolder(const std::string& target);

  struct NumberedFile {
    std::int64_t number = 0;
    std::string path;
    std::uint64_t bytes = 0;
  };
  // Finished numbered files, the oldest first.
  [[nodiscard]] std::vector<NumberedFile> numbered_files() const;
  // Above the number of each file, finished or not.
  [[nodiscard]] std::int64_t next_number() const;
  [[nodiscard]] std::string numbered_path(std::int64_t number) const;
  // Parts that no running process writes.
  [[nodiscard]] std::vector<std::string> orphans() const;
  // Renames a part that a process of this process' number left, since the name is about to be used.
  void set_aside(const std::string& part) const;
  // Renames a part to its own name where that is free and is not `reserved`, else to a recovered one.
  // Overwrites no file. Returns the new path; empty on failure.
  [[nodiscard]] std::string finish(const std::string& part, const std::string& reserved) const;
  // Free share of the disk, 0 to 1; 1 where it cannot be read.
  [[nodiscard]] double free_share() const;

 private:
  [[nodiscard]] std::string path_of(const std::string& name) const;
  [[nodiscard]] std::optional<std::int64_t> number_of(const std::string& name) const;
  [[nodiscard]] bool is_ours(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> names() const;

  std::string folder_, stem_, extension_;
};

}  // namespace farpoint::daemon
