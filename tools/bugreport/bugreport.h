// SPDX-License-Identifier: Apache-2.0
// One archive with what a person needs who looks for a fault from afar: configuration, versions, the daemon's
// state and last log lines, and the hardware. Needs no root; what cannot be read is listed with its reason.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace farpoint::tools {

struct BugreportOptions {
  std::string config;  // empty: /etc/farpoint/farpoint.yaml where it exists, else the defaults
  std::string socket;  // empty: control.socket of that configuration
  std::string output;  // the archive
};

// A folder of files, with the list of them. Every file is as long as its source, or begins with a line that
// names what was left out.
class Collection {
 public:
  static constexpr std::size_t kMostBytes = 2'000'000;  // of one file; its end is taken

  // Creates the folder.
  explicit Collection(std::filesystem::path folder);

  void add_text(const std::string& name, const std::string& from, std::string text);
  void add_file(const std::string& name, const std::filesystem::path& source);
  // Runs a program, at most kLongest_s, and keeps what it prints. Its exit status does not matter where it
  // prints something. `package`: where the program is from.
  void add_output(const std::string& name, std::vector<std::string> command, const std::string& package);
  void add_missing(const std::string& name, const std::string& why);

  // Writes contents.txt, the list of everything taken and not read.
  void write_list(const std::string& head);
  [[nodiscard]] std::size_t taken() const { return taken_.size(); }
  // "NAME: reason".
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

 private:
  static constexpr int kLongest_s = 20;

  std::filesystem::path folder_;
  std::vector<std::string> taken_, missing_;
};

// Fills the collection.
void collect(const BugreportOptions& options, Collection* collection);

// Makes the archive. Returns what could not be read. Throws InputError where no archive can be written there,
// RunError where it cannot be made.
[[nodiscard]] std::vector<std::string> make_bugreport(const BugreportOptions& options);

}  // namespace farpoint::tools
