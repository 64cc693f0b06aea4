// SPDX-License-Identifier: Apache-2.0
// The renderer on scenes so simple that the right picture is known.
#include <gtest/gtest.h>

#include <cmath>

#include "slam/geometry/rig.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/span_kernels.h"
#include "tools/simulate/sensors/camera_sensor.h"
#include "tools/simulate/world/noise.h"

namespace farpoint::tools::simulate {
namespace {

// A wall at x = 10 m, 40 m wide, that a camera at the origin looks at; a smaller one, black, may stand before
// it.
class WallScene : public testing::Test {
 protected:
  WallScene()
      : smooth_(256, 256,
                [](double u, double v) {
                  return 0.5 + 0.2 * std::sin(2 * M_PI * u) + 0.2 * std::cos(2 * M_PI * v);
                }),
        grey_(8, 8, [](double, double) { return 0.5; }),
        black_(8, 8, [](double, double) { return 0.0; }) {
    for (const Texture* texture : {&smooth_, &grey_, &black_}) {
      Material material;
      material.layers = {{texture, 4.0, 4.0, 1.0 / 255.0}};
      materials_.push_back(material);
    }
    MeshBuilder builder(&chunk_.mesh, Eigen::Vector3d(-1, 0, 0), 1.0);
    builder.begin_cluster();
    MeshBuilder::Paint paint;
    paint.fixed_light = 1.0;
    builder.quad({10, 20, -20}, {10, -20, -20}, {10, -20, 20}, {10, 20, 20}, paint);
    builder.end_cluster();
    scene_.materials = &materials_;
    scene_.chunks = {&chunk_};
    scene_.sky.clouds = &grey_;
    scene_.sky.cloud_detail = &grey_;
    scene_.visibility_m = 1e9;
  }

  void add_black_wall(double distance_m, double right_m, double left_m) {
    MeshBuilder builder(&chunk_.mesh, Eigen::Vector3d(-1, 0, 0), 1.0);
    builder.begin_cluster();
    MeshBuilder::Paint paint;
    paint.fixed_light = 1.0;
    paint.material = 2;
    builder.quad({distance_m, left_m, -20}, {distance_m, right_m, -20}, {distance_m, right_m, 20},
                 {distance_m, left_m, 20}, paint);
    builder.end_cluster();
  }

  // Looks along world x.
  static slam::SE3 forward(const Eigen::Vector3d& position) {
    return {slam::q_body_forward_camera(), position};
  }
  static slam::Camera camera(slam::CameraModel model, const std::array<double, 5>& distortion) {
    slam::Camera::Parameters p;
    p.model = model;
    p.width_px = 160;
    p.height_px = 120;
    p.fx_px = p.fy_px = 100;
    p.cx_px = 78;
    p.cy_px = 61;
    p.distortion = distortion;
    return slam::Camera(p);
  }

  Texture smooth_, grey_, black_;
  std::vector<Material> materials_;
  Chunk chunk_;
  Scene scene_;
};

void expect_texture(Renderer* renderer, const slam::Camera& camera, const Scene& scene,
                    const slam::SE3& T_world_camera) {
  const std::vector<float>& picture = renderer->render(scene, [&](double) { return T_world_camera; }, {});
  for (int y = 3; y < camera.height_px(); y += 7) {
    for (int x = 3; x < camera.width_px(); x += 7) {
      Eigen::Vector3d ray;
      ASSERT_TRUE(camera.unproject(Eigen::Vector2d(x, y), &ray));
      const Eigen::Vector3d direction = T_world_camera.q * ray;
      const Eigen::Vector3d p = T_world_camera.t + (10.0 - T_world_camera.t.x()) / direction.x() * direction;
      const double u = (20.0 - p.y()) / 4.0, v = (p.z() + 20.0) / 4.0;
      const double expected = 0.5 + 0.2 * std::sin(2 * M_PI * u) + 0.2 * std::cos(2 * M_PI * v);
      EXPECT_NEAR(picture[static_cast<std::size_t>(y * camera.width_px() + x)], expected, 0.02)
          << x << " " << y;
    }
  }
}

TEST_F(WallScene, TexturesLieWhereTheLensPutsThem) {
  const slam::SE3 pose{forward({1.0, 0.3, -0.2}).q * slam::so3_exp({0.05, -0.1, 0.2}), {1.0, 0.3, -0.2}};
  for (const slam::Camera& camera :
       {WallScene::camera(slam::CameraModel::kPinholeRadtan, {}),
        WallScene::camera(slam::CameraModel::kPinholeRadtan, {-0.25, 0.06, 0.001, -0.0008, 0}),
        WallScene::camera(slam::CameraModel::kKannalaBrandt, {-0.02, 0.005, -0.003, 0.0004, 0})}) {
    Renderer renderer(camera, {});
    expect_texture(&renderer, camera, scene_, pose);
  }
}

TEST_F(WallScene, AFisheyeSeesAllAround) {
  MeshBuilder builder(&chunk_.mesh, Eigen::Vector3d(0, 0, 1), 1.0);
  MeshBuilder::Paint paint;
  paint.fixed_light = 1.0;
  paint.material = 1;
  paint.two_sided = true;
  builder.begin_cluster();  // a box around the camera
  const double h = 5.0;
  for (const auto& [a, b] : {std::pair<Eigen::Vector3d, Eigen::Vector3d>({-h, -h, 0}, {9, -h, 0}),
                             {{9, h, 0}, {-h, h, 0}},
                             {{-h, h, 0}, {-h, -h, 0}}}) {
    const Eigen::Vector3d up(0, 0, h);
    builder.quad(a - up, b - up, b + up, a + up, paint);
  }
  for (const double z : {-h, h}) builder.quad({-h, -h, z}, {11, -h, z}, {11, h, z}, {-h, h, z}, paint);
  builder.end_cluster();
  slam::Camera::Parameters p = camera(slam::CameraModel::kKannalaBrandt, {}).parameters();
  p.fx_px = p.fy_px = 55;  // 167 by 125 degrees
  const slam::Camera fisheye(p);
  Renderer renderer(fisheye, {});
  const std::vector<SeenPoint> seen = renderer.look(scene_,
                                                    [](double) {
                                                      return forward({0, 0, 0});
                                                    },
                                                    {}, {{78, 61}, {2, 61}, {157, 61}, {78, 2}, {78, 117}});
  EXPECT_NEAR(seen[0].distance_m, 10.0, 0.01);
  for (std::size_t i = 1; i < seen.size(); ++i) {
    EXPECT_GT(seen[i].distance_m, 4.9);
    EXPECT_LT(seen[i].distance_m, 8.0);
  }
  const std::vector<float>& picture = renderer.render(scene_, [](double) { return forward({0, 0, 0}); }, {});
  EXPECT_NEAR(picture[61 * 160 + 2], 0.5, 0.01);
}

TEST_F(WallScene, TrueDistanceAndWhatIsHidden) {
  add_black_wall(5.0, -20.0, 0.0);  // right of the middle
  const slam::Camera pinhole = camera(slam::CameraModel::kPinholeRadtan, {});
  Renderer renderer(pinhole, {});
  const auto seen = renderer.look(scene_,
                                  [](double) {
                                    return forward({0, 0, 0});
                                  },
                                  {}, {{40, 61}, {120, 61}, {78, 61}});
  Eigen::Vector3d ray;
  ASSERT_TRUE(pinhole.unproject(Eigen::Vector2d(40, 61), &ray));
  EXPECT_NEAR(seen[0].distance_m, 10.0 / ray.z(), 1e-4);
  ASSERT_TRUE(pinhole.unproject(Eigen::Vector2d(120, 61), &ray));
  EXPECT_NEAR(seen[1].distance_m, 5.0 / ray.z(), 1e-4);
  EXPECT_NEAR(seen[2].nearest_m, 5.0, 0.01) << "the outline runs here";
  EXPECT_NEAR(seen[2].farthest_m, 10.0, 0.01);
}

// Column at which a row turns dark, to a fraction of a pixel: the picture is bright to its left.
double edge_of_row(const std::vector<float>& picture, int row, int width) {
  double bright = 0.0;
  for (int x = 0; x < width; ++x) bright += picture[static_cast<std::size_t>(row * width + x)];
  return bright / picture[static_cast<std::size_t>(row * width)] - 0.5;
}

TEST_F(WallScene, OutlinesAreSmoothToAFractionOfAPixel) {
  chunk_.mesh.faces[0].material = 1;
  add_black_wall(5.0, -20.0, 0.0);
  const slam::Camera pinhole = camera(slam::CameraModel::kPinholeRadtan, {});
  // Four passes an even quarter of a pixel apart are right to an eighth. Spread over 1.2 px they stand 0.3 px
  // apart, and 0.1 px across the pixels' border: 0.2 at the worst place.
  for (const auto& [blur_px, bound_px] : {std::pair(1.0, 0.126), std::pair(1.2, 0.201)}) {
    RendererOptions options;
    options.blur_px = blur_px;
    Renderer renderer(pinhole, options);
    for (double y = 0.0; y < 0.1; y += 0.004) {  // 0.08 px a step
      const auto& picture = renderer.render(scene_, [y](double) { return forward({0, -y, 0}); }, {});
      EXPECT_NEAR(edge_of_row(picture, 61, 160), 78.0 - y / 5.0 * 100.0, bound_px) << blur_px;
    }
  }
}

TEST_F(WallScene, ARollingShutterSeesEachRowAtItsTime) {
  chunk_.mesh.faces[0].material = 1;
  add_black_wall(5.0, -20.0, 0.0);
  const slam::Camera pinhole = camera(slam::CameraModel::kPinholeRadtan, {});
  Renderer renderer(pinhole, {});
  const double speed_mps = 4.0;
  const Shutter shutter{2.0, 0.0, 1e-4};
  const auto& picture = renderer.render(
      scene_,
      [=](double t) {
        return forward({0, -speed_mps * (t - 2.0), 0});
      },
      shutter);
  for (int row = 2; row < 120; row += 9) {
    const double time_s = (row - 59.5) * shutter.row_time_s;
    // Rows share a pose by fours: half a band is 0.016 px here.
    EXPECT_NEAR(edge_of_row(picture, row, 160), 78.0 - speed_mps * time_s / 5.0 * 100.0, 0.2) << row;
  }
}

TEST_F(WallScene, MotionBlursOverTheWayOfTheExposure) {
  chunk_.mesh.faces[0].material = 1;
  add_black_wall(5.0, -20.0, 0.0);
  const slam::Camera pinhole = camera(slam::CameraModel::kPinholeRadtan, {});
  Renderer renderer(pinhole, {});
  const CameraPath path = [](double t) { return forward({0, -20.0 * t, 0}); };
  const std::vector<float> sharp = renderer.render(scene_, path, {0.0, 0.0, 0.0});
  const std::vector<float> blurred = renderer.render(scene_, path, {0.0, 0.010, 0.0});  // 4 px
  const auto partly = [](const std::vector<float>& picture) {
    int count = 0;
    for (int x = 0; x < 160; ++x)
      count += picture[static_cast<std::size_t>(61 * 160 + x)] > 0.04 &&
                       picture[static_cast<std::size_t>(61 * 160 + x)] < 0.46
                   ? 1
                   : 0;
    return count;
  };
  EXPECT_LE(partly(sharp), 2);
  EXPECT_GE(partly(blurred), 3);
  EXPECT_LE(partly(blurred), 6);
  EXPECT_NEAR(edge_of_row(sharp, 61, 160), edge_of_row(blurred, 61, 160), 0.3)
      << "the middle of the exposure counts";
}

TEST_F(WallScene, FineTexturesFadeInsteadOfFlickering) {
  // A chequerboard of 2 cm seen from 10 m: several squares a pixel.
  const Texture board(64, 64, [](double u, double v) {
    return (static_cast<int>(u * 64) + static_cast<int>(v * 64)) % 2 == 0 ? 1.0 : 0.0;
  });
  materials_[0].layers = {{&board, 1.28, 1.28, 1.0 / 255.0}};
  const slam::Camera pinhole = camera(slam::CameraModel::kPinholeRadtan, {});
  Renderer renderer(pinhole, {});
  const auto& picture = renderer.render(scene_, [](double) { return forward({0, 0, 0}); }, {});
  for (int x = 20; x < 140; ++x) EXPECT_NEAR(picture[static_cast<std::size_t>(61 * 160 + x)], 0.5, 0.12);
}

TEST(SpanKernels, FillKeepsTheNearer) {
  std::vector<float> depth(40, 0.5F);
  std::vector<std::uint32_t> id(40, 7);
  span_kernels().fill(0.3F, 0.01F, 9, 37, depth.data(), id.data());
  for (int i = 0; i < 40; ++i) {
    const float mine = 0.3F + 0.01F * static_cast<float>(i);
    const bool nearer = i < 37 && mine > 0.5F;
    EXPECT_EQ(id[static_cast<std::size_t>(i)], nearer ? 9U : 7U) << i;
    EXPECT_FLOAT_EQ(depth[static_cast<std::size_t>(i)], nearer ? mine : 0.5F);
  }
}

TEST(SpanKernels, ShadeIsTheTexturesBilinearSample) {
  const Texture texture(32, 16,
                        [](double u, double v) { return 0.5 + 0.5 * periodic_noise(3, 6 * u, 6 * v, 6); });
  ShadeFace face{};
  face.den[0] = 0.2F;
  face.den[1] = -0.1F;
  face.den[2] = 1.0F;
  face.plane_m = 3.0F;
  face.layers = 1;
  ShadeLayer& layer = face.layer[0];
  const float u_num[3] = {1.7F, 0.1F, -0.4F}, v_num[3] = {0.2F, -2.1F, 0.3F};
  std::copy(u_num, u_num + 3, layer.u_num);
  std::copy(v_num, v_num + 3, layer.v_num);
  layer.gain = 1.0F / 255.0F;
  const TextureLevel& level = texture.level(0);
  layer.texels = level.texels.data();
  layer.width = 32;
  layer.height = 16;
  layer.mask_x = 31;
  layer.mask_y = 15;
  layer.stride = level.stride;
  std::vector<float> x(64), y(64), z(64, 1.0F), radiance(64, 0.0F);
  for (std::size_t i = 0; i < 64; ++i) {
    x[i] = -0.8F + 0.03F * static_cast<float>(i);
    y[i] = 0.4F - 0.011F * static_cast<float>(i);
  }
  span_kernels().shade(face, {x.data(), y.data(), z.data()}, 45, 2.0F, radiance.data());
  for (std::size_t i = 0; i < 64; ++i) {
    const float den = 0.2F * x[i] - 0.1F * y[i] + 1.0F;
    const float u = (1.7F * x[i] + 0.1F * y[i] - 0.4F) / den, v = (0.2F * x[i] - 2.1F * y[i] + 0.3F) / den;
    EXPECT_NEAR(radiance[i], i < 45 ? 2.0F * texture.sample(0, u, v) / 255.0F : 0.0F, 2e-4) << i;
  }
}

TEST(Texture, LevelsKeepTheMeanAndCutOutsTheirShare) {
  const Texture plain(128, 64,
                      [](double u, double v) { return 0.5 + 0.4 * periodic_noise(5, 9 * u, 9 * v, 9); });
  EXPECT_EQ(plain.levels(), 8);
  EXPECT_NEAR(plain.level(7).at(0, 0), plain.mean(), 1.0);
  Texture leaves(128, 128,
                 [](double u, double v) { return periodic_noise(6, 20 * u, 20 * v, 20) > 0.2 ? 0.9 : 0.0; });
  const auto share = [&](int level) {
    int covered = 0, all = 0;
    for (int y = 0; y < leaves.level(level).height; ++y) {
      for (int x = 0; x < leaves.level(level).width; ++x, ++all)
        covered += leaves.level(level).at(x, y) >= 128 ? 1 : 0;
    }
    return static_cast<double>(covered) / all;
  };
  leaves.keep_coverage();
  for (int level = 1; level < 5; ++level) EXPECT_NEAR(share(level), share(0), 0.06) << level;
}

TEST(CameraSensor, HasShotAndReadNoise) {
  slam::Camera::Parameters p;
  p.width_px = 200;
  p.height_px = 100;
  SensorDescription d;
  d.gamma = 1.0;
  d.vignetting = 0.0;
  for (const float radiance : {0.1F, 0.4F, 0.9F}) {
    CameraSensor sensor(d, p, 4);
    std::vector<std::uint8_t> grey(20000);
    const std::vector<float> light(20016, radiance);
    sensor.expose(light, {d.exposure_s, 1.0}, 0.0, 0.1, grey.data());
    double mean = 0.0, square = 0.0;
    for (const std::uint8_t g : grey) mean += g / 20000.0;
    for (const std::uint8_t g : grey) square += (g - mean) * (g - mean) / 20000.0;
    const double electrons = mean / 255.0 * d.full_well;
    const double expected = 255.0 / d.full_well * std::sqrt(electrons + d.read_noise * d.read_noise);
    EXPECT_NEAR(std::sqrt(square), std::hypot(expected, 0.29), 0.08 * expected + 0.02) << radiance;
  }
}

TEST(CameraSensor, ExposureFollowsTheLight) {
  slam::Camera::Parameters p;
  p.width_px = p.height_px = 32;
  SensorDescription d;
  CameraSensor sensor(d, p, 4);
  std::vector<std::uint8_t> grey(1024);
  double bright = 0.0, dark = 0.0;
  for (int i = 0; i < 40; ++i) {
    const std::vector<float> light(1040, i < 20 ? 0.8F : 0.1F);
    const Exposure exposure = sensor.exposure_at(0.1 * i);
    sensor.expose(light, exposure, 0.1 * i, 0.1, grey.data());
    double mean = 0.0;
    for (const std::uint8_t g : grey) mean += g / 1024.0;
    if (i == 19) bright = mean;
    if (i == 39) dark = mean;
    if (i == 20) {
      EXPECT_LT(mean, 0.5 * bright) << "it takes a while";
    }
    EXPECT_LE(exposure.time_s, d.max_exposure_s);
  }
  EXPECT_NEAR(dark, bright, 0.1 * bright);
}

}  // namespace
}  // namespace farpoint::tools::simulate
