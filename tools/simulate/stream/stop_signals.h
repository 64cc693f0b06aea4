// SPDX-License-Identifier: Apache-2.0
// Signals that end a run in order instead of at once.
#pragma once

namespace farpoint::tools::simulate {

// During its life SIGINT and SIGTERM are recorded, and a closed reader (SIGPIPE) or a file size limit
// (SIGXFSZ) becomes a write error.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // The received stop signal; 0: none.
  [[nodiscard]] static int received();

 private:
  static constexpr int kKinds = 2;
  void (*stopping_[kKinds])(int);
  void (*writing_[kKinds])(int);
};

}  // namespace farpoint::tools::simulate
