// Signals that end a run in order instead of at once.
#pragma once

namespace farpoint::tools::simulate {

// While it lives, SIGINT and SIGTERM are noted; a reader that goes away (SIGPIPE) or a file size limit
// (SIGXFSZ) becomes an error of the write.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // The signal that asked to stop; 0: none.
  [[nodiscard]] static int received();

 private:
  static constexpr int kKinds = 2;
  void (*stopping_[kKinds])(int);
  void (*writing_[kKinds])(int);
};

}  // namespace farpoint::tools::simulate
