// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "daemon/config/build_info.h"
#include "daemon/config/errors.h"
#include "daemon/config/mask_file.h"
#include "daemon/config/rig.h"
#include "daemon/output/outputs.h"

namespace farpoint::daemon {
namespace {

// The end of a run must not need more memory than the run: the map's points leave in pieces of some 100 kB.
constexpr std::size_t kLandmarksAMessage = 500;

using MemoryTable = std::vector<std::pair<std::string, std::size_t>>;

std::size_t sum_bytes(const MemoryTable& table) {
  std::size_t sum = 0;
  for (const auto& [name, bytes] : table) sum += bytes;
  return sum;
}

void print_memory_table(const MemoryTable& table, std::size_t sum) {
  constexpr double kMegabyte = 1e6;
  for (const auto& [name, bytes] : table)
    spdlog::info("memory {:<32} {:>9.3f} MB", name, static_cast<double>(bytes) / kMegabyte);
  spdlog::info("memory {:<32} {:>9.3f} MB", "in all", static_cast<double>(sum) / kMegabyte);
}

void print_calibration(const slam::CalibrationInfo& c) {
  spdlog::info(
      "calibration found: focal length {:+.2f} +- {:.2f} %, centre {:+.2f} +- {:.2f}, {:+.2f} +- {:.2f} px, "
      "k1 {:+.5f} +- {:.5f}, against the given one",
      100.0 * std::expm1(c.focal_scale), 100.0 * c.focal_scale_sigma, c.cx_px, c.cx_sigma_px, c.cy_px,
      c.cy_sigma_px, c.k1, c.k1_sigma);
  if (c.contradicted)
    spdlog::warn(
        "the images contradict the calibration: alone they want about {:.2f} times the given focal length; "
        "where that is near 1, another centre or distortion",
        std::exp(c.focal_scale_of_images));
}

}  // namespace

Session::Session(const Config& config, const slam::Rig& rig, Options options, std::vector<PoseSink*> sinks,
                 Publisher* publisher)
    : config_(config),
      names_{build_text(), fmt::format("{:016x}", config_hash(config)), std::move(options.calibration_hash),
             options.boot_counter},
      estimator_(config.estimator, rig),
      maps_(config),
      publisher_(publisher),
      tally_(options.keep_times) {
  const auto table = estimator_.memory_table();
  pool_bytes_ = sum_bytes(table);
  print_memory_table(table, pool_bytes_);
  reporter_ = std::make_unique<FrameReporter>(config, names_, std::move(sinks), publisher, &maps_,
                                              static_cast<std::int64_t>(pool_bytes_), options.with_schedule);
  if (publisher->has_sinks())
    estimator_.on_view([this](const slam::MappingNote& note) { maps_.note(estimator_.inspect(), note); });
}

const FrameOutput& Session::process(const slam::FrameInput& input, const InputCounts& in,
                                    const OutputCounts& out, const RecordedChance* recorded,
                                    StageClock* clock) {
  package_.clock = *clock;
  {
    const StageScope scope(&package_.clock, timing_t::STAGE_FRAME);
    estimator_.listen(&package_.clock);
    package_.result = recorded == nullptr ? estimator_.process(input) : process_recorded(input, *recorded);
    estimator_.listen(nullptr);
  }
  if (!package_.result.followed()) package_.clock.forget(timing_t::STAGE_TRACKING);
  package_.counts = estimator_.counts();
  package_.in = in;
  package_.chance = recorded == nullptr ? FrameChance{} : recorded->chance;
  const FrameOutput& frame = reporter_->report(&package_, out);
  *clock = package_.clock;
  tally_.note(frame.result, frame.valid, package_.counts);
  return frame;
}

const slam::FrameResult& Session::process_recorded(slam::FrameInput input, const RecordedChance& recorded) {
  input.most_features = recorded.chance.features_asked;
  return estimator_.process_recorded(input, recorded.taken);
}

const RunEnd& Session::finish(const InputCounts& in) {
  estimator_.finish();
  estimator_.release_frames();
  if (config_.estimator.calibration.refine) print_calibration(estimator_.inspect().calibration());
  summarise_maps();
  if (publisher_->has_logs()) publish_results(in);
  return end();
}

void Session::summarise_maps() {
  RunEnd& end = *tally_.mutable_end();
  end.counts = estimator_.counts();
  const slam::Inspection maps = estimator_.inspect();
  end.trajectories = maps.trajectories();
  end.landmarks = maps.landmarks();
  end.unit_scale = end.last.scale == slam::ScaleState::kAssumed ? config_.scale.assumed : 1.0;
  end.observation_distances.assign(end.trajectories.size(), {});
  maps.visit_observation_distances([&](std::int32_t map_id, double distance) {
    for (std::size_t i = 0; i < end.trajectories.size(); ++i) {
      if (end.trajectories[i].map_id == map_id) end.observation_distances[i].push_back(distance);
    }
  });
}

void Session::publish_results(const InputCounts& in) {
  publish_landmarks();
  publisher_->publish_result(ipc::kTrajectoryChannel, end().utime, make_trajectory(end()));
  summary_t summary = make_summary(end(), config_);
  summary.times_backwards = in.times_backwards;
  summary.images_undecodable = in.undecodable;
  summary.images_wrong_size = in.wrong_size;
  summary.messages_undecodable = in.messages_undecodable;
  summary.log_damages = in.log_damages;
  summary.configuration_hash = names_.configuration_hash;
  summary.calibration_hash = names_.calibration_hash;
  summary.build = names_.build;
  publisher_->publish_result(ipc::kSummaryChannel, end().utime, summary);
}

void Session::publish_landmarks() {
  const std::span<const slam::LandmarkInfo> all(end().landmarks);
  const auto sightings = [this](const slam::LandmarkInfo& l) { return estimator_.inspect().sightings(l); };
  for (std::size_t first = 0; first < all.size(); first += kLandmarksAMessage) {
    const std::size_t count = std::min(kLandmarksAMessage, all.size() - first);
    publisher_->publish_result(ipc::kLandmarksChannel, end().utime,
                               make_landmarks(end(), all.subspan(first, count), sightings));
  }
}

std::unique_ptr<Session> make_session(const Config& config, const calibration_t& calibration,
                                      Outputs* outputs, bool with_schedule, bool keep_times) {
  slam::Rig rig = make_rig(calibration, config.camera);
  read_masks(config.camera, calibration, &rig);
  outputs->set_body_is_camera(calibration.body_name.empty());
  try {
    const Session::Options options{calibration_hash(calibration), outputs->boot_counter(), with_schedule,
                                   keep_times};
    return std::make_unique<Session>(config, rig, options, outputs->sinks(), outputs->publisher());
  } catch (const std::invalid_argument& error) {
    throw ConfigError(std::string("configuration: ") + error.what());
  } catch (const std::bad_alloc&) {
    throw ConfigError(
        "configuration: not enough memory for the keys of section capacity, expected smaller ones");
  }
}

}  // namespace farpoint::daemon
