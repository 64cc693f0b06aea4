// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/world_file.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/config/yaml_file.h"
#include "slam/geometry/rig.h"
#include "tools/common/errors.h"
#include "tools/simulate/world/yaml_section.h"

namespace farpoint::tools::simulate {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMaxPlace_m = 100'000.0;

void read_terrain(YamlSection s, TerrainDescription* d) {
  s.number("relief_m", 0, 100, "m", &d->relief_m);
  s.number("relief_wavelength_m", 50, 10000, "m", &d->relief_wavelength_m);
  s.number("hills_m", 0, 1000, "m", &d->hills_m);
  s.number("hills_from_m", 20, 5000, "m", &d->hills_from_m);
  s.number("hills_wavelength_m", 100, 10000, "m", &d->hills_wavelength_m);
  s.number("mountains_m", 0, 4000, "m", &d->mountains_m);
  s.number("mountains_from_m", 50, 5000, "m", &d->mountains_from_m);
  s.number("mountains_wavelength_m", 300, 20000, "m", &d->mountains_wavelength_m);
  int cover = static_cast<int>(d->cover);
  s.word("cover", {"meadow", "fields", "gravel"}, &cover);
  d->cover = static_cast<GroundCover>(cover);
  s.number("forest_share", 0, 1, "", &d->forest_share);
  s.number("trees_per_hectare", 0, 500, "", &d->trees_per_hectare);
  s.number("rocks_per_hectare", 0, 5000, "", &d->rocks_per_hectare);
  s.finish();
}

void check_streets(const YamlSection& s, const std::string& key, const std::vector<double>& lines) {
  constexpr double kMinBlock_m = 50.0;  // houses on both sides, and a court
  if (lines.size() < 2 || lines.size() > 60)
    s.fail(key, "expected 2 to 60 numbers, found " + std::to_string(lines.size()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (std::abs(lines[i]) > kMaxPlace_m) s.fail(key, "expected places within 100 km of the origin");
    if (i > 0 && lines[i] - lines[i - 1] < kMinBlock_m)
      s.fail(key, "expected ascending numbers, at least 50 m apart");
  }
}

void read_town(YamlSection s, TownDescription* d) {
  s.require("columns_m");
  s.require("rows_m");
  d->columns_m = s.numbers("columns_m");
  d->rows_m = s.numbers("rows_m");
  check_streets(s, "columns_m", d->columns_m);
  check_streets(s, "rows_m", d->rows_m);
  s.number("pavement_m", 1, 6, "m", &d->pavement_m);
  s.integer("min_floors", 1, 20, &d->min_floors);
  s.integer("max_floors", 1, 30, &d->max_floors);
  if (d->max_floors < d->min_floors) s.fail("max_floors", "expected no less than min_floors");
  s.number("parked_cars_share", 0, 1, "", &d->parked_cars_share);
  s.number("tree_every_m", 0, 500, "m", &d->tree_every_m);
  s.number("lamp_every_m", 0, 500, "m", &d->lamp_every_m);
  s.number("sign_every_m", 0, 500, "m", &d->sign_every_m);
  s.number("park_share", 0, 1, "", &d->park_share);
  for (const char* key : {"tree_every_m", "lamp_every_m", "sign_every_m"}) {
    const double every = std::string(key) == "tree_every_m"   ? d->tree_every_m
                         : std::string(key) == "lamp_every_m" ? d->lamp_every_m
                                                              : d->sign_every_m;
    if (every > 0.0 && every < 3.0) s.fail(key, "expected 0 (none) or 3 to 500 m");
  }
  s.finish();
}

void read_road(YamlSection s, RoadDescription* d) {
  for (const std::vector<double>& row : s.rows("waypoints_m", 2)) d->waypoints_m.emplace_back(row[0], row[1]);
  s.flag("closed", &d->closed);
  s.number("corner_radius_m", 3, 5000, "m", &d->corner_radius_m);
  s.number("wander_straight_m", 20, 5000, "m", &d->wander_straight_m);
  s.degrees("wander_turn_deg", 0, 90, &d->wander_turn_rad);
  int surface = static_cast<int>(d->surface);
  s.word("surface", {"two-lanes", "motorway", "track"}, &surface);
  d->surface = static_cast<RoadSurface>(surface);
  s.flag("guard_rails", &d->guard_rails);
  for (const auto& [key, value] : {std::pair<const char*, double*>{"post_every_m", &d->post_every_m},
                                   {"tree_every_m", &d->tree_every_m},
                                   {"sign_every_m", &d->sign_every_m},
                                   {"gantry_every_m", &d->gantry_every_m},
                                   {"house_every_m", &d->house_every_m}}) {
    s.number(key, 0, 10000, "m", value);
    if (*value > 0.0 && *value < 3.0) s.fail(key, "expected 0 (none) or 3 to 10000 m");
  }
  if (d->waypoints_m.empty() && d->closed)
    s.fail("closed", "expected waypoints_m too: a road without them wanders, and never closes");
  if (!d->waypoints_m.empty() && d->waypoints_m.size() < (d->closed ? 3U : 2U)) {
    s.fail("waypoints_m", std::string("expected at least ") + (d->closed ? "3" : "2") + " points, found " +
                              std::to_string(d->waypoints_m.size()));
  }
  for (std::size_t i = 0; i < d->waypoints_m.size(); ++i) {
    if (d->waypoints_m[i].cwiseAbs().maxCoeff() > kMaxPlace_m)
      s.fail("waypoints_m", "expected places within 100 km of the origin");
    const std::size_t next = (i + 1) % d->waypoints_m.size();
    if ((next > 0 || d->closed) && (d->waypoints_m[next] - d->waypoints_m[i]).norm() < 10.0) {
      s.fail("waypoints_m", "expected points at least 10 m apart, points " + std::to_string(i + 1) + " and " +
                                std::to_string(next + 1) + " are not");
    }
  }
  s.finish();
}

void read_yard(YamlSection s, YardDescription* d) {
  s.number("length_m", 15, 200, "m", &d->length_m);
  s.number("width_m", 15, 200, "m", &d->width_m);
  s.integer("containers", 0, 100, &d->containers);
  s.integer("crates", 0, 500, &d->crates);
  s.finish();
}

void read_towers(YamlSection s, TowersDescription* d) {
  s.integer("count", 0, 200, &d->count);
  s.number("from_m", 50, 10000, "m", &d->from_m);
  s.number("to_m", 50, 10000, "m", &d->to_m);
  s.number("min_height_m", 10, 500, "m", &d->min_height_m);
  s.number("max_height_m", 10, 500, "m", &d->max_height_m);
  if (d->to_m < d->from_m) s.fail("to_m", "expected no less than from_m");
  if (d->max_height_m < d->min_height_m) s.fail("max_height_m", "expected no less than min_height_m");
  s.finish();
}

void read_traffic(YamlSection s, TrafficDescription* d) {
  s.integer("cars_ahead", 0, 50, &d->cars_ahead);
  s.integer("cars_oncoming", 0, 50, &d->cars_oncoming);
  s.number("speed_mps", 0, 60, "m/s", &d->speed_mps);
  s.finish();
}

void read_sky(YamlSection s, SkyDescription* d) {
  s.number("cloud_share", 0, 1, "", &d->cloud_share);
  s.number("cloud_height_m", 300, 12000, "m", &d->cloud_height_m);
  s.number("wind_mps", 0, 60, "m/s", &d->wind_mps);
  s.degrees("wind_direction_deg", -360, 360, &d->wind_direction_rad);
  s.degrees("sun_azimuth_deg", -360, 360, &d->sun_azimuth_rad);
  s.degrees("sun_elevation_deg", 5, 90, &d->sun_elevation_rad);
  s.number("visibility_m", 100, 200000, "m", &d->visibility_m);
  s.number("ambient", 0.1, 1, "", &d->ambient);
  s.finish();
}

void read_drive(YamlSection s, DriveDescription* d) {
  for (const std::vector<double>& row : s.rows("street_corners", 2)) {
    if (row[0] != std::floor(row[0]) || row[1] != std::floor(row[1]))
      s.fail("street_corners", "expected pairs of whole numbers: [column, row]");
    d->street_corners.emplace_back(static_cast<int>(row[0]), static_cast<int>(row[1]));
  }
  s.number("corner_radius_m", 3, 200, "m", &d->corner_radius_m);
  s.number("speed_mps", 0.1, 70, "m/s", &d->speed_mps);
  s.number("acceleration_mps2", 0.1, 10, "m/s^2", &d->acceleration_mps2);
  s.number("lateral_acceleration_mps2", 0.1, 10, "m/s^2", &d->lateral_acceleration_mps2);
  s.number("rest_s", 0, 60, "s", &d->rest_s);
  s.number("lane_offset_m", -15, 15, "m", &d->lane_offset_m);
  s.number("roughness_m", 0, 0.05, "m", &d->roughness_m);
  s.number("height_m", 0, 5, "m", &d->height_m);
  s.finish();
}

void read_flight(YamlSection s, FlightDescription* d) {
  s.require("points");
  for (const std::vector<double>& row :
       s.rows("points", 5)) {  // s, x, y, height above the ground, yaw in degrees
    if (!d->points.empty() && row[0] <= d->points.back().time_s)
      s.fail("points", "expected times that rise from row to row");
    if (row[3] < 1.0) s.fail("points", "expected heights of at least 1 m above the ground");
    d->points.push_back({row[0], {row[1], row[2], row[3]}, row[4] * kDegree});
  }
  if (d->points.size() < 2) s.fail("points", "expected at least 2 rows [s, x, y, height, yaw]");
  s.number("shake_m", 0, 1, "m", &d->shake_m);
  s.number("shake_rad", 0, 0.2, "rad", &d->shake_rad);
  s.finish();
}

// Looking direction of a camera on the body: forward, then turned to the left by yaw and down by pitch.
slam::SE3 mounted(const Eigen::Vector3d& position, double yaw_rad, double pitch_down_rad) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(pitch_down_rad, Eigen::Vector3d::UnitY()));
  return {(turn * slam::q_body_forward_camera()).normalized(), position};
}

Eigen::Vector3d read_position(YamlSection* s, const std::string& key) {
  const std::vector<double> p = s->numbers(key);
  if (p.empty()) return Eigen::Vector3d::Zero();
  if (p.size() != 3 || std::abs(p[0]) > 20 || std::abs(p[1]) > 20 || std::abs(p[2]) > 20) {
    s->fail(key, "expected 3 numbers within 20 m: x forward, y left, z up from the body's origin");
  }
  return {p[0], p[1], p[2]};
}

void read_camera(YamlSection s, CameraDescription* d) {
  slam::Camera::Parameters& p = d->parameters;
  for (const char* key : {"width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px"}) s.require(key);
  int model = 0;
  s.word("model", {"pinhole-radtan", "kannala-brandt"}, &model);
  p.model = model == 0 ? slam::CameraModel::kPinholeRadtan : slam::CameraModel::kKannalaBrandt;
  s.integer("width_px", 32, 4096, &p.width_px);
  s.integer("height_px", 32, 4096, &p.height_px);
  s.number("fx_px", 1, 20000, "px", &p.fx_px);
  s.number("fy_px", 1, 20000, "px", &p.fy_px);
  s.number("cx_px", 0, 4096, "px", &p.cx_px);
  s.number("cy_px", 0, 4096, "px", &p.cy_px);
  const std::vector<double> distortion = s.numbers("distortion");
  const bool fits = distortion.empty() || distortion.size() == 4 || (model == 0 && distortion.size() == 5);
  if (!fits)
    s.fail("distortion",
           "expected 4 numbers, or 5 for pinhole-radtan, found " + std::to_string(distortion.size()));
  std::copy(distortion.begin(), distortion.end(), p.distortion.begin());
  const std::string complaint = slam::Camera::check(p);
  if (!complaint.empty()) s.fail("fx_px", complaint);
  double yaw = 0.0, pitch = 0.0;
  const Eigen::Vector3d position = read_position(&s, "position_m");
  s.degrees("yaw_deg", -180, 180, &yaw);
  s.degrees("pitch_down_deg", -90, 90, &pitch);
  d->T_body_camera = mounted(position, yaw, pitch);
  s.number("rate_hz", 0.5, 240, "Hz", &d->rate_hz);
  s.number("row_time_s", 0, 0.001, "s", &d->row_time_s);
  s.number("stereo_baseline_m", 0.01, 5, "m", &d->stereo_baseline_m);
  s.finish();
}

void read_sensor(YamlSection s, SensorDescription* d) {
  s.number("exposure_s", 2e-5, 0.05, "s", &d->exposure_s);
  s.number("max_exposure_s", 2e-5, 0.1, "s", &d->max_exposure_s);
  s.number("adaptation_s", 0.01, 60, "s", &d->adaptation_s);
  s.number("full_well", 500, 200000, "electrons", &d->full_well);
  s.number("read_noise", 0, 200, "electrons", &d->read_noise);
  s.number("gamma", 0.3, 1, "", &d->gamma);
  s.number("vignetting", 0, 0.9, "", &d->vignetting);
  s.number("blur_px", 0.5, 4, "px", &d->blur_px);
  s.number("jump_every_s", 0, 3600, "s", &d->jump_every_s);
  s.number("jump_factor", 1, 20, "", &d->jump_factor);
  s.finish();
}

void read_imu(YamlSection s, ImuDescription* d) {
  for (const char* key :
       {"part", "gyro_noise_density", "gyro_random_walk", "accel_noise_density", "accel_random_walk"})
    s.require(key);
  s.text("part", &d->part);
  s.number("rate_hz", 10, 2000, "Hz", &d->rate_hz);
  s.number("gyro_noise_density", 0, 0.1, "rad/s/sqrt(Hz)", &d->gyro_noise_density);
  s.number("gyro_random_walk", 0, 0.1, "rad/s^2/sqrt(Hz)", &d->gyro_random_walk);
  s.number("accel_noise_density", 0, 1, "m/s^2/sqrt(Hz)", &d->accel_noise_density);
  s.number("accel_random_walk", 0, 1, "m/s^3/sqrt(Hz)", &d->accel_random_walk);
  s.number("gyro_bias_sigma", 0, 1, "rad/s", &d->gyro_bias_sigma);
  s.number("accel_bias_sigma", 0, 5, "m/s^2", &d->accel_bias_sigma);
  d->T_body_imu.t = read_position(&s, "position_m");
  s.finish();
}

void read_wheels(YamlSection s, WheelsDescription* d) {
  s.number("rate_hz", 1, 1000, "Hz", &d->rate_hz);
  s.number("track_m", 0.2, 4, "m", &d->track_m);
  s.number("wheelbase_m", 0.2, 8, "m", &d->wheelbase_m);
  s.number("scale_error", 0, 0.2, "", &d->scale_error);
  s.number("slip", 0, 0.5, "", &d->slip);
  s.number("noise_mps", 0, 1, "m/s", &d->noise_mps);
  s.finish();
}

void check_street_corners(const YamlSection& top, const WorldDescription& world) {
  const std::vector<Eigen::Vector2i>& corners = world.drive->street_corners;
  if (corners.empty()) {
    if (world.town && !world.road && !world.yard)
      top.fail("drive", "expected street_corners: this world has streets, but neither road nor yard");
    return;
  }
  if (!world.town) top.fail("drive", "street_corners are given, expected a section 'town' with the streets");
  if (corners.size() < 3) top.fail("drive", "expected at least 3 street_corners: the way is closed");
  const auto pair = [](std::size_t i) { return "street_corners, pair " + std::to_string(i + 1) + ": "; };
  const auto columns = static_cast<int>(world.town->columns_m.size()),
             rows = static_cast<int>(world.town->rows_m.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2i& c = corners[i];
    const bool is_inside = c.x() >= 0 && c.y() >= 0 && c.x() < columns && c.y() < rows;
    if (!is_inside) top.fail("drive", pair(i) + "expected a column and row of the town, counted from 0");
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2i &a = corners[i], &b = corners[(i + 1) % corners.size()];
    if ((a.x() == b.x()) == (a.y() == b.y())) {
      top.fail("drive", pair(i) + "expected the next corner on the same column or row, and another place");
    }
  }
}

void check_whole(const YamlSection& top, const WorldDescription& world) {
  if (!world.town && !world.road && !world.yard)
    top.fail("town", "expected at least one of the sections town, road, yard");
  if (world.drive.has_value() == world.flight.has_value())
    top.fail("drive", "expected one of the sections drive and flight");
  if (world.drive) check_street_corners(top, world);
  if (world.flight && world.road && world.road->waypoints_m.empty())
    top.fail("road", "expected waypoints_m: only a drive can follow a road that wanders");
  if (world.flight && world.wheels) top.fail("wheels", "expected no wheels with a flight");
}

}  // namespace

WorldDescription parse_world(const std::string& text, const std::filesystem::path& file) {
  YAML::Node root;
  if (text.size() > daemon::kMaxYamlBytes)
    throw InputError(file.string() +
                     ": longer than 1 MiB, expected a world file like config/worlds/town.yaml");
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw InputError(file.string() + ":" + std::to_string(e.mark.line + 1) + ": not valid YAML: " + e.msg);
  }
  YamlSection top(root, file, "");
  WorldDescription world;
  world.name = file.stem().string();
  int seed = 1;
  top.integer("seed", 0, 1'000'000'000, &seed);
  world.seed = static_cast<std::uint64_t>(seed);
  top.number("duration_s", 0.5, 1e6, "s", &world.duration_s);
  if (auto s = top.section("terrain")) read_terrain(*s, &world.terrain);
  if (auto s = top.section("town")) read_town(*s, &world.town.emplace());
  if (auto s = top.section("road")) read_road(*s, &world.road.emplace());
  if (auto s = top.section("yard")) read_yard(*s, &world.yard.emplace());
  if (auto s = top.section("towers")) read_towers(*s, &world.towers);
  if (auto s = top.section("traffic")) read_traffic(*s, &world.traffic);
  if (auto s = top.section("sky")) read_sky(*s, &world.sky);
  if (auto s = top.section("drive")) read_drive(*s, &world.drive.emplace());
  if (auto s = top.section("flight")) read_flight(*s, &world.flight.emplace());
  top.require("camera");
  if (auto s = top.section("camera")) read_camera(*s, &world.camera);
  if (auto s = top.section("sensor")) read_sensor(*s, &world.sensor);
  if (auto s = top.section("imu")) read_imu(*s, &world.imu.emplace());
  if (auto s = top.section("wheels")) read_wheels(*s, &world.wheels.emplace());
  top.finish();
  check_whole(top, world);
  return world;
}

}  // namespace farpoint::tools::simulate
