// SPDX-License-Identifier: Apache-2.0
// What the tests of the tools share: a scratch folder, made-up recordings, and running the built program.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tools/trajectory/trajectory.h"

namespace farpoint::tools {

// A folder that is removed with the object.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Writes a file, making its folders.
void put(const std::filesystem::path& file, const std::string& content);
[[nodiscard]] std::string get(const std::filesystem::path& file);
// Replaces the first occurrence of `from` in a file; the test fails where there is none.
void replace_in(const std::filesystem::path& file, const std::string& from, const std::string& to);
[[nodiscard]] std::string make_image(const std::string& extension, int width_px, int height_px, int shade);

// The message of the InputError that `action` must throw: one line.
[[nodiscard]] std::string complaint_of(const std::function<void()>& action);
// Whether `action` goes through. Where it throws, the message must be one line.
[[nodiscard]] bool passes_or_says_one_line(const std::function<void()>& action);
void expect_all_in(const std::string& message, const std::vector<std::string>& parts);

struct ProgramResult {
  int status = -1;
  std::string out, err;
};
// Runs a shell command line; run_farpoint_program puts the built farpoint before it.
[[nodiscard]] ProgramResult run_shell(const std::string& command);
// Path of the built farpoint.
[[nodiscard]] std::string program();
[[nodiscard]] ProgramResult run_farpoint_program(const std::string& arguments);

// Small recordings of each layout: 5 frames of 64x48 pixels, stereo where the layout has it.
void make_kitti(const std::filesystem::path& root);  // sequence "07"
void make_euroc(const std::filesystem::path& root);
void make_tum(const std::filesystem::path& root);  // with camera.yaml beside rgb.txt

// A smooth random path of `n` poses, `rate_hz` a second, from `start_s` on.
[[nodiscard]] Trajectory random_path(std::mt19937_64* random, int n, double rate_hz, double start_s);
// The same path seen in another frame, unit and with noise.
[[nodiscard]] Trajectory disturbed(const Trajectory& path, double scale, double noise_m,
                                   std::mt19937_64* random);

// Folder of recordings outside the repository; empty where it is absent.
[[nodiscard]] std::filesystem::path shared_folder();

// `key=value` in a line of such pairs; the test fails where it is absent.
[[nodiscard]] std::string value_of(const std::string& line, const std::string& key);

#define SKIP_WITHOUT_SHARED_DATA() \
  if (shared_folder().empty()) GTEST_SKIP() << "no recordings beside the repository (../shared/data)"

}  // namespace farpoint::tools
