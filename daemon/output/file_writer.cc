// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/file_writer.h"

#include <ctime>
#include <utility>

namespace farpoint::daemon {
namespace {

// The pushing thread makes no system call, so the writer looks at intervals.
constexpr timespec kLookEvery{0, 20'000'000};

}  // namespace

std::uint32_t FileWriter::add_file(Write write) {
  files_.push_back(std::move(write));
  return static_cast<std::uint32_t>(files_.size() - 1);
}

void FileWriter::start(const RealtimeConfig& config, RealtimeReport* report) {
  stop_.store(false, std::memory_order_relaxed);
  thread_.emplace(kThread, config, ThreadConfig{}, report, [this] { run(); });
}

void FileWriter::stop() {
  if (!thread_) return;
  stop_.store(true, std::memory_order_release);
  thread_.reset();
}

bool FileWriter::push(std::uint32_t file, RecordRing::Parts parts) {
  if (!thread_) {
    std::vector<std::uint8_t> record;
    for (const auto part : parts) record.insert(record.end(), part.begin(), part.end());
    files_[file](record);
    return true;
  }
  const bool pushed = ring_.push(file, parts);
  if (!pushed) dropped_.fetch_add(1, std::memory_order_relaxed);
  return pushed;
}

void FileWriter::run() {
  for (;;) {
    const bool is_last = stop_.load(std::memory_order_acquire);
    write_all();
    for (const auto& turn : turns_) turn();
    if (is_last) return;
    clock_nanosleep(CLOCK_MONOTONIC, 0, &kLookEvery, nullptr);
  }
}

void FileWriter::write_all() {
  for (Record record; ring_.front(&record); ring_.pop()) files_[record.kind](record.bytes);
}

}  // namespace farpoint::daemon
