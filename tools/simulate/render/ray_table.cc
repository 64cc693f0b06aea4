// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/ray_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farpoint::tools::simulate {
namespace {

// Up to this angle off the axis one perspective view serves; a wider lens looks into five, like the faces of
// a cube.
constexpr double kMaxSingleView_rad = 62.0 * std::numbers::pi / 180.0;
// Under distortion cells and pixels do not coincide: finer cells keep the outlines sharp.
constexpr double kDistortedDensity = 1.15;

bool is_plain_pinhole(const slam::Camera::Parameters& p) {
  return p.model == slam::CameraModel::kPinholeRadtan &&
         std::all_of(p.distortion.begin(), p.distortion.end(), [](double k) { return k == 0.0; });
}

// Cells coincide with pixels.
RasterView matching_view(const slam::Camera::Parameters& p, const Eigen::Vector2d& jitter_px) {
  RasterView view;
  view.width = p.width_px;
  view.height = p.height_px;
  view.focal_x = static_cast<float>(p.fx_px);
  view.focal_y = static_cast<float>(p.fy_px);
  view.centre_x = static_cast<float>(p.cx_px - jitter_px.x());
  view.centre_y = static_cast<float>(p.cy_px - jitter_px.y());
  return view;
}

// View with the given rotation that holds the directions between the bounds on its plane z = 1.
RasterView bounded_view(const Eigen::Matrix3f& R_view_camera, double focal_px, const Eigen::Vector2d& low,
                        const Eigen::Vector2d& high) {
  constexpr int kMargin = 2;
  RasterView view;
  view.R_view_camera = R_view_camera;
  view.focal_x = view.focal_y = static_cast<float>(focal_px);
  view.centre_x = static_cast<float>(kMargin - focal_px * low.x());
  view.centre_y = static_cast<float>(kMargin - focal_px * low.y());
  view.width = static_cast<int>(std::ceil(focal_px * (high.x() - low.x()))) + 2 * kMargin + 1;
  view.height = static_cast<int>(std::ceil(focal_px * (high.y() - low.y()))) + 2 * kMargin + 1;
  return view;
}

std::vector<Eigen::Matrix3f> cube_rotations() {
  const auto facing = [](const Eigen::Vector3f& z, const Eigen::Vector3f& x) {
    Eigen::Matrix3f R;
    R.row(0) = x.transpose();
    R.row(1) = z.cross(x).transpose();
    R.row(2) = z.transpose();
    return R;
  };
  const Eigen::Vector3f x = Eigen::Vector3f::UnitX(), y = Eigen::Vector3f::UnitY(),
                        z = Eigen::Vector3f::UnitZ();
  return {facing(z, x), facing(x, -z), facing(-x, z), facing(y, x), facing(-y, x)};
}

// The view in whose cone a ray lies: the one whose axis is nearest.
std::size_t view_of(const std::vector<Eigen::Matrix3f>& rotations, const Eigen::Vector3f& ray) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < rotations.size(); ++i) {
    if (rotations[i].row(2).dot(ray) > rotations[best].row(2).dot(ray)) best = i;
  }
  return best;
}

void add_views(const std::vector<Eigen::Matrix3f>& rotations, double focal_px,
               const std::vector<char>& has_ray, RayTable* table) {
  std::vector<Eigen::Vector2d> low(rotations.size(), Eigen::Vector2d::Constant(1e9));
  std::vector<Eigen::Vector2d> high(rotations.size(), Eigen::Vector2d::Constant(-1e9));
  for (std::size_t i = 0; i < has_ray.size(); ++i) {
    if (has_ray[i] == 0) continue;
    const Eigen::Vector3f ray(table->x[i], table->y[i], table->z[i]);
    const std::size_t v = view_of(rotations, ray);
    const Eigen::Vector3f in_view = rotations[v] * ray;
    const Eigen::Vector2d point = (in_view.head<2>() / in_view.z()).cast<double>();
    low[v] = low[v].cwiseMin(point);
    high[v] = high[v].cwiseMax(point);
  }
  for (std::size_t v = 0; v < rotations.size(); ++v) {
    if (low[v].x() > high[v].x()) {  // nothing looks there
      low[v] = high[v] = Eigen::Vector2d::Zero();
    }
    table->views.push_back(bounded_view(rotations[v], focal_px, low[v], high[v]));
  }
}

void assign_cells(const std::vector<Eigen::Matrix3f>& rotations, const std::vector<char>& has_ray,
                  RayTable* table) {
  for (std::size_t i = 0; i < has_ray.size(); ++i) {
    if (has_ray[i] == 0) {
      table->cell[i] = RayTable::kNoCell;
      continue;
    }
    const Eigen::Vector3f ray(table->x[i], table->y[i], table->z[i]);
    const RasterView& view = table->views[view_of(rotations, ray)];
    const Eigen::Vector3f p = view.R_view_camera * ray;
    const int x = static_cast<int>(std::lround(view.focal_x * p.x() / p.z() + view.centre_x));
    const int y = static_cast<int>(std::lround(view.focal_y * p.y() / p.z() + view.centre_y));
    table->cell[i] = static_cast<std::int32_t>(view.first_cell) +
                     std::clamp(y, 0, view.height - 1) * view.width + std::clamp(x, 0, view.width - 1);
  }
}

}  // namespace

RayTable make_ray_table(const slam::Camera& camera, const Eigen::Vector2d& jitter_px) {
  constexpr std::size_t kRoomForVectors = 16;
  const slam::Camera::Parameters& p = camera.parameters();
  const auto pixels = static_cast<std::size_t>(p.width_px) * static_cast<std::size_t>(p.height_px);
  RayTable table;
  table.x.assign(pixels + kRoomForVectors, 0.0F);
  table.y = table.x;
  table.z.assign(pixels + kRoomForVectors, 1.0F);
  table.cell.assign(pixels, 0);
  std::vector<char> has_ray(pixels, 1);
  double max_theta = 0.0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto row = i / static_cast<std::size_t>(p.width_px);
    const auto column = i % static_cast<std::size_t>(p.width_px);
    const Eigen::Vector2d pixel(static_cast<double>(column) + jitter_px.x(),
                                static_cast<double>(row) + jitter_px.y());
    Eigen::Vector3d ray;
    has_ray[i] = camera.unproject(pixel, &ray) ? 1 : 0;
    if (has_ray[i] == 0) continue;
    max_theta = std::max(max_theta, std::acos(std::clamp(ray.z(), -1.0, 1.0)));
    table.x[i] = static_cast<float>(ray.x());
    table.y[i] = static_cast<float>(ray.y());
    table.z[i] = static_cast<float>(ray.z());
  }
  if (is_plain_pinhole(p) && max_theta < kMaxSingleView_rad) {
    table.views.push_back(matching_view(p, jitter_px));
    for (std::size_t i = 0; i < pixels; ++i) table.cell[i] = static_cast<std::int32_t>(i);
  } else {
    const std::vector<Eigen::Matrix3f> rotations =
        max_theta < kMaxSingleView_rad ? std::vector<Eigen::Matrix3f>{Eigen::Matrix3f::Identity()}
                                       : cube_rotations();
    add_views(rotations, kDistortedDensity * camera.focal_px(), has_ray, &table);
    std::uint32_t first = 0;
    for (RasterView& view : table.views) {
      view.first_cell = first;
      first += static_cast<std::uint32_t>(view.width * view.height);
    }
    assign_cells(rotations, has_ray, &table);
  }
  const RasterView& last = table.views.back();
  table.cells = last.first_cell + static_cast<std::uint32_t>(last.width * last.height);
  return table;
}

std::vector<RayTable::Rows> RayTable::rows_of_band(int first_row, int last_row, int image_width) const {
  std::vector<Rows> rows(views.size(), Rows{1 << 30, 0});
  for (std::size_t i = static_cast<std::size_t>(first_row * image_width);
       i < static_cast<std::size_t>(last_row * image_width); ++i) {
    if (cell[i] == kNoCell) continue;
    std::size_t v = views.size() - 1;
    while (views[v].first_cell > static_cast<std::uint32_t>(cell[i])) --v;
    const int row = (cell[i] - static_cast<int>(views[v].first_cell)) / views[v].width;
    rows[v].first = std::min(rows[v].first, row);
    rows[v].last = std::max(rows[v].last, row + 1);
  }
  return rows;
}

}  // namespace farpoint::tools::simulate
