// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "tools/simulate/render/occlusion.h"
#include "tools/simulate/render/ray_table.h"
#include "tools/simulate/render/ready_face.h"
#include "tools/simulate/render/span_kernels.h"
#include "tools/simulate/render/visible_faces.h"

namespace farpoint::tools::simulate {
namespace {

constexpr int kJitters = 4;
// Places of the passes within a pixel, in quarters of the blur: each in another quarter along both axes (the
// rotated grid), mean zero.
constexpr double kJitterX[kJitters] = {-0.125, 0.375, -0.375, 0.125};
constexpr double kJitterY[kJitters] = {-0.375, -0.125, 0.125, 0.375};
// Times of the passes within the exposure, in an order of their own, so that place and time are independent.
constexpr int kTimeOrder[kJitters] = {2, 0, 3, 1};

constexpr int kBandRows = 4;  // rolling shutter: rows that share a pose
constexpr float kNear_m = 0.05F;
constexpr float kPassAnisotropy = 3.0F;
constexpr int kBlock = 16;  // pixels that share a mip level

// log2 to 0.09, which is enough for a mip level; no library call in the inner loop.
float rough_log2(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return static_cast<float>(static_cast<int>(bits >> 23) - 127) +
         static_cast<float>(bits & 0x7fffff) * 0x1p-23F;
}

// Smallest whole number >= x, for |x| < 2^30.
int ceil_to_int(float x) {
  const int i = static_cast<int>(x);
  return i + (static_cast<float>(i) < x ? 1 : 0);
}

// Pose of the camera in one pass and band, relative to the frame's reference position.
struct PassPose {
  Eigen::Matrix3f R_camera_world;
  Eigen::Vector3f position;  // world axes, from the reference
  double time_s = 0;
};

struct PixelRect {
  int first_row = 0, last_row = 0;
};

}  // namespace

class Renderer::Impl {
 public:
  Impl(const slam::Camera& camera, const RendererOptions& options)
      : options_(options),
        focal_px_(static_cast<float>(camera.focal_px())),
        width_(camera.width_px()),
        height_(camera.height_px()) {
    for (int i = 0; i < kJitters; ++i) {
      tables_.push_back(make_ray_table(camera, options.blur_px * Eigen::Vector2d(kJitterX[i], kJitterY[i])));
    }
    std::uint32_t cells = 0;
    for (const RayTable& table : tables_) cells = std::max(cells, table.cells);
    inverse_depth_.resize(cells + kBlock);
    face_of_cell_.resize(cells + kBlock);
    radiance_.resize(static_cast<std::size_t>(width_ * height_) + kBlock);
  }

  const std::vector<float>& render(const Scene& scene, const CameraPath& path, const Shutter& shutter) {
    start_frame(scene, path, shutter);
    std::fill(radiance_.begin(), radiance_.end(), 0.0F);
    const int passes = passes_for(path, shutter);
    const float weight = 1.0F / static_cast<float>(passes);
    for (int i = 0; i < passes; ++i) {
      table_ = &tables_[static_cast<std::size_t>(i % kJitters)];
      const int rounds = passes / kJitters;
      const int slot = kTimeOrder[i % kJitters] * rounds + i / kJitters;
      const double offset_s = shutter.exposure_s * ((slot + 0.5) / passes - 0.5);
      dither_ = (static_cast<float>(kTimeOrder[(i + 1) % kJitters]) + 0.5F) / kJitters - 0.5F;
      cutout_threshold_ = 128 + static_cast<int>(96.0F * dither_);
      for (const PixelRect& band : bands_) {
        draw_band(scene, path, shutter, band, offset_s);
        for (int row = band.first_row; row < band.last_row; ++row) shade_row(row, weight);
      }
    }
    return radiance_;
  }

  std::vector<SeenPoint> look(const Scene& scene, const CameraPath& path, const Shutter& shutter,
                              const std::vector<Eigen::Vector2d>& pixels, int radius_px,
                              const slam::Camera& camera) {
    start_frame(scene, path, shutter);
    if (!centre_table_) {
      centre_table_ = std::make_unique<RayTable>(make_ray_table(camera, Eigen::Vector2d::Zero()));
      if (inverse_depth_.size() < centre_table_->cells + kBlock) {
        inverse_depth_.resize(centre_table_->cells + kBlock);
        face_of_cell_.resize(centre_table_->cells + kBlock);
      }
    }
    table_ = centre_table_.get();
    cutout_threshold_ = 128;
    dither_ = 0.0F;
    std::vector<SeenPoint> seen(pixels.size());
    for (const PixelRect& band : bands_) {
      const auto in_band = [&](const Eigen::Vector2d& p) {
        const long row = std::clamp(std::lround(p.y()), 0L, static_cast<long>(height_) - 1);
        return row >= band.first_row && row < band.last_row;
      };
      if (std::none_of(pixels.begin(), pixels.end(), in_band)) continue;
      draw_band(scene, path, shutter, band, 0.0);
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (in_band(pixels[i])) seen[i] = look_at(camera, pixels[i], radius_px, band);
      }
    }
    return seen;
  }

 private:
  // ---- the frame ----

  void start_frame(const Scene& scene, const CameraPath& path, const Shutter& shutter) {
    prepare_materials(*scene.materials);
    const slam::SE3 middle = path(shutter.mid_s);
    const double half_s = 0.5 * (shutter.exposure_s + std::abs(shutter.row_time_s) * height_);
    const slam::SE3 first = path(shutter.mid_s - half_s), last = path(shutter.mid_s + half_s);
    const double margin_rad = std::max(middle.q.angularDistance(first.q), middle.q.angularDistance(last.q));
    const ViewBounds bounds = make_view_bounds(tables_[0], middle, focal_px_, margin_rad);
    visible_.gather(scene, bounds, middle.t, shutter.mid_s);
    if (ready_.size() < visible_.faces().size() + 1) ready_.resize(visible_.faces().size() + 1);
    bands_.clear();
    const int rows = shutter.row_time_s == 0.0 ? height_ : kBandRows;
    for (int row = 0; row < height_; row += rows) bands_.push_back({row, std::min(row + rows, height_)});
    scene_ = &scene;
  }

  // Four passes blur over four pixels without gaps; what moves further gets more.
  int passes_for(const CameraPath& path, const Shutter& shutter) const {
    if (shutter.exposure_s <= 0.0) return options_.passes;
    const slam::SE3 first = path(shutter.mid_s - 0.5 * shutter.exposure_s);
    const slam::SE3 last = path(shutter.mid_s + 0.5 * shutter.exposure_s);
    const double blur_px = focal_px_ * first.q.angularDistance(last.q);
    const int rounds = std::clamp(static_cast<int>(std::ceil(blur_px / 5.0)), 1, 4);
    return options_.passes * rounds;
  }

  void prepare_materials(const std::vector<Material>& materials) {
    for (std::size_t i = material_layers_.size(); i < materials.size(); ++i) {
      std::vector<LayerInfo> layers;
      for (const Layer& layer : materials[i].layers) {
        layers.push_back(layer_info(*layer.texture, layer.period_s_m, layer.period_t_m, layer.gain));
      }
      material_layers_.push_back(std::move(layers));
    }
  }

  // ---- drawing: which face is seen in each cell ----

  void draw_band(const Scene& scene, const CameraPath& path, const Shutter& shutter, const PixelRect& band,
                 double offset_s) {
    ++stamp_;
    const double row_s =
        shutter.row_time_s * (0.5 * (band.first_row + band.last_row - 1) - 0.5 * (height_ - 1));
    pose_.time_s = shutter.mid_s + row_s + offset_s;
    const slam::SE3 T_world_camera = path(pose_.time_s);
    pose_.R_camera_world = T_world_camera.rotation().transpose().cast<float>();
    pose_.position = (T_world_camera.t - visible_.reference()).cast<float>();
    visible_.move_objects(scene, pose_.time_s);
    sway_direction_ = scene.sway_direction.cast<float>();

    const bool whole = bands_.size() == 1;
    const std::vector<RayTable::Rows> rows =
        whole ? std::vector<RayTable::Rows>(table_->views.size(), {0, 1 << 30})
              : table_->rows_of_band(band.first_row, band.last_row, width_);
    for (std::size_t v = 0; v < table_->views.size(); ++v) {
      view_ = &table_->views[v];
      first_row_ = std::max(rows[v].first, 0);
      last_row_ = std::min(rows[v].last, view_->height);
      if (first_row_ >= last_row_) continue;
      clear_rows();
      R_view_world_ = view_->R_view_camera * pose_.R_camera_world;
      draw_faces();
    }
  }

  void draw_faces() {
    // What moves first: it may hide what stands.
    for (std::size_t i = visible_.first_moving(); i < visible_.faces().size(); ++i) draw_face(i);
    for (const VisibleGroup& group : visible_.groups()) {
      const Eigen::Vector3f centre = R_view_world_ * (group.centre - pose_.position);
      if (is_hidden(centre, group.radius_m, *view_, first_row_, last_row_, inverse_depth_.data())) continue;
      for (std::size_t i = group.first; i < group.last; ++i) draw_face(i);
    }
  }

  void clear_rows() {
    const auto begin =
        static_cast<std::ptrdiff_t>(view_->first_cell) + std::ptrdiff_t{first_row_} * view_->width;
    const auto end =
        static_cast<std::ptrdiff_t>(view_->first_cell) + std::ptrdiff_t{last_row_} * view_->width;
    std::fill(inverse_depth_.begin() + begin, inverse_depth_.begin() + end, 0.0F);
    std::fill(face_of_cell_.begin() + begin, face_of_cell_.begin() + end, 0U);
  }

  // The face's origin relative to the camera, world axes.
  [[nodiscard]] Eigen::Vector3f offset_of(const VisibleFace& visible) const {
    Eigen::Vector3f offset = visible.offset - pose_.position;
    if (visible.sway_m > 0.0F) {
      offset +=
          static_cast<float>(sway_at(pose_.time_s, visible.sway_phase)) * visible.sway_m * sway_direction_;
    }
    return offset;
  }

  void draw_face(std::size_t index) {
    const VisibleFace& visible = visible_.faces()[index];
    const Face& face = *visible.face;
    const Eigen::Vector3f offset = offset_of(visible);
    const float height = face.normal.dot(face.corners[0] + offset);  // negative: seen from its front
    if (height >= 0.0F && !face.two_sided) return;
    std::array<Eigen::Vector3f, Face::kMaxCorners> corners;
    bool crosses_near = false, in_front = false;
    for (int i = 0; i < face.count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      corners[k] = R_view_world_ * (face.corners[k] + offset);
      (corners[k].z() < kNear_m ? crosses_near : in_front) = true;
    }
    if (!in_front) return;
    std::array<Eigen::Vector2f, 2 * Face::kMaxCorners> outline;
    const int n = crosses_near ? clip_and_project(corners, face.count, &outline)
                               : project(corners, face.count, &outline);
    // Inverse depth over the view: den . (x, y, 1) / plane.
    const float sign = height < 0.0F ? -1.0F : 1.0F;
    const float plane = sign * height;
    if (plane < 1e-5F) return;
    const Eigen::Vector3f den = sign / plane * (R_view_world_ * face.normal);
    const float per_x = den.x() / view_->focal_x, per_y = den.y() / view_->focal_y;
    const float at_zero = den.z() - per_x * view_->centre_x - per_y * view_->centre_y;
    fill_outline(outline, n, index, per_x, per_y, at_zero);
  }

  [[nodiscard]] Eigen::Vector2f projected(const Eigen::Vector3f& p) const {
    const float inverse = 1.0F / p.z();
    return {view_->focal_x * p.x() * inverse + view_->centre_x,
            view_->focal_y * p.y() * inverse + view_->centre_y};
  }

  int project(const std::array<Eigen::Vector3f, Face::kMaxCorners>& corners, int count,
              std::array<Eigen::Vector2f, 2 * Face::kMaxCorners>* outline) const {
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) (*outline)[i] = projected(corners[i]);
    return count;
  }

  int clip_and_project(const std::array<Eigen::Vector3f, Face::kMaxCorners>& corners, int count,
                       std::array<Eigen::Vector2f, 2 * Face::kMaxCorners>* outline) const {
    std::size_t n = 0;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3f& a = corners[static_cast<std::size_t>(i)];
      const Eigen::Vector3f& b = corners[static_cast<std::size_t>((i + 1) % count)];
      if (a.z() >= kNear_m) (*outline)[n++] = projected(a);
      if ((a.z() >= kNear_m) == (b.z() >= kNear_m)) continue;
      Eigen::Vector3f cut = a + (kNear_m - a.z()) / (b.z() - a.z()) * (b - a);
      cut.z() = kNear_m;
      (*outline)[n++] = projected(cut);
    }
    return static_cast<int>(n);
  }

  // Rows between the outline's edges. A cell belongs to the face where its centre does; an edge that two
  // faces share is computed from its upper end in both, so that no cell is lost or drawn twice.
  void fill_outline(const std::array<Eigen::Vector2f, 2 * Face::kMaxCorners>& outline, int n,
                    std::size_t index, float per_x, float per_y, float at_zero) {
    float low_y = outline[0].y(), high_y = low_y, low_x = outline[0].x(), high_x = low_x, area = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      const Eigen::Vector2f& a = outline[i];
      const Eigen::Vector2f& b = outline[(i + 1) % static_cast<std::size_t>(n)];
      low_y = std::min(low_y, a.y());
      high_y = std::max(high_y, a.y());
      low_x = std::min(low_x, a.x());
      high_x = std::max(high_x, a.x());
      area += a.x() * b.y() - a.y() * b.x();
    }
    const float width = static_cast<float>(view_->width);
    if (!(high_y >= static_cast<float>(first_row_)) || !(low_y <= static_cast<float>(last_row_ - 1))) return;
    if (!(high_x >= 0.0F) || !(low_x <= width - 1.0F)) return;
    const int first = std::max(first_row_, ceil_to_int(std::max(low_y, -1.0F)));
    const int last = std::min(last_row_, ceil_to_int(std::min(high_y, 1e6F)));
    if (first >= last) return;
    if (edge_left_.size() < static_cast<std::size_t>(view_->height)) {
      edge_left_.resize(static_cast<std::size_t>(view_->height));
      edge_right_.resize(static_cast<std::size_t>(view_->height));
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      const Eigen::Vector2f& a = outline[i];
      const Eigen::Vector2f& b = outline[(i + 1) % static_cast<std::size_t>(n)];
      const bool down =
          b.y() > a.y();  // with area > 0 (clockwise on the screen) downward edges are right ones
      trace_edge(down ? a : b, down ? b : a, first, last, down == (area > 0) ? &edge_right_ : &edge_left_);
    }
    const VisibleFace& visible = visible_.faces()[index];
    const Material& material = (*scene_->materials)[visible.face->material];
    const CutoutMap cutout = cutout_map(material, index);
    for (int row = first; row < last; ++row) {
      const float left = edge_left_[static_cast<std::size_t>(row)];
      const float right = edge_right_[static_cast<std::size_t>(row)];
      const int begin = ceil_to_int(std::clamp(left, 0.0F, width));
      const int end = ceil_to_int(std::clamp(right, 0.0F, width));
      if (begin >= end) continue;
      const std::size_t cell = view_->first_cell +
                               static_cast<std::size_t>(row) * static_cast<std::size_t>(view_->width) +
                               static_cast<std::size_t>(begin);
      const float start = at_zero + per_y * static_cast<float>(row) + per_x * static_cast<float>(begin);
      if (cutout.texture != nullptr) {
        fill_cutout(cutout, index, start, per_x, begin, end, row, cell);
      } else {
        kernels_.fill(start, per_x, static_cast<std::uint32_t>(index) + 1, end - begin, &inverse_depth_[cell],
                      &face_of_cell_[cell]);
      }
    }
  }

  static void trace_edge(const Eigen::Vector2f& top, const Eigen::Vector2f& bottom, int first, int last,
                         std::vector<float>* edge) {
    const float height = bottom.y() - top.y();
    if (!(height > 0.0F)) return;
    const int begin = std::max(first, ceil_to_int(std::clamp(top.y(), -1.0F, 1e6F)));
    const int end = std::min(last, ceil_to_int(std::clamp(bottom.y(), -1.0F, 1e6F)));
    const float slope = (bottom.x() - top.x()) / height;
    for (int row = begin; row < end; ++row) {
      (*edge)[static_cast<std::size_t>(row)] = top.x() + (static_cast<float>(row) - top.y()) * slope;
    }
  }

  // Where the rows of a face with holes take their texture coordinates from, in view axes.
  struct CutoutMap {
    const Texture* texture = nullptr;
    Eigen::Vector3f u_num, v_num, den;
    float log2_density = 0;
  };

  CutoutMap cutout_map(const Material& material, std::size_t index) {
    CutoutMap map;
    map.texture = material.cutout;
    if (map.texture == nullptr) return map;
    const ReadyFace& ready = ready_face(index);
    map.u_num = view_->R_view_camera * Eigen::Map<const Eigen::Vector3f>(ready.shade.layer[0].u_num);
    map.v_num = view_->R_view_camera * Eigen::Map<const Eigen::Vector3f>(ready.shade.layer[0].v_num);
    map.den = view_->R_view_camera * Eigen::Map<const Eigen::Vector3f>(ready.shade.den);
    map.log2_density = ready.info[0].log2_density;
    return map;
  }

  // Foliage and the like: cells where the texture has a hole show what is behind.
  void fill_cutout(const CutoutMap& map, std::size_t index, float start, float slope, int begin, int end,
                   int row, std::size_t cell) {
    const float y = (static_cast<float>(row) - view_->centre_y) / view_->focal_y;
    const float per_x = 1.0F / view_->focal_x, x0 = (static_cast<float>(begin) - view_->centre_x) * per_x;
    const float pixel_m = per_x / std::max(start, 1e-6F);
    const float level_size = rough_log2(pixel_m) + map.log2_density + dither_;
    const int level = std::clamp(static_cast<int>(level_size), 0, map.texture->levels() - 1);
    const TextureLevel& texels = map.texture->level(level);
    const auto width = static_cast<float>(texels.width), height = static_cast<float>(texels.height);
    CutoutRow cutout{};
    cutout.inverse_depth = start;
    cutout.d_inverse_depth = slope;
    cutout.u = (map.u_num.x() * x0 + map.u_num.y() * y + map.u_num.z()) * width;
    cutout.du = map.u_num.x() * per_x * width;
    cutout.v = (map.v_num.x() * x0 + map.v_num.y() * y + map.v_num.z()) * height;
    cutout.dv = map.v_num.x() * per_x * height;
    cutout.den = map.den.x() * x0 + map.den.y() * y + map.den.z();
    cutout.d_den = map.den.x() * per_x;
    cutout.texels = texels.texels.data();
    cutout.mask_x = texels.width - 1;
    cutout.mask_y = texels.height - 1;
    cutout.stride = texels.stride;
    cutout.threshold = cutout_threshold_;
    kernels_.fill_cutout(cutout, static_cast<std::uint32_t>(index) + 1, end - begin, &inverse_depth_[cell],
                         &face_of_cell_[cell]);
  }

  // ---- shading: what light comes along each ray ----

  ReadyFace& ready_face(std::size_t index) {
    ReadyFace& ready = ready_[index + 1];
    if (ready.stamp != stamp_) {
      prepare_face(visible_.faces()[index], &ready);
      ready.stamp = stamp_;
    }
    return ready;
  }

  void prepare_face(const VisibleFace& visible, ReadyFace* ready) const {
    const Face& face = *visible.face;
    const Eigen::Vector3f offset = offset_of(visible);
    const float height = face.normal.dot(face.corners[0] + offset);
    const float sign = height < 0.0F ? -1.0F : 1.0F;
    ready->shade.plane_m = sign * height;
    ready->brightness = face.brightness;
    ready->shade.min_den = 1e-7F;
    set_air(static_cast<float>(1.0 / scene_->visibility_m), &ready->shade);
    const Eigen::Vector3f den = sign * (pose_.R_camera_world * face.normal);
    Eigen::Map<Eigen::Vector3f>(ready->shade.den) = den;
    ready->layers = 0;
    for (const LayerInfo& info : material_layers_[face.material]) {
      add_layer(info, pose_.R_camera_world * face.s_axis, face.s0 - face.s_axis.dot(offset),
                pose_.R_camera_world * face.t_axis, face.t0 - face.t_axis.dot(offset), ready);
    }
    if (!face.lit_by_map || visible.chunk == nullptr || visible.chunk->light_map == nullptr) return;
    const double size = visible.chunk->size_m;
    add_layer(layer_info(*visible.chunk->light_map, size, size, 1.0 / 255.0), pose_.R_camera_world.col(0),
              -offset.x(), pose_.R_camera_world.col(1), -offset.y(), ready);
  }

  void set_air(float haze_per_m, ShadeFace* shade) const {
    shade->haze_per_m = haze_per_m;
    shade->haze_radiance = static_cast<float>(scene_->haze_radiance);
  }

  // The sky is a plane above: clouds in it, haze towards the horizon.
  void prepare_sky(ReadyFace* ready) const {
    const Sky& sky = scene_->sky;
    const Eigen::Vector3d camera = visible_.reference() + pose_.position.cast<double>();
    const double height = std::max(sky.height_m - camera.z(), 100.0);
    const Eigen::Vector2d drift = sky.wind_mps * pose_.time_s;
    ready->shade.plane_m = static_cast<float>(height);
    ready->brightness = static_cast<float>(sky.radiance);
    ready->shade.min_den = 0.012F;
    set_air(static_cast<float>(0.4 / 15000.0), &ready->shade);
    Eigen::Map<Eigen::Vector3f>(ready->shade.den) = pose_.R_camera_world.col(2);
    ready->layers = 0;
    const std::pair<const Texture*, double> layers[] = {{sky.clouds, sky.period_m},
                                                        {sky.cloud_detail, sky.detail_period_m}};
    for (const auto& [texture, period] : layers) {
      const double gain = texture == sky.clouds ? 1.0 / 255.0 : 1.0 / texture->mean();
      // Before single precision: drift and place may be large.
      const double s = std::fmod(camera.x() - drift.x(), period),
                   t = std::fmod(camera.y() - drift.y(), period);
      add_layer(layer_info(*texture, period, period, gain), pose_.R_camera_world.col(0),
                static_cast<float>(s), pose_.R_camera_world.col(1), static_cast<float>(t), ready);
    }
  }

  ReadyFace& ready_face_of_cell(std::uint32_t id) {
    if (id > 0) return ready_face(id - 1);
    if (ready_[0].stamp != stamp_) {
      prepare_sky(&ready_[0]);
      ready_[0].stamp = stamp_;
    }
    return ready_[0];
  }

  void shade_row(int row, float weight) {
    const std::size_t start = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    const std::int32_t* cells = &table_->cell[start];
    const auto face_at = [&](int x) -> std::uint32_t {
      return cells[x] == RayTable::kNoCell ? 0 : face_of_cell_[static_cast<std::size_t>(cells[x])];
    };
    for (int x = 0; x < width_;) {
      if (cells[x] == RayTable::kNoCell) {
        ++x;  // no light
        continue;
      }
      const std::uint32_t id = face_at(x);
      int end = x + 1;
      while (end < width_ && end < x + kBlock && cells[end] != RayTable::kNoCell && face_at(end) == id) ++end;
      ReadyFace& ready = ready_face_of_cell(id);
      const std::size_t at = start + static_cast<std::size_t>(x);
      choose_levels(footprint_log2(ready.shade, at + static_cast<std::size_t>((end - x) / 2), row), &ready);
      kernels_.shade(ready.shade, {&table_->x[at], &table_->y[at], &table_->z[at]}, end - x, weight,
                     &radiance_[at]);
      x = end;
    }
  }

  [[nodiscard]] Eigen::Vector3f ray(std::size_t i) const {
    return {table_->x[i], table_->y[i], table_->z[i]};
  }

  // log2 of the size in metres of a pixel on the face: of its longer axis, as far as the passes' own spacing
  // does not cover it, but no less than of the shorter.
  [[nodiscard]] float footprint_log2(const ShadeFace& shade, std::size_t pixel, int row) const {
    const Eigen::Map<const Eigen::Vector3f> den(shade.den);
    const auto width = static_cast<std::size_t>(width_);
    const Eigen::Vector3f here = ray(pixel);
    const Eigen::Vector3f along_x = ray(pixel + 1 < table_->cell.size() ? pixel + 1 : pixel - 1) - here;
    const Eigen::Vector3f along_y = ray(row + 1 < height_ ? pixel + width : pixel - width) - here;
    const float d = std::max(den.dot(here), shade.min_den);
    const float distance = shade.plane_m / d;
    const float x2 = (along_x - here * (den.dot(along_x) / d)).squaredNorm();
    const float y2 = (along_y - here * (den.dot(along_y) / d)).squaredNorm();
    const float size2 = std::max(std::max(x2, y2) / (kPassAnisotropy * kPassAnisotropy), std::min(x2, y2));
    return 0.5F * rough_log2(size2 * distance * distance + 1e-12F);
  }

  void choose_levels(float pixel_log2_m, ReadyFace* ready) const {
    ShadeFace& shade = ready->shade;
    shade.brightness = ready->brightness;
    std::array<int, ShadeFace::kMaxLayers> levels{};
    shade.layers = 0;
    for (int i = 0; i < ready->layers; ++i) {
      const LayerInfo& info = ready->info[static_cast<std::size_t>(i)];
      // Each pass covers less than a pixel: half a level finer than a single pass could bear.
      const float wanted = pixel_log2_m + info.log2_density + dither_;
      const int coarsest = info.texture->levels() - 1;
      levels[static_cast<std::size_t>(i)] = std::clamp(ceil_to_int(wanted - 0.5F), 0, coarsest);
      if (i == 0 || levels[static_cast<std::size_t>(i)] < coarsest - 1) shade.layers = i + 1;
    }
    for (int i = shade.layers; i < ready->layers; ++i) {  // of these nothing is left but their mean
      const LayerInfo& info = ready->info[static_cast<std::size_t>(i)];
      shade.brightness *= info.gain * static_cast<float>(info.texture->mean());
    }
    for (int i = 0; i < shade.layers; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const TextureLevel& texels = ready->info[k].texture->level(levels[k]);
      ShadeLayer& layer = shade.layer[i];
      layer.texels = texels.texels.data();
      layer.width = static_cast<float>(texels.width);
      layer.height = static_cast<float>(texels.height);
      layer.mask_x = texels.width - 1;
      layer.mask_y = texels.height - 1;
      layer.stride = texels.stride;
    }
  }

  // ---- truth ----

  SeenPoint look_at(const slam::Camera& camera, const Eigen::Vector2d& pixel, int radius_px,
                    const PixelRect& band) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    SeenPoint seen{kFar, false, kFar, kFar};
    const int column =
        static_cast<int>(std::clamp(std::lround(pixel.x()), 0L, static_cast<long>(width_) - 1));
    const int row = static_cast<int>(std::clamp(std::lround(pixel.y()), 0L, static_cast<long>(height_) - 1));
    Eigen::Vector3d exact;
    if (!camera.unproject(pixel, &exact)) return seen;
    seen.distance_m = distance_in(column, row, exact.cast<float>(), &seen.is_moving);
    seen.nearest_m = seen.farthest_m = seen.distance_m;
    for (int y = std::max(row - radius_px, band.first_row); y <= std::min(row + radius_px, band.last_row - 1);
         ++y) {
      for (int x = std::max(column - radius_px, 0); x <= std::min(column + radius_px, width_ - 1); ++x) {
        bool moving = false;
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
        const double distance = distance_in(x, y, ray(i), &moving);
        seen.nearest_m = std::min(seen.nearest_m, distance);
        seen.farthest_m = std::max(seen.farthest_m, distance);
      }
    }
    return seen;
  }

  // Distance along a ray to the face seen in a pixel.
  double distance_in(int column, int row, const Eigen::Vector3f& unit_ray, bool* moving) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const std::int32_t cell = table_->cell[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                                           static_cast<std::size_t>(column)];
    const std::uint32_t id = cell == RayTable::kNoCell ? 0 : face_of_cell_[static_cast<std::size_t>(cell)];
    if (id == 0) return kFar;
    *moving = id - 1 >= visible_.first_moving();
    const ShadeFace& shade = ready_face(id - 1).shade;
    const float den = Eigen::Map<const Eigen::Vector3f>(shade.den).dot(unit_ray);
    return den > 1e-7F ? static_cast<double>(shade.plane_m / den) : kFar;
  }

  RendererOptions options_;
  float focal_px_;
  int width_, height_;
  std::vector<RayTable> tables_;
  std::unique_ptr<RayTable> centre_table_;
  const SpanKernels& kernels_ = span_kernels();

  // Of the frame:
  const Scene* scene_ = nullptr;
  VisibleFaces visible_;
  std::vector<PixelRect> bands_;
  std::vector<std::vector<LayerInfo>> material_layers_;
  std::vector<float> radiance_;
  // Of the pass and band:
  const RayTable* table_ = nullptr;
  PassPose pose_;
  Eigen::Vector3f sway_direction_;
  float dither_ = 0;
  int cutout_threshold_ = 128;
  std::uint32_t stamp_ = 0;
  std::vector<ReadyFace> ready_;  // [0]: the sky
  std::vector<float> inverse_depth_;
  std::vector<std::uint32_t> face_of_cell_;  // 0: sky, else index of the visible face + 1
  // Of the view being drawn:
  const RasterView* view_ = nullptr;
  Eigen::Matrix3f R_view_world_;
  int first_row_ = 0, last_row_ = 0;
  std::vector<float> edge_left_, edge_right_;
};

double sway_at(double time_s, double phase) {
  // Two swings that do not repeat together.
  return 0.7 * std::sin(2.0 * time_s + phase) + 0.3 * std::sin(4.7 * time_s + 2.3 * phase);
}

Renderer::Renderer(const slam::Camera& camera, const RendererOptions& options)
    : camera_(camera), impl_(std::make_unique<Impl>(camera, options)) {}
Renderer::~Renderer() = default;

const std::vector<float>& Renderer::render(const Scene& scene, const CameraPath& path,
                                           const Shutter& shutter) {
  return impl_->render(scene, path, shutter);
}

std::vector<SeenPoint> Renderer::look(const Scene& scene, const CameraPath& path, const Shutter& shutter,
                                      const std::vector<Eigen::Vector2d>& pixels, int radius_px) {
  return impl_->look(scene, path, shutter, pixels, radius_px, camera_);
}

}  // namespace farpoint::tools::simulate
