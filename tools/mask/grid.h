// SPDX-License-Identifier: Apache-2.0
// Clean-up of small binary pictures: boxes, components, dilation.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace farpoint::tools {

// Cells row by row.
template <typename T>
struct Grid {
  int columns = 0, rows = 0;
  std::vector<T> cells;

  Grid(int of_columns, int of_rows, T value = T{})
      : columns(of_columns),
        rows(of_rows),
        cells(static_cast<std::size_t>(of_columns) * static_cast<std::size_t>(of_rows), value) {}
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < columns && y < rows; }
  [[nodiscard]] T& at(int x, int y) { return cells[index(x, y)]; }
  [[nodiscard]] const T& at(int x, int y) const { return cells[index(x, y)]; }
};

using Bits = Grid<std::uint8_t>;

// Sum over the square of half side `radius` around each cell, cut at the edge.
[[nodiscard]] Grid<double> box_sums(const Grid<double>& of, int radius);
// Cells within `radius` (a square) of a set one.
[[nodiscard]] Bits dilated(const Bits& bits, int radius);
// Dilation, then erosion: gaps up to twice the radius are closed. Outside the grid counts as set.
[[nodiscard]] Bits closed(const Bits& bits, int radius);

// Calls `visit` with the cells of each component (four neighbours) of the set cells.
void for_each_component(const Bits& bits, const std::function<void(const std::vector<std::size_t>&)>& visit);

}  // namespace farpoint::tools
