// SPDX-License-Identifier: Apache-2.0
#include "tools/mask/grid.h"

#include <algorithm>

namespace farpoint::tools {
namespace {

// Sums over `radius` cells to either side, along a row or a column; `step`: from one cell to the next.
void sum_line(const double* from, double* to, std::size_t step, int length, int radius) {
  const auto at = [step](int i) { return static_cast<std::size_t>(i) * step; };
  for (int i = 0; i < length; ++i) {
    double sum = 0;
    for (int k = std::max(0, i - radius); k <= std::min(length - 1, i + radius); ++k) sum += from[at(k)];
    to[at(i)] = sum;
  }
}

Bits inverted(Bits bits) {
  for (std::uint8_t& cell : bits.cells) cell = cell == 0 ? 1 : 0;
  return bits;
}

}  // namespace

Grid<double> box_sums(const Grid<double>& of, int radius) {
  Grid<double> along(of.columns, of.rows), sums(of.columns, of.rows);
  for (int y = 0; y < of.rows; ++y)
    sum_line(of.cells.data() + of.index(0, y), along.cells.data() + of.index(0, y), 1, of.columns, radius);
  for (int x = 0; x < of.columns; ++x)
    sum_line(along.cells.data() + x, sums.cells.data() + x, static_cast<std::size_t>(of.columns), of.rows,
             radius);
  return sums;
}

Bits dilated(const Bits& bits, int radius) {
  Grid<double> counts(bits.columns, bits.rows);
  std::transform(bits.cells.begin(), bits.cells.end(), counts.cells.begin(),
                 [](std::uint8_t cell) { return cell != 0 ? 1.0 : 0.0; });
  const Grid<double> sums = box_sums(counts, radius);
  Bits result(bits.columns, bits.rows);
  std::transform(sums.cells.begin(), sums.cells.end(), result.cells.begin(),
                 [](double sum) { return sum > 0.5 ? std::uint8_t{1} : std::uint8_t{0}; });
  return result;
}

Bits closed(const Bits& bits, int radius) {
  return inverted(dilated(inverted(dilated(bits, radius)), radius));
}

void for_each_component(const Bits& bits, const std::function<void(const std::vector<std::size_t>&)>& visit) {
  Bits left = bits;
  std::vector<std::size_t> component;
  for (std::size_t start = 0; start < left.cells.size(); ++start) {
    if (left.cells[start] == 0) continue;
    component.assign(1, start);
    left.cells[start] = 0;
    for (std::size_t next = 0; next < component.size(); ++next) {
      const int x = static_cast<int>(component[next] % static_cast<std::size_t>(left.columns)),
                y = static_cast<int>(component[next] / static_cast<std::size_t>(left.columns));
      const int around[4][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
      for (const auto& [u, v] : around) {
        if (!left.holds(u, v) || left.at(u, v) == 0) continue;
        left.at(u, v) = 0;
        component.push_back(left.index(u, v));
      }
    }
    visit(component);
  }
}

}  // namespace farpoint::tools
