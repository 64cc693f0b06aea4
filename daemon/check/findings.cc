// SPDX-License-Identifier: Apache-2.0
#include "daemon/check/findings.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

// Paths and names may hold any byte; printable() leaves no control characters.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : ipc::printable(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kWarning:
      return "warning";
    case Verdict::kError:
      return "error";
  }
  return "?";
}

Verdict Findings::worst() const {
  Verdict worst = Verdict::kOk;
  for (const Finding& finding : all_) worst = std::max(worst, finding.verdict);
  return worst;
}

std::string Findings::text() const {
  std::size_t width = 0;
  for (const Finding& finding : all_) width = std::max(width, finding.what.size());
  std::string text;
  for (const Finding& finding : all_)
    text += fmt::format("{:<{}}  {:<7}  {}\n", finding.what, width, to_string(finding.verdict),
                        ipc::printable(finding.sentence));
  return text;
}

std::string Findings::json(const std::string& program) const {
  std::string checks;
  for (const Finding& finding : all_)
    checks +=
        fmt::format("{}{{\"what\": {}, \"verdict\": \"{}\", \"sentence\": {}}}", checks.empty() ? "" : ", ",
                    quoted(finding.what), to_string(finding.verdict), quoted(finding.sentence));
  return fmt::format("{{\"program\": {}, \"verdict\": \"{}\", \"checks\": [{}]}}\n", quoted(program),
                     to_string(worst()), checks);
}

}  // namespace farpoint::daemon
