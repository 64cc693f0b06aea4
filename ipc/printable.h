// SPDX-License-Identifier: Apache-2.0
// Text of any origin as one line for logs, the journal and terminals.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace farpoint::ipc {

// A longer line could be cut by its reader, and the rest then taken as a line of its own.
inline constexpr std::size_t kMaxLineBytes = 8192;

// Returns true where printable() would return the text unchanged. No heap call.
[[nodiscard]] bool is_printable_line(std::string_view text);

// Escapes line breaks and tabs as \n, \r, \t, other control characters (C0, DEL, C1) and bytes outside UTF-8
// as \xNN. Cuts at `most_bytes` and then ends in "...".
[[nodiscard]] std::string printable(std::string_view text, std::size_t most_bytes = kMaxLineBytes);

}  // namespace farpoint::ipc
