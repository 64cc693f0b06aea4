// SPDX-License-Identifier: Apache-2.0
// The page's own script: zoom by dragging over a diagram, and the values under the pointer. It loads nothing,
// and the page is whole without it.
#pragma once

namespace farpoint::tools::report {

// JavaScript without the character '<', so that it stands in the page as it is. It reads what Plot::svg()
// writes: data-x and data-y (`low high log|linear`) of a drawing, the group `ticks`, the inner drawing
// `area`, and data-name of its lines.
[[nodiscard]] const char* page_script();

}  // namespace farpoint::tools::report
