// SPDX-License-Identifier: Apache-2.0
// Occlusion culling: skips what is hidden behind faces already drawn.
#pragma once

#include <Eigen/Core>

#include "tools/simulate/render/ray_table.h"

namespace farpoint::tools::simulate {

// Returns true if no part of a sphere is visible in the rows [first_row, last_row) of a view: outside of
// them, or behind nearer cells throughout. `inverse_depth` is the buffer of all views, 0 where empty. In
// doubt it returns false.
[[nodiscard]] bool is_hidden(const Eigen::Vector3f& centre_in_view, float radius_m, const RasterView& view,
                             int first_row, int last_row, const float* inverse_depth);

}  // namespace farpoint::tools::simulate
