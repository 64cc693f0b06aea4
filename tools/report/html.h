// SPDX-License-Identifier: Apache-2.0
// Pieces of the page.
#pragma once

#include <string>
#include <vector>

namespace farpoint::tools::report {

// A heading, a sentence on what is shown, and the content.
[[nodiscard]] std::string section(const std::string& title, const std::string& explanation,
                                  const std::string& content);
// Diagrams side by side, as far as the page is wide.
[[nodiscard]] std::string row_of(const std::vector<std::string>& pictures);
// The first row is the heading; the first column stands left, figures right.
[[nodiscard]] std::string table(const std::vector<std::vector<std::string>>& rows);
[[nodiscard]] std::string page(const std::string& title, const std::string& body);

}  // namespace farpoint::tools::report
