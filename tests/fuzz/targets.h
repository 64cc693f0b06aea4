// SPDX-License-Identifier: Apache-2.0
// Functions that take any bytes as one of the program's inputs. libFuzzer drives them (fuzz_main.cc); the
// ordinary tests give them the seeds, the kept inputs and damaged ones (corpus_test.cc).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace farpoint::fuzz {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

struct Target {
  std::string name;
  // Must return for any bytes, within bounded time and memory. Broken promises end the program (require()).
  void (*run)(ByteView input);
  std::vector<Bytes> (*seeds)();  // valid inputs to start from
  int max_bytes = 4096;           // longer inputs find no more
};

[[nodiscard]] std::span<const Target> targets();
// Throws std::out_of_range for an unknown name.
[[nodiscard]] const Target& target_of(std::string_view name);

// Ends the program with a message where `holds` is false.
void require(bool holds, std::string_view what);

[[nodiscard]] inline std::string text_of(ByteView input) {
  return {input.begin(), input.end()};
}
[[nodiscard]] inline Bytes bytes_of(std::string_view text) {
  return {text.begin(), text.end()};
}

// Targets and seeds, a file of the folder for each group.
void run_log(ByteView input);
void run_message(ByteView input);
void run_image(ByteView input);
void run_config(ByteView input);
void run_camera(ByteView input);
void run_world(ByteView input);
void run_dbc(ByteView input);
void run_can(ByteView input);
void run_control(ByteView input);
void run_evaluate(ByteView input);
void run_report(ByteView input);
void run_bag(ByteView input);
void run_db3(ByteView input);
void run_stamps(ByteView input);
void run_mavlink(ByteView input);
void run_layout(ByteView input);
[[nodiscard]] std::vector<Bytes> seeds_of_log();
[[nodiscard]] std::vector<Bytes> seeds_of_message();
[[nodiscard]] std::vector<Bytes> seeds_of_image();
[[nodiscard]] std::vector<Bytes> seeds_of_config();
[[nodiscard]] std::vector<Bytes> seeds_of_camera();
[[nodiscard]] std::vector<Bytes> seeds_of_world();
[[nodiscard]] std::vector<Bytes> seeds_of_dbc();
[[nodiscard]] std::vector<Bytes> seeds_of_can();
[[nodiscard]] std::vector<Bytes> seeds_of_control();
[[nodiscard]] std::vector<Bytes> seeds_of_run();
[[nodiscard]] std::vector<Bytes> seeds_of_bag();
[[nodiscard]] std::vector<Bytes> seeds_of_db3();
[[nodiscard]] std::vector<Bytes> seeds_of_stamps();
[[nodiscard]] std::vector<Bytes> seeds_of_mavlink();
[[nodiscard]] std::vector<Bytes> seeds_of_layout();

}  // namespace farpoint::fuzz
