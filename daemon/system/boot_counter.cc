// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/boot_counter.h"

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <random>
#include <stdexcept>

#include "ipc/output_file.h"

namespace farpoint::daemon {
namespace {

constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();

std::int32_t random_counter() {
  std::random_device device;
  return std::uniform_int_distribution<std::int32_t>(1, kMost)(device);
}

// 0 without a file. Empty for a file that holds no counter.
std::optional<std::int32_t> kept(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return 0;
  std::ifstream in(path);
  std::int32_t value = 0;
  if (!(in >> value) || value < 0) return std::nullopt;
  return value;
}

void keep(const std::string& path, std::int32_t value) {
  ipc::OutputFile file(path);
  std::fprintf(file.stream(), "%" PRId32 "\n", value);
  file.close();
}

}  // namespace

std::string state_folder(const std::string& key) {
  if (key == "none") return {};
  if (key != "auto") return key;
  const char* folders = std::getenv("STATE_DIRECTORY");
  const std::string all = folders == nullptr ? "" : folders;
  return all.substr(0, all.find(':'));
}

BootCounter next_boot_counter(const std::string& folder) {
  if (folder.empty()) return {random_counter(), "no folder keeps it"};
  const std::string path = folder + "/boot_counter";
  const std::optional<std::int32_t> before = kept(path);
  BootCounter counter;
  counter.value = !before ? random_counter() : *before == kMost ? 1 : *before + 1;
  if (!before) counter.problem = path + ": expected a number; replaced with a random one";
  try {
    keep(path, counter.value);
  } catch (const std::runtime_error& error) {
    return {random_counter(), error.what()};
  }
  return counter;
}

std::uint8_t boot_counter_on_can(std::int32_t value) {
  constexpr std::int32_t kPeriod = 255;
  return value <= 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(1 + (value - 1) % kPeriod);
}

}  // namespace farpoint::daemon
