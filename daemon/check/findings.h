// SPDX-License-Identifier: Apache-2.0
// What --check found: one line a thing that was looked at.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace farpoint::daemon {

enum class Verdict : std::uint8_t {
  kOk,
  kWarning,  // a live run starts, with less than was configured
  kError,    // a live run does not start, has no images, or what was asked for does not leave it
};
[[nodiscard]] const char* to_string(Verdict verdict);

struct Finding {
  std::string what;
  Verdict verdict = Verdict::kOk;
  std::string sentence;
};

class Findings {
 public:
  void ok(std::string what, std::string sentence) { add(std::move(what), Verdict::kOk, std::move(sentence)); }
  void warn(std::string what, std::string sentence) {
    add(std::move(what), Verdict::kWarning, std::move(sentence));
  }
  void fail(std::string what, std::string sentence) {
    add(std::move(what), Verdict::kError, std::move(sentence));
  }

  [[nodiscard]] const std::vector<Finding>& all() const { return all_; }
  [[nodiscard]] Verdict worst() const;
  // A table, a line each.
  [[nodiscard]] std::string text() const;
  // One line: {"program": ..., "verdict": ..., "checks": [{"what", "verdict", "sentence"}]}.
  [[nodiscard]] std::string json(const std::string& program) const;

 private:
  void add(std::string what, Verdict verdict, std::string sentence) {
    all_.push_back({std::move(what), verdict, std::move(sentence)});
  }

  std::vector<Finding> all_;
};

}  // namespace farpoint::daemon
