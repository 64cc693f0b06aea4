// SPDX-License-Identifier: Apache-2.0
// Writes a run's files on a thread of its own (fp-files), so that a slow or full disk holds no other thread.
//
// The output thread pushes records into a bounded ring and never waits. When the ring is full, new records
// are dropped and counted.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/output/record_ring.h"
#include "daemon/system/realtime.h"

namespace farpoint::daemon {

class FileWriter {
 public:
  static constexpr const char* kThread = "fp-files";
  // Writes one record to its file.
  using Write = std::function<void(std::span<const std::uint8_t>)>;

  explicit FileWriter(std::size_t ring_bytes) : ring_(ring_bytes) {}
  // Calls stop().
  ~FileWriter() { stop(); }
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  // Before start(). Returns the number of the file, for push().
  [[nodiscard]] std::uint32_t add_file(Write write);
  // Before start(): called by the thread about every 20 ms, for what has a ring of its own.
  void add_turn(std::function<void()> turn) { turns_.push_back(std::move(turn)); }

  // Starts the thread. `report` may be null.
  void start(const RealtimeConfig& config, RealtimeReport* report);
  // Writes what waits, then ends the thread.
  void stop();

  // One thread at a time. While the writer's thread runs: no system call, no heap call, and false where the
  // record was dropped. Otherwise the record is written at once.
  bool push(std::uint32_t file, RecordRing::Parts parts);

  // Any thread.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  void run();
  void write_all();

  RecordRing ring_;
  std::vector<Write> files_;
  std::vector<std::function<void()>> turns_;
  std::optional<Thread> thread_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace farpoint::daemon
