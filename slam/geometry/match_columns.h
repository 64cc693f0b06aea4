// SPDX-License-Identifier: Apache-2.0
// Matched bearings as columns, for the costs that sampling compares: many matches at once, no branch.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace farpoint::slam {

// Matches as single-precision columns, padded with zeros to whole blocks; a zero match costs nothing in any
// model.
class MatchColumns {
 public:
  // `memory` holds them; it grows where it has too few rows.
  MatchColumns(std::span<const Eigen::Vector3d> bearings_1, std::span<const Eigen::Vector3d> bearings_2,
               Eigen::ArrayXXf* memory)
      : rows_(padded_rows(bearings_1.size())), columns_(*memory) {
    const Eigen::Index n = static_cast<Eigen::Index>(bearings_1.size());
    if (columns_.rows() < rows_) columns_.resize(rows_, kColumns);
    columns_.topRows(rows_).setZero();
    for (Eigen::Index i = 0; i < n; ++i) {
      columns_.row(i).head<3>() = bearings_1[static_cast<size_t>(i)].cast<float>().transpose();
      columns_.row(i).tail<3>() = bearings_2[static_cast<size_t>(i)].cast<float>().transpose();
    }
  }

  // Sum of min(residual2, limit2) over all matches; stops early, at a value of at least `enough`, once it is
  // reached. Kernel: (x1, y1, z1, x2, y2, z2 blocks) -> block of squared residuals in rad^2.
  template <typename Kernel>
  [[nodiscard]] float cost(const Kernel& kernel, float limit2, float enough) const {
    float sum = 0.0F;
    for (Eigen::Index i = 0; i < rows_ && sum < enough; i += kBlock) {
      sum += residuals2(kernel, i).min(limit2).sum();
    }
    return sum;
  }
  // Number of matches with residual2 < limit2, padding included.
  template <typename Kernel>
  [[nodiscard]] Eigen::Index count(const Kernel& kernel, float limit2) const {
    Eigen::Index total = 0;
    for (Eigen::Index i = 0; i < rows_; i += kBlock) total += (residuals2(kernel, i) < limit2).count();
    return total;
  }
  [[nodiscard]] Eigen::Index padded() const { return rows_; }

  static constexpr Eigen::Index kBlock = 32, kColumns = 6;
  [[nodiscard]] static Eigen::Index padded_rows(size_t matches) {
    return (static_cast<Eigen::Index>(matches) + kBlock - 1) / kBlock * kBlock;
  }
  using Block = Eigen::Array<float, kBlock, 1>;
  static constexpr float kTiny = 1e-20F;  // instead of a zero denominator

 private:
  template <typename Kernel>
  [[nodiscard]] Block residuals2(const Kernel& kernel, Eigen::Index i) const {
    const auto column = [&](Eigen::Index k) -> Block { return columns_.col(k).template segment<kBlock>(i); };
    return kernel(column(0), column(1), column(2), column(3), column(4), column(5));
  }

  Eigen::Index rows_;
  Eigen::ArrayXXf& columns_;  // its first rows_
};

// Squared Sampson angle of an essential matrix of any scale.
struct EssentialKernel {
  using Block = MatchColumns::Block;
  Eigen::Matrix3f e;
  Block operator()(const Block& x1, const Block& y1, const Block& z1, const Block& x2, const Block& y2,
                   const Block& z2) const {
    const Block nx = e(0, 0) * x1 + e(0, 1) * y1 + e(0, 2) * z1;
    const Block ny = e(1, 0) * x1 + e(1, 1) * y1 + e(1, 2) * z1;
    const Block nz = e(2, 0) * x1 + e(2, 1) * y1 + e(2, 2) * z1;
    const Block mx = e(0, 0) * x2 + e(1, 0) * y2 + e(2, 0) * z2;
    const Block my = e(0, 1) * x2 + e(1, 1) * y2 + e(2, 1) * z2;
    const Block mz = e(0, 2) * x2 + e(1, 2) * y2 + e(2, 2) * z2;
    const Block c = nx * x2 + ny * y2 + nz * z2;
    const Block c2 = c * c;
    const Block s2 = nx * nx + ny * ny + nz * nz + mx * mx + my * my + mz * mz - 2.0F * c2;
    return c2 / s2.max(MatchColumns::kTiny);
  }
};

// Half the squared sine between H b1 and b2: the noise of both views counted as if H kept angles. Opposite
// directions pass here and fail in the exact residual.
struct TransferKernel {
  using Block = MatchColumns::Block;
  Eigen::Matrix3f h;
  Block operator()(const Block& x1, const Block& y1, const Block& z1, const Block& x2, const Block& y2,
                   const Block& z2) const {
    const Block px = h(0, 0) * x1 + h(0, 1) * y1 + h(0, 2) * z1;
    const Block py = h(1, 0) * x1 + h(1, 1) * y1 + h(1, 2) * z1;
    const Block pz = h(2, 0) * x1 + h(2, 1) * y1 + h(2, 2) * z1;
    const Block cx = py * z2 - pz * y2, cy = pz * x2 - px * z2, cz = px * y2 - py * x2;
    return 0.5F * (cx * cx + cy * cy + cz * cz) / (px * px + py * py + pz * pz).max(MatchColumns::kTiny);
  }
};

}  // namespace farpoint::slam
