// SPDX-License-Identifier: Apache-2.0
// Names files of a wrong kind by their first bytes, so that an error can say what a file is.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace farpoint::ipc {

struct FileKind {
  const char* name;    // "an MP4 or MOV video"
  const char* advice;  // what to do with it; empty: nothing reads it
};

// Bytes that recognise_file() looks at.
inline constexpr std::size_t kKindBytes = 64;

// Empty for LCM logs, text and unknown files. Reads at most the first kKindBytes. No heap call.
[[nodiscard]] std::optional<FileKind> recognise_file(std::span<const std::uint8_t> head);

// "FILE: a ROS 1 bag, expected WANTED; <advice>" for a file of a known kind; empty for others, and for what
// cannot be read or is no regular file.
[[nodiscard]] std::string wrong_kind(const std::string& file, const std::string& wanted,
                                     bool with_advice = true);
// The same for an open file; its position stays.
[[nodiscard]] std::string wrong_kind(int fd, const std::string& file, const std::string& wanted,
                                     bool with_advice = true);

}  // namespace farpoint::ipc
